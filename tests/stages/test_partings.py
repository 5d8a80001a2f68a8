"""Partings of a groom: no clump, guide or copy lies across one, hair falls away from it, and lines that cannot serve."""

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from shipped_configs import shipped

from pipeline import cache
from pipeline.cache.partings import read_partings
from pipeline.config.schema import Config, Groom, Interpolate, Parting, Scene, Swatch
from pipeline.errors import InputError
from pipeline.groom import stage
from pipeline.groom.guides import shut_in
from pipeline.groom.heads import Head
from pipeline.groom.partings import partings_of
from pipeline.groom.procedural import Style
from pipeline.interpolate import stage as interpolate_stage
from pipeline.strands.chart import Chart
from pipeline.strands.partings import NOBODY, Partings

ZIGZAG = tuple((0.04 * (-1) ** k, 0.08 * k) for k in range(10))
BOX = ((-0.1, 0.3), (0.1, 0.3), (0.1, 0.45), (-0.1, 0.45))
GROOMS = {
    "centre": {"main": Parting(offset=0.0)},
    "side": {"main": Parting(offset=0.028)},
    "zig-zag": {"main": Parting(chart=ZIGZAG)},
    "box and centre": {"box": Parting(chart=BOX, closed=True), "main": Parting(offset=0.0)},
}


def config(partings: dict[str, Parting]) -> Config:
    """The default style with other partings."""
    made = shipped("default", strands=3000, guides=60, points=12, partings=partings)
    return made.model_copy(update={"interpolate": Interpolate(strands=9000)})


