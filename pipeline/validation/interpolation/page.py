"""The report as a Markdown page with pictures."""

from collections.abc import Iterable, Sequence
from pathlib import Path

from pipeline.cache import replacing
from pipeline.validation.interpolation.plots import draw
from pipeline.validation.interpolation.report import OURS, Report, Row

_HEAD = """\
# Interpolation

What `ringlet bench interpolation-error{option}` measured; the page is written by `make interpolation`.

Most strands are never simulated: they follow a few guides, which are. Here every one of {strands:,} strands of {length:g} cm is simulated,
on a round head that shakes by 45 degrees in a second and comes to rest; then some of them alone, the guides, and the others
follow them. The settings are those of production: torsion `kirchhoff`, sag-free, contact with the head, and the strands stand for 60,000.
An error is the distance of a strand's points from where its own simulation takes them, the mean of points, frames and strands that are no
guides, in per cent of the length. At the same time strands move by {moved:.0f} % of their length on average.

Hair: {kinds}. The phase of curls varies smoothly over the scalp (4 cm from crest to crest), or at random, with the radius, from strand to strand.
"""
_METHODS = """\
## Methods

Guides of our choice, without hair on hair, so that what is measured is interpolation and nothing else. Worst is the worst strand in its worst
frame; length the largest change of a strand's length; kink how much sharper a strand's sharpest bend is than in truth; radius the error
of curls' radii. Tangent rotation is what production does; the others, in `pipeline/validation/interpolation`, are there for comparison.
Raw positions do not keep lengths. Internal forces rebuild every strand from the mean of its guides' loads with its own material: where that is better,
it is at a price of some hundred steps of simulation for each strand and frame, and not everywhere: hair under a load may have several equilibria,
and a strand that is brought to another one than its guides is far away.

![methods](pictures/{stem}/methods.png)
"""
_COUNTS = """\
## How many guides, and which

Tangent rotation; mean error in per cent of the length. Ours: k-means on root and rest shape. "Grid" is with hair on hair as by default, where
guides that are simulated alone do not feel quite what they would feel among all the others.

![number of guides](pictures/{stem}/guides.png)
"""
_FLOORS = """\
## What hair on hair makes uncertain

Tremor: two simulations of all strands that start a thousandth of a millimetre apart. Alone: {most:,} guides simulated alone, against the same strands
among all others. No interpolation can be better than that.
"""


def write_page(report: Report, path: Path, quick: bool) -> None:
    """Write the page, and its pictures to pictures/<name of the page>/ beside it."""
    draw(report, path.parent / "pictures" / path.stem)
    plan = report.plan
    kinds = "; ".join(
        f"{kind.name}: {_curl(kind.radius, kind.pitch)}" for kind in plan.kinds if not kind.random_phase
    )
    moved = 100 * sum(floor.moved for floor in report.floors) / len(report.floors)
    head = _HEAD.format(
        option=" --quick" if quick else "", strands=plan.strands, length=20, kinds=kinds, moved=moved
    )
    parts = [head, _METHODS.format(stem=path.stem), *_methods(report)]
    parts += [
        _COUNTS.format(stem=path.stem),
        *_counts(report),
        _FLOORS.format(most=plan.guides[-1]),
        *_floors(report),
    ]
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as temporary:
        temporary.write_text("\n".join(parts) + "\n", "utf-8")


def _methods(report: Report) -> Iterable[str]:
    for count in report.plan.compared:
        rows = report.find(choice="ours", hair_on_hair="none", guides=count)
        yield f"\n{count:,} guides:\n"
        names = (
            "hair",
            "method",
            "mean [%]",
            "95 of 100 [%]",
            "worst [%]",
            "length [%]",
            "kink [deg]",
            "radius [%]",
        )
        yield _table(names, [_cells(row) for row in rows])


def _cells(row: Row) -> Sequence[str]:
    e = row.error
    mean, length = f"{100 * e.mean:.2f}", f"{100 * e.length:.2g}"
    figures = [
        mean,
        f"{100 * e.p95:.2f}",
        f"{100 * e.worst:.1f}",
        length,
        f"{e.kink:+.1f}",
        f"{100 * e.radius:+.1f}",
    ]
    return [row.groom, f"**{row.method}**" if row.method == OURS else row.method, *figures]


def _counts(report: Report) -> Iterable[str]:
    cases = [("none", "ours"), ("none", "random"), ("grid", "ours")]
    names = ["hair", "hair on hair", "choice", *(f"{count:,}" for count in report.plan.guides)]
    lines = []
    for kind in report.plan.kinds:
        for hair, choice in cases:
            rows = report.find(groom=kind.name, hair_on_hair=hair, choice=choice, method=OURS)
            lines.append([kind.name, hair, choice, *(f"{100 * row.error.mean:.2f}" for row in rows)])
    yield _table(names, lines)


def _floors(report: Report) -> Iterable[str]:
    yield _table(
        ("hair", "moved [%]", "tremor [%]", "alone [%]"),
        [
            [f.groom, f"{100 * f.moved:.1f}", f"{100 * f.tremor:.2g}", f"{100 * f.alone:.2g}"]
            for f in report.floors
        ],
    )


def _table(names: Sequence[str], lines: Sequence[Sequence[str]]) -> str:
    rows = [names, ["---"] * len(names), *lines]
    return "\n".join(f"| {' | '.join(row)} |" for row in rows) + "\n"


def _curl(radius: float, pitch: float) -> str:
    return f"radius {1e3 * radius:g} mm, pitch {1e3 * pitch:g} mm" if radius else "no curl"
