"""Commands that check and measure: validate, bench, doctor."""

from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any, Literal

from cyclopts import App, Parameter

from pipeline.cli.base import CHECK_GROUP, OUTPUTS, Json, Outputs, app, print_json
from pipeline.errors import DONE, FAILED, InputError

Flag = Parameter(negative="", show_default=False)
Count = Annotated[int, Parameter(help="How many.")]

_CASE = ("name", "model", "what", "measured", "reference", "error", "tolerance", "verdict")

bench = App(
    name="bench",
    help="Measure the real work of one stage: warm, median of several repeats.",
    group=CHECK_GROUP,
)
app.command(bench)


@app.command(group=CHECK_GROUP)
def validate(
    case: Annotated[
        str,
        Parameter(
            show_default=False, help="Only cases with this in their name, such as cantilever or rotor."
        ),
    ] = "",
    *,
    quick: Annotated[
        bool, Flag, Parameter(help="Short versions of the cases, in less than a minute.")
    ] = False,
    plots: Annotated[Path | None, Parameter(help="Draw pictures into this folder.")] = None,
    page: Annotated[Path | None, Parameter(help="Write a Markdown page with tables and pictures.")] = None,
    json: Json = False,
) -> int:
    """Compare the physics with closed forms and rod equations; exit code 1 outside a tolerance."""
    from pipeline.progress import track
    from pipeline.validation import all_cases
    from pipeline.validation.page import rows, summary, write_page
    from pipeline.validation.plots import draw, need_matplotlib

    cases = all_cases(quick, case)
    if not cases:
        raise InputError(f"ringlet validate {case}: no such case")
    if plots or page:
        need_matplotlib()
    results = []
    with track("validate", len(cases), "case") as bar:
        for each in cases:
            results.append(each.run())
            bar.advance()
    passed = all(result.passed for result in results)
    if json:
        print_json({"passed": passed, "quick": quick, "cases": rows(results)})
    else:
        _table(rows(results), _CASE)
        print(f"\n{summary(results)}")
    if plots:
        draw(results, plots)
    if page:
        write_page(results, page, quick)
    return DONE if passed else FAILED


@bench.command(name="simulate")
def bench_simulate(
    *,
    guides: Count = 1024,
    points: Count = 32,
    precision: Literal["float32", "float64"] = "float32",
    threads: Annotated[int, Parameter(help="0 for all processors.")] = 0,
    hair: Annotated[
        Literal["none", "grid", "capsule"], Parameter(help="Method of hair-hair contact.")
    ] = "none",
    falling: Annotated[bool, Flag, Parameter(help="Curls that fall onto one another.")] = False,
    torsion: Literal["none", "frenet", "rotor", "kirchhoff"] = "rotor",
    scaling: Annotated[
        bool, Flag, Parameter(help="How the cost grows with threads, guides (up to the given) and points.")
    ] = False,
    json: Json = False,
) -> None:
    """Steps of guides on a head: nanoseconds for each point and step, and the part of the machine's peak."""
    if scaling:
        from pipeline.bench.scaling import scaling as measure

        figures = measure(precision=precision, threads=threads or 2, most=guides)
    else:
        from pipeline.bench.simulate import bench

        figures = bench(guides, points, precision, threads, hair, falling, torsion)
    _report(figures, json)


@bench.command(name="campaign")
def bench_campaign(
    *,
    seconds: Annotated[float, Parameter(help="Of shake, before 5 s of stillness.")] = 60.0,
    json: Json = False,
) -> int:
    """A long shake of straight, wavy, curly and tight hair; exit code 1 where lengths, the head or a curl gave way."""
    from pipeline.bench.campaign import campaign

    runs = [asdict(run) for run in campaign(seconds)]
    if json:
        print_json({"runs": runs})
    else:
        _table(runs, tuple(runs[0]))
    held = all(
        r["finite"] and r["strain"] <= 1.001e-4 and r["depth"] <= 1e-4 and r["astray"] == r["flipped"] == 0
        for r in runs
    )
    return DONE if held else FAILED


@bench.command(name="interpolate")
def bench_interpolate(*, strands: Count = 1_000_000, points: Count = 32, json: Json = False) -> None:
    """Expansion of guides to the full count: seconds and memory for each frame."""
    from pipeline.bench.interpolate import bench

    _report(bench(strands=strands, points=points), json)