@pytest.fixture(params=GROOMS)
def parted(
    request: pytest.FixtureRequest, mannequin: Head, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> tuple[Config, cache.Experiment]:
    """A groom of 3,000 strands and 60 guides with partings, bound to 9,000."""
    monkeypatch.setattr(stage, "make_head", lambda _: mannequin)
    made, experiment = config(GROOMS[request.param]), cache.Experiment(tmp_path)
    stage.execute(made, experiment, "groom")
    interpolate_stage.execute(made, experiment, "strands")
    return made, experiment


def test_no_strand_has_a_guide_a_clump_or_a_parent_across_a_parting(
    parted: tuple[Config, cache.Experiment], mannequin: Head
) -> None:
    made, experiment = parted
    with cache.open(experiment.groom, "groom") as groom, cache.open(experiment.strands, "strands") as strands:
        partings = read_partings(groom)
        roots, root = (
            partings.chart.uv(p) for p in (groom["strands/points"][:, 0], strands["strands/root"][:])
        )
        guides = roots[groom["guides/strand"][:]]
        guide, weight, parent = (strands[f"strands/{name}"][:] for name in ("guide", "weight", "parent"))
    across = partings.across(root, guides, guide)
    everyone = partings.across(root, guides, np.tile(np.arange(len(guides)), (len(root), 1)))
    from_parent = partings.across(root, roots, parent[:, None])[:, 0]
    style = Style(made, mannequin)
    index = np.arange(len(roots))
    clumps = list(style.stack.strands(index).locks.values())
    gathered = [
        partings.across(roots, roots, lock.clip(min=0)[:, None])[:, 0] & (lock != NOBODY) for lock in clumps
    ]
    print(
        f"{everyone.mean():.2f} of all ways from strands to guides cross; of those they follow "
        f"{(across & (weight > 0)).sum()}, from parents {from_parent.sum()}, from clumps {np.sum(gathered)}; "
        f"{len(guides)} guides"
    )
    assert everyone.mean() > 0.1
    assert not (across & (weight > 0)).any()
    assert np.abs(weight.sum(axis=1) - 1).max() < 1e-6
    assert not from_parent.any()
    assert not np.any(gathered)
    assert min((lock != NOBODY).mean() for lock in clumps) > 0.9


def test_hair_beside_a_zig_zag_leaves_it_on_its_own_side(mannequin: Head) -> None:
    """Near the line strands set off away from it; few of them cross it in their first 2 cm."""
    style = Style(config(GROOMS["zig-zag"]), mannequin)
    points = style.strands(0, 3000).points.astype(np.float64)
    uv = style.partings.chart.uv(points[:, 0])
    off = np.linalg.norm(uv[:, None] - _dense(style.partings.lines[0]), axis=2).min(axis=1)
    near = np.flatnonzero(off < 0.03)  # about 6 mm
    step = np.linalg.norm(np.diff(points[near], axis=1), axis=2).mean(axis=1)
    later = points[near, np.round(0.02 / step).astype(int)]
    crossed = style.partings.across(uv[near], style.partings.chart.uv(later), np.arange(len(near))[:, None])
    print(f"{len(near)} strands within 6 mm of the line, {crossed.mean():.3f} of them cross it within 2 cm")
    assert len(near) > 100
    assert crossed.mean() < 0.05


def _dense(line: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.concatenate([np.linspace(a, b, 40) for a, b in pairwise(line)])


def test_a_parting_moves_sideways_and_can_be_switched_off(mannequin: Head) -> None:
    def lines(parting: Parting) -> Partings:
        return partings_of(config({"main": parting}), mannequin)

    aside = lines(Parting(offset=0.03)).lines[0]
    front, crown = mannequin.to_world(mannequin.on_skin(aside[[-15, 0]]))
    print(
        f"a parting 3 cm to the left lies at x = {1e3 * front[0]:.1f} mm in front, {1e3 * crown[0]:.1f} at the crown"
    )
    assert front[0] == pytest.approx(0.03, abs=1e-3)
    assert abs(crown[0]) < front[0]
    assert not lines(Parting(offset=0.03, enabled=False))


def test_a_line_is_the_same_however_it_is_given(mannequin: Head, tmp_path: Path) -> None:
    """As chart points, as points on the skin and as a file of either."""
    uv = np.array([[-0.2, 0.2], [0.1, 0.4], [0.1, 0.7]])
    xyz = mannequin.on_skin(uv)
    (tmp_path / "uv.csv").write_text("u,v\n" + "\n".join(f"{u},{v}" for u, v in uv))
    (tmp_path / "xyz.csv").write_text("\n".join(f"{x} {y} {z}" for x, y, z in xyz))
    rows = tuple(map(tuple, uv.tolist()))
    given = {
        "chart": Parting(chart=rows),
        "chart file": Parting(file=str(tmp_path / "uv.csv")),
        "points": Parting(points=tuple(map(tuple, xyz.tolist()))),
        "points file": Parting(file=str(tmp_path / "xyz.csv")),
    }
    found = {
        name: partings_of(config({"main": parting}), mannequin).lines[0] for name, parting in given.items()
    }
    off = {
        name: max(np.linalg.norm(line - corner, axis=1).min() for corner in uv)
        for name, line in found.items()
    }
    print("corners off by " + ", ".join(f"{name} {value:.1e}" for name, value in off.items()))
    assert max(off.values()) < 1e-6
    assert np.array_equal(found["points"], found["points file"])


@pytest.mark.parametrize(
    ("parting", "message"),
    [
        (
            lambda _: Parting(points=((0.5, 0.5, 0.5), (0.0, -0.2, 0.3))),
            "corner 0 lies 0.[0-9]+ m from the skin",
        ),
        (lambda _: Parting(chart=((0.0, 0.95), (0.1, 0.95))), "no part of it lies where hair grows"),
        (lambda _: Parting(chart=((0.0, 0.0), (0.8, 0.8))), "corner 1 lies outside of the chart"),
        (lambda folder: Parting(file=str(folder / "one.csv")), "needs two corners at least"),
        (lambda folder: Parting(file=str(folder / "four.csv")), "four.csv:1: 4 numbers; a corner has 2"),
        (lambda folder: Parting(file=str(folder / "none.csv")), "cannot be read"),
    ],
)
def test_lines_that_cannot_serve_are_refused(
    parting: Callable[[Path], Parting], message: str, mannequin: Head, tmp_path: Path
) -> None:
    (tmp_path / "one.csv").write_text("0,0")
    (tmp_path / "four.csv").write_text("0,0,0,0")
    with pytest.raises(InputError, match=message):
        partings_of(config({"bad": parting(tmp_path)}), mannequin)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({}, "expected one of offset, points, chart and file; found none"),
        ({"offset": 0.0, "file": "a.csv"}, "found offset and file"),
        ({"chart": ((0.0, 0.0),)}, "two corners at least"),
        ({"offset": 0.0, "closed": True}, "closed is for"),
    ],
)
def test_a_parting_is_given_in_one_way(values: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Parting.model_validate(values)


def test_hair_that_partings_shut_in_gets_a_guide_of_its_own() -> None:
    """Boxes in a row, all guides in the first one: every other box that has a root gets one, and only one."""
    box = np.array([[-0.04, -0.04], [0.04, -0.04], [0.04, 0.04], [-0.04, 0.04], [-0.04, -0.04]])
    partings = Partings(Chart.from_above(), tuple(box + np.array([0.1 * k, 0]) for k in range(5)))
    which = np.repeat([0, 1, 3, 4], 50)
    roots = np.zeros((200, 3), np.float32)
    roots[:, [0, 2]] = np.random.default_rng(3).uniform(-0.03, 0.03, (200, 2))
    roots[:, 0] += 0.1 * which
    found = shut_in(np.array([3, 7], np.uint32), roots, partings)
    print(f"guides added: {found}")
    assert found.tolist() == [50, 100, 150]


def test_strands_without_a_head_are_parted_as_seen_from_above(tmp_path: Path) -> None:
    """A swatch whose roots lie in the plane, parted along z."""
    groom = Groom(
        source="swatch",
        strands=400,
        guides=40,
        points=8,
        swatch=Swatch(),
        partings={"main": Parting(offset=0.005)},
    )
    made = Config(name="m", scene=Scene(head="none"), groom=groom, interpolate=Interpolate(strands=1000))
    experiment = cache.Experiment(tmp_path)
    stage.execute(made, experiment, "groom")
    interpolate_stage.execute(made, experiment, "strands")
    with cache.open(experiment.groom, "groom") as g, cache.open(experiment.strands, "strands") as s:
        x = g["strands/points"][:, 0, 0][g["guides/strand"][:]][s["strands/guide"][:]]
        across = ((x > 0.005) != (s["strands/root"][:, :1] > 0.005)) & (s["strands/weight"][:] > 0)
        left = (s["strands/root"][:, 0] > 0.005).mean()
    print(f"{left:.2f} of the strands to the left of the parting, {across.sum()} guides across it")
    assert 0.3 < left < 0.45
    assert not across.any()


@pytest.mark.parametrize("offset", [0.0, 0.02, 0.032, 0.045])
def test_an_offset_line_ends_beyond_the_hairline(mannequin: Head, offset: float) -> None:
    """Lowered onto the skin, its front end must not slide down the face: hair would flow up from there."""
    partings = partings_of(Config(name="p", groom={"partings": {"main": {"offset": offset}}}), mannequin)
    line = mannequin.on_skin(partings.lines[0])
    bald = mannequin.density(line) == 0
    print(
        f"offset {1000 * offset:.0f} mm: front end at {line[-1].round(3)}, {bald.sum()} corners without hair"
    )
    assert bald[-1]
    assert not bald[: -bald.sum()].any()
    assert line[:, 1].min() > 0.06
