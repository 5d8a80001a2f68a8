"""Commands that look and make nothing again: status, plan, config, inspect; report and diff, about runs."""

from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

from pipeline.cli.base import (
    LOOK_GROUP,
    OUTPUTS,
    ConfigFile,
    Json,
    Outputs,
    Settings,
    app,
    experiment_of,
    load_config,
    print_json,
)
from pipeline.errors import DONE, FAILED, InputError

Run = Annotated[Path, Parameter(help="The folder of a run, such as outputs/default, or its config.")]


@app.command(group=LOOK_GROUP, sort_key=1)
def status(
    config: ConfigFile,
    *,
    settings: Settings = (),
    outputs: Outputs = OUTPUTS,
    json: Json = False,
) -> None:
    """Tell which stages are fresh, which value made the others stale, who is at work, and what the disk holds."""
    from pipeline.batch.stages import Batch
    from pipeline.batch.sweep import batch_of
    from pipeline.cli.status import examine, examine_sweep, lines, sweep_lines
    from pipeline.config.sweep import load_sweep

    loaded = load_config(config, settings)
    found = examine(Batch(loaded.config, experiment_of(loaded, outputs)))
    said = lines(found)
    if loaded.config.sweep is not None:
        runs = load_sweep(config, settings).runs
        found["sweep"] = examine_sweep([batch_of(run, outputs) for run in runs])
        said += sweep_lines(found["sweep"])
    if json:
        print_json(found)
    else:
        print(*said, sep="\n")


@app.command(group=LOOK_GROUP, sort_key=2)
def plan(
    config: ConfigFile, *, settings: Settings = (), outputs: Outputs = OUTPUTS, json: Json = False
) -> None:
    """Estimate memory, disk and time of every stage before anything runs, beside what is free here."""
    from pipeline.cli.machine import GB, disk, memory, shortage
    from pipeline.cli.plan import estimate

    costs = estimate(load_config(config, settings).config)
    stages = costs["stages"]
    short = [text for name in stages if (text := shortage(name, stages[name]["peak_rss_gb"]))]
    space = disk(outputs)
    if costs["disk_gb"] * GB > space.free:
        short.append(
            f"{space.limit}: {costs['disk_gb']:.2f} GB are needed and {space.free / GB:.2f} GB are free"
        )
    free = {name: memory(name) for name in stages}
    least = min(free.values(), key=lambda room: room.free)
    if json:
        here = {"memory_gb": least.free / GB, "limit": least.limit, "disk_gb": space.free / GB}
        print_json(costs | {"here": here, "short": short})
        return
    print(f"{'':<12} {'peak memory':>12} {'disk':>12} {'time':>12}")
    for name, cost in {**stages, "in all": costs}.items():
        taken, peak = f"{cost['disk_gb']:.3f} GB", f"{cost['peak_rss_gb']:.2f} GB"
        print(f"{name:<12} {peak:>12} {taken:>12} {cost['seconds']:>10.0f} s")
    print(f"{'free here':<12} {least.free / GB:>9.2f} GB {space.free / GB:>9.3f} GB   ({least.limit})")
    for text in short:
        print(text)


@app.command(group=LOOK_GROUP, sort_key=3)
def config(
    config: Annotated[Path | None, Parameter(help="A config, such as configs/default.toml.")] = None,
    *,
    schema: Annotated[bool, Parameter(negative="", help="Print the JSON schema for editors.")] = False,
    settings: Settings = (),
    json: Json = False,
) -> None:
    """Show every resolved value and the file:line that it comes from."""
    if schema:
        from pipeline.config.export import schema_text

        print(schema_text(), end="")
        return
    if config is None:
        raise InputError("ringlet config: give a config, or --schema")
    from pipeline.config.export import resolved

    values = resolved(load_config(config, settings))
    if json:
        print_json({key: {"value": value, "origin": origin} for key, (value, origin) in values.items()})
        return
    width = max(len(f"{key} = {value}") for key, (value, _) in values.items() if len(str(value)) < 40)
    for key, (value, origin) in values.items():
        print(f"{f'{key} = {value}':<{width}}  # {origin}")


@app.command(group=LOOK_GROUP, sort_key=4)
def inspect(
    file: Annotated[Path, Parameter(help="A file of outputs/: groom.h5, guides.h5, strands.h5 or a frame.")],
    *,
    json: Json = False,
) -> int:
    """Show what is in a file, with every checksum verified; exit code 1 when it is damaged."""
    from pipeline.cli.inspect import contents

    found = contents(file)
    if json:
        print_json(found)
    else:
        _print_contents(found)
    return DONE if found["valid"] else FAILED


@app.command(group=LOOK_GROUP, sort_key=5)
def report(config: ConfigFile, *, settings: Settings = (), outputs: Outputs = OUTPUTS) -> None:
    """Write outputs/<name>/report.html: frames, times, energies, warnings, values, versions and keys of a run."""
    from pipeline.report import write_run_page

    loaded = load_config(config, settings)
    print(write_run_page(loaded, experiment_of(loaded, outputs)))


@app.command(group=LOOK_GROUP, sort_key=6)
def diff(
    first: Run,
    second: Run,
    *,
    page: Annotated[Path | None, Parameter(help="Write an HTML page of frames that differ.")] = None,
    outputs: Outputs = OUTPUTS,
    json: Json = False,
) -> int:
    """Tell which values, versions and frames differ between two runs; exit code 1 when something does."""
    from pipeline.cache import Experiment, replacing
    from pipeline.report.diff import diff as difference_of
    from pipeline.report.diff import pairs_of

    one, other = (
        experiment_of(load_config(path, ()), outputs) if path.suffix == ".toml" else Experiment(path)
        for path in (first, second)
    )
    found = difference_of(one, other)
    if page is not None:
        from pipeline.compare.page import comparison_page

        with replacing(page) as temporary:
            temporary.write_text(
                comparison_page(f"{first} and {second}", pairs_of(found, one, other)), "utf-8"
            )
    if json:
        print_json(found.as_json())
    else:
        print("\n".join(found.lines()))
    return DONE if found.equal else FAILED


def _print_contents(found: dict[str, Any]) -> None:
    for name, value in found.items():
        if isinstance(value, dict):
            print(f"{name}:")
            for key, item in value.items():
                several = isinstance(item, dict)
                print(
                    f"  {key:<28} {', '.join(f'{part} {each}' for part, each in item.items()) if several else item}"
                )
        elif value is not None:
            print(f"{name + ':':<12} {value}")