@bench.command(name="interpolation-error")
def bench_interpolation_error(
    *,
    quick: Annotated[bool, Flag, Parameter(help="Two kinds of hair, few strands: seconds.")] = False,
    page: Annotated[Path | None, Parameter(help="Write a Markdown page with tables and pictures.")] = None,
    plots: Annotated[Path | None, Parameter(help="Draw pictures into this folder.")] = None,
    json: Json = False,
) -> None:
    """How far strands that follow guides are from where their own simulation takes them, by method and guides."""
    from pipeline.progress import track
    from pipeline.validation.interpolation import FULL, QUICK, measure, merged
    from pipeline.validation.interpolation.page import write_page
    from pipeline.validation.interpolation.plots import draw
    from pipeline.validation.plots import need_matplotlib

    if page or plots:
        need_matplotlib("ringlet bench interpolation-error")
    plan, parts = QUICK if quick else FULL, []
    with track("interpolation", 2 * len(plan.kinds), "scene") as bar:
        for part in measure(plan):
            parts.append(part)
            bar.advance()
    report = merged(plan, parts)
    if json:
        print_json(report.as_json())
    else:
        rows = [row.as_json() for row in report.rows]
        _table(rows, tuple(rows[0]))
        print()
        floors = report.as_json()["floors"]
        _table(floors, tuple(floors[0]))
    if plots:
        draw(report, plots)
    if page:
        write_page(report, page, quick)


@bench.command(name="render")
def bench_render(
    *,
    strands: Count = 1_000_000,
    points: Count = 16,
    size: Annotated[str, Parameter(help="Width x height [px].")] = "1920x1080",
    geometry: Literal["auto", "coverage", "tubes", "ribbons", "lines"] = "auto",
    samples: Annotated[int, Parameter(help="N for N x N supersampling.")] = 2,
    threads: Annotated[int, Parameter(help="0 for all processors.")] = 0,
    chunk: Annotated[int, Parameter(help="Strands in flight at once.")] = 65_536,
    frames: Annotated[int, Parameter(help="How many are timed, after a first one.")] = 4,
    json: Json = False,
) -> None:
    """Frames in a row: seconds for each, memory, and a digest that neither threads nor chunks change."""
    from pipeline.bench.render import bench

    found = bench(
        strands, points, _size(size), geometry, samples, threads=threads, chunk=chunk, frames=frames
    )
    _report(found, json)


@bench.command(name="farm")
def bench_farm(
    *,
    frames: Count = 96,
    workers: Count = 2,
    size: Annotated[int, Parameter(help="Width and height [px].")] = 256,
    strands: Count = 4000,
    json: Json = False,
) -> None:
    """Frames by one process and by workers on the same processors: efficiency, and what a frame costs more."""
    from pipeline.farm.bench import bench

    _report(bench(frames, workers, size, strands), json)


@bench.command(name="render-table")
def bench_render_table(
    *,
    strands: Annotated[int, Parameter(help="The most.")] = 1_000_000,
    config: Annotated[Path | None, Parameter(help="Time all stages of this config as well.")] = None,
    json: Json = False,
) -> int:
    """How frames grow with strands, and that threads and chunks change none; exit code 1 where they do."""
    from pipeline.bench.render_table import table

    found = table(config, strands)
    if json:
        print_json(found)
    else:
        _table(found["rows"], tuple(found["rows"][0]))
        _report({name: found[name] for name in ("exponent", "equal")}, json)
    return DONE if found["equal"] else FAILED


@app.command(group=CHECK_GROUP)
def doctor(*, outputs: Outputs = OUTPUTS, json: Json = False) -> int:
    """Check libraries, kernels, OpenGL, memory, disk, limits and clock; tell the command that mends each."""
    from pipeline.cli.doctor import examine

    checks = examine(outputs)
    passed = all(check.passed for check in checks)
    if json:
        print_json({"passed": passed, "checks": [asdict(check) for check in checks]})
        return DONE if passed else FAILED
    for check in checks:
        print(f"{'ok     ' if check.passed else 'MISSING'} {check.name:<16} {check.found}")
        if not check.passed:
            print(f"{'':<25}{check.remedy}")
    return DONE if passed else FAILED


def _report(figures: dict[str, Any], json: bool) -> None:
    if json:
        print_json(figures)
        return
    for name, value in figures.items():
        print(f"{name:<22} {value:.4g}" if isinstance(value, float) else f"{name:<22} {value}")


def _table(rows: list[dict[str, Any]], columns: tuple[str, ...]) -> None:
    cells = [columns] + [tuple(_cell(row[name]) for name in columns) for row in rows]
    widths = [max(len(row[index]) for row in cells) for index in range(len(columns))]
    for row in cells:
        print("  ".join(f"{cell:<{width}}" for cell, width in zip(row, widths, strict=True)).rstrip())


def _cell(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "NO"
    return f"{value:.5g}" if isinstance(value, float) else str(value)


def _size(text: str) -> tuple[int, int]:
    width, _, height = text.partition("x")
    try:
        return int(width), int(height)
    except ValueError:
        raise InputError(f"--size {text}: expected width x height, such as 1920x1080") from None
