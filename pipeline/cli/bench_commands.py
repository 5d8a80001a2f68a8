"""The commands that measure: bench."""

from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import App, Parameter

from pipeline.cli.base import (
    CHECK_GROUP,
    Flag,
    Json,
    app,
    load_config,
    print_figures,
    print_json,
    print_table,
)
from pipeline.errors import DONE, FAILED, InputError

Count = Annotated[int, Parameter(help="How many.")]
CONFIG = Path("configs/default.toml")
Pixels = Annotated[int, Parameter(help="Width and height [px].")]

bench = App(
    name="bench",
    help="Measure the real work of one stage: warm, median of several repeats.",
    group=CHECK_GROUP,
)
app.command(bench)


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
    still: Annotated[bool, Flag, Parameter(help="Hair at rest, in place of a head that shakes.")] = False,
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

        figures = bench(guides, points, precision, threads, hair, falling, torsion, still)
    print_figures(figures, json)


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
        print_table(runs, tuple(runs[0]))
    held = all(
        r["finite"] and r["strain"] <= 1.001e-4 and r["depth"] <= 1e-4 and r["astray"] == r["flipped"] == 0
        for r in runs
    )
    return DONE if held else FAILED


@bench.command(name="interpolate")
def bench_interpolate(*, strands: Count = 1_000_000, points: Count = 32, json: Json = False) -> None:
    """Expansion of guides to the full count: seconds and memory for each frame."""
    from pipeline.bench.interpolate import bench

    print_figures(bench(strands=strands, points=points), json)


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
        print_table(rows, tuple(rows[0]))
        print()
        floors = report.as_json()["floors"]
        print_table(floors, tuple(floors[0]))
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
    frames: Annotated[int, Parameter(help="How many are timed, after a first one.")] = 12,
    json: Json = False,
) -> None:
    """Frames in a row: seconds for each, memory, and a digest that neither threads nor chunks change."""
    from pipeline.bench.render import bench

    found = bench(
        strands, points, _size(size), geometry, samples, threads=threads, chunk=chunk, frames=frames
    )
    print_figures(found, json)


@bench.command(name="farm")
def bench_farm(
    *,
    frames: Count = 96,
    workers: Count = 2,
    size: Pixels = 256,
    strands: Count = 4000,
    json: Json = False,
) -> None:
    """Frames by one process and by workers on the same processors: efficiency, and what a frame costs more."""
    from pipeline.farm.bench import bench

    print_figures(bench(frames, workers, size, strands), json)


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
        print_table(found["rows"], tuple(found["rows"][0]))
        print_figures({name: found[name] for name in ("exponent", "equal")}, json)
    return DONE if found["equal"] else FAILED


@bench.command(name="groom")
def bench_groom(
    config: Annotated[Path, Parameter(help="Whose operators.")] = CONFIG,
    *,
    strands: Count = 1_000_000,
    json: Json = False,
) -> None:
    """The groom of a config with another number of strands: seconds and memory."""
    from pipeline.bench.groom import bench

    print_figures(bench(config, strands), json)


@bench.command(name="sweep")
def bench_sweep(
    *,
    experiments: Count = 8,
    frames: Count = 4,
    size: Pixels = 128,
    strands: Count = 2000,
    json: Json = False,
) -> None:
    """Experiments that differ in a light: how often each stage is made, and what an experiment costs beside its work."""
    from pipeline.bench.sweep import bench

    print_figures(bench(experiments, frames, size, strands), json)


@bench.command(name="page")
def bench_page(
    page: Annotated[Path, Parameter(help="Markdown; figures go to a .json beside it.")],
    *,
    config: Annotated[Path, Parameter(help="Which config is groomed, and run as a whole.")] = CONFIG,
    quick: Annotated[bool, Flag, Parameter(help="Smaller sizes: less than two minutes.")] = False,
) -> None:
    """All benchmarks one after the other, each in a process of its own, and a page of them: eight minutes."""
    from pipeline.bench.page import write_page
    from pipeline.bench.performance import QUICK, Sizes, measure, sections
    from pipeline.farm.cluster import need_distributed
    from pipeline.progress import track

    need_distributed()
    load_config(config, ())  # tells what is wrong with it
    sizes = QUICK if quick else Sizes()
    tables = sections(sizes, config)
    with track("bench", sum(len(table.tasks) for table in tables), "benchmark") as bar:
        report = measure(sizes, config, bar.advance)
    print(page, write_page(report, tables, page), sep="\n")


def _size(text: str) -> tuple[int, int]:
    width, _, height = text.partition("x")
    try:
        return int(width), int(height)
    except ValueError:
        raise InputError(f"--size {text}: expected width x height, such as 1920x1080") from None
