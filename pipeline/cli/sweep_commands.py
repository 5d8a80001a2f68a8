"""The command for many experiments of one config: sweep."""

from typing import Annotated

from cyclopts import Parameter

from pipeline import log
from pipeline.cli.base import (
    AS_USUAL,
    HERE,
    OUTPUTS,
    STAGES_GROUP,
    ConfigFile,
    FrameRange,
    Manner,
    Outputs,
    Settings,
    Stage,
    Where,
    app,
    frame_range,
    stages_until,
)

Only = Annotated[
    str,
    Parameter(
        show_default=False,
        help='Experiments whose name, or what follows its "@", fits a pattern: "*irradiance=2*".',
    ),
]
Names = Annotated[
    bool, Parameter(negative="", show_default=False, help="Print the experiments' names and do nothing.")
]


@app.command(group=STAGES_GROUP, sort_key=1.5)
def sweep(
    config: ConfigFile,
    *,
    only: Only = "*",
    names: Names = False,
    until: Stage = "render",
    frames: FrameRange = "",
    settings: Settings = (),
    outputs: Outputs = OUTPUTS,
    manner: Manner = AS_USUAL,
    where: Where = HERE,
) -> None:
    """Run every experiment of a config's [sweep]; stages that its values do not touch are made once.

    With --until or --frames, which make parts of experiments, there is neither table nor page.
    """
    from pipeline.batch.sweep import batch_of, chosen, make_all
    from pipeline.batch.table import write_table
    from pipeline.cache import Experiment
    from pipeline.cli.run_commands import refuse_what_does_not_fit
    from pipeline.config.sweep import load_sweep
    from pipeline.report import write_sweep_page

    log.use(manner.log_format)
    swept = load_sweep(config, settings)
    runs = chosen(swept, only)
    if names:
        print("\n".join(run.name for run in runs))
        return
    stages = stages_until(until)
    wanted = frame_range(frames, min(run.loaded.config.simulate.frames for run in runs))
    with log.kept_in(Experiment(outputs / swept.base.config.name).log):
        batches = [batch_of(run, outputs) for run in runs]
        if not manner.force:
            for batch in batches:
                refuse_what_does_not_fit(batch, stages, where, wanted)
        try:
            if not where.here:
                from pipeline.farm.run import make

                make(batches, where.workers, where.scheduler, until, wanted)
            make_all(batches, stages=stages, frames=wanted)
        finally:
            if until == "render" and wanted is None:
                table = write_table(swept, outputs, config)
        if until == "render" and wanted is None:
            print(table, write_sweep_page(table), sep="\n")
