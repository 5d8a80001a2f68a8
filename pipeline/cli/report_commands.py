"""Commands that tell about runs: report, diff."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

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

if TYPE_CHECKING:
    from pipeline.cache import Experiment
    from pipeline.config import Loaded

Run = Annotated[Path, Parameter(help="The folder of a run, such as outputs/default, or its config.")]


@app.command(group=LOOK_GROUP, sort_key=5)
def report(config: ConfigFile, *, settings: Settings = (), outputs: Outputs = OUTPUTS) -> None:
    """Write outputs/<name>/report.html: frames, times, energies, warnings, values, versions and keys of a run."""
    loaded = load_config(config, settings)
    print(write_report(loaded, experiment_of(loaded, outputs)))


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
    return 0 if found.equal else 1


def write_report(loaded: "Loaded", experiment: "Experiment") -> Path:
    """Write the report of a run into its folder; returns its path."""
    from pipeline.cache import replacing
    from pipeline.cache.atomic import remove_stale
    from pipeline.report import run_page

    remove_stale(
        experiment.folder
    )  # of a process that was killed here; a run with nothing to do removes nothing else
    with replacing(experiment.report) as temporary:
        temporary.write_text(run_page(loaded, experiment), "utf-8")
    return experiment.report
