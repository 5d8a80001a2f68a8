"""Commands that make something: run, one per stage, movie, sheet, and what make needs."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

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
    experiment_of,
    frame_range,
    load_config,
    stages_until,
)
from pipeline.errors import InputError

if TYPE_CHECKING:
    from pipeline.batch.stages import Batch
    from pipeline.cache import Experiment
    from pipeline.config import Loaded

_CODEC = "h264 (.mp4), av1 (.av1.mp4) or ffv1 (.mkv, lossless, all bits of the frames)."


@app.command(group=STAGES_GROUP, sort_key=1)
def run(
    config: ConfigFile,
    *,
    until: Stage = "render",
    frames: FrameRange = "",
    settings: Settings = (),
    outputs: Outputs = OUTPUTS,
    manner: Manner = AS_USUAL,
    where: Where = HERE,
) -> None:
    """Run all stages that are not fresh."""
    _make(config, until, settings, outputs, manner, frames, everything=True, where=where)


@app.command(group=STAGES_GROUP, sort_key=2)
def groom(
    config: ConfigFile, *, settings: Settings = (), outputs: Outputs = OUTPUTS, manner: Manner = AS_USUAL
) -> None:
    """Stage 1: all strands at rest on the head."""
    _make(config, "groom", settings, outputs, manner)


@app.command(group=STAGES_GROUP, sort_key=3)
def simulate(
    config: ConfigFile, *, settings: Settings = (), outputs: Outputs = OUTPUTS, manner: Manner = AS_USUAL
) -> None:
    """Stage 2: the guides in motion."""
    _make(config, "simulate", settings, outputs, manner)


@app.command(group=STAGES_GROUP, sort_key=4)
def interpolate(
    config: ConfigFile, *, settings: Settings = (), outputs: Outputs = OUTPUTS, manner: Manner = AS_USUAL
) -> None:
    """Stage 3: which guides move which strand."""
    _make(config, "interpolate", settings, outputs, manner)


@app.command(group=STAGES_GROUP, sort_key=5)
def render(
    config: ConfigFile,
    *,
    frames: FrameRange = "",
    settings: Settings = (),
    outputs: Outputs = OUTPUTS,
    manner: Manner = AS_USUAL,
    where: Where = HERE,
) -> None:
    """Stage 4: the frames as PNG files."""
    _make(config, "render", settings, outputs, manner, frames, where=where)


@app.command(group=STAGES_GROUP, sort_key=6)
def movie(
    config: ConfigFile,
    *,
    codec: Annotated[Literal["h264", "av1", "ffv1"] | None, Parameter(help=_CODEC)] = None,
    settings: Settings = (),
    outputs: Outputs = OUTPUTS,
) -> None:
    """Put the frames together: an .mp4 where PyAV is installed, else an animated PNG."""
    from pipeline.render.movie import write_movie

    loaded = load_config(config, settings)
    experiment = experiment_of(loaded, outputs)
    print(write_movie(_rendered(loaded, experiment), experiment.folder, loaded.config.simulate.fps, codec))


@app.command(group=STAGES_GROUP, sort_key=7)
def sheet(config: ConfigFile, *, settings: Settings = (), outputs: Outputs = OUTPUTS) -> None:
    """Put small copies of the frames on one page: the contact sheet."""
    from pipeline.render.movie import write_sheet

    loaded = load_config(config, settings)
    experiment = experiment_of(loaded, outputs)
    print(write_sheet(_rendered(loaded, experiment), experiment.folder))


@app.command(group=STAGES_GROUP, sort_key=8)
def turntable(
    config: ConfigFile,
    *,
    frames: Annotated[int, Parameter(help="Frames of one turn.")] = 72,
    codec: Annotated[Literal["h264", "av1", "ffv1"] | None, Parameter(help=_CODEC)] = None,
    settings: Settings = (),
    outputs: Outputs = OUTPUTS,
    manner: Manner = AS_USUAL,
) -> None:
    """Go once around the hair while the head holds still, as a movie: all stages, in outputs/<name>-turntable."""
    from pipeline.render.movie import write_movie

    name = load_config(config, settings).config.name
    around = (
        f"name={name}-turntable",
        f"simulate.frames={frames}",
        "simulate.motion={}",
        'scene.camera.turntable="1 turn"',
        "scene.camera.keyframes=[]",
    )
    settings = (*around, *settings)
    _make(config, "render", settings, outputs, manner, everything=True)
    loaded = load_config(config, settings)
    experiment = experiment_of(loaded, outputs)
    print(write_movie(_rendered(loaded, experiment), experiment.folder, loaded.config.simulate.fps, codec))


@app.command(group=STAGES_GROUP, sort_key=9)
def keys(config: ConfigFile, *, outputs: Outputs = OUTPUTS) -> None:
    """Write the stamps and rules that make reads: outputs/<name>/keys/ and targets.mk."""
    from pipeline.cli.stamps import write_stamps

    loaded = load_config(config, ())
    write_stamps(config, loaded, experiment_of(loaded, outputs))


def _make(
    config: Path,
    stage: str,
    settings: tuple[str, ...],
    outputs: Path,
    manner: Manner,
    frames: str = "",
    everything: bool = False,
    where: Where = HERE,
) -> None:
    """Make a stage and whatever it needs; `everything` also makes the stages before it that it does not need."""
    from pipeline.cli.machine import refuse_bare_start

    log.use(manner.log_format)
    refuse_bare_start()  # before anything large is loaded
    from pipeline.batch.stages import Batch
    from pipeline.cache import where_writable
    from pipeline.config import NEEDS
    from pipeline.report import write_run_page

    earlier = stages_until(stage)[:-1]
    loaded = load_config(config, settings)
    wanted = frame_range(frames, loaded.config.simulate.frames)
    batch = Batch(loaded.config, experiment_of(loaded, outputs))
    before = earlier if everything else NEEDS[stage]
    with log.kept_in(batch.experiment.log):
        if not manner.force:
            refuse_what_does_not_fit(batch, (*before, stage), where, wanted)
        if not where.here:
            from pipeline.farm.run import make

            make([batch], where.workers, where.scheduler, stage, wanted)
        for name in before:
            batch.make(name, touch=everything)
        batch.make(stage, wanted if stage == "render" else None)
        if stage == "render" and wanted is None:
            with where_writable():
                write_run_page(loaded, batch.experiment)


def refuse_what_does_not_fit(
    batch: "Batch", stages: Sequence[str], where: Where = HERE, frames: range | None = None
) -> None:
    """Refuse, before anything runs, when a stage that has to be made is planned to need more memory than is free.

    Workers of this machine render side by side; what those of a scheduler have, only they know.
    """
    if where.scheduler:
        return
    from pipeline.cli.machine import shortage
    from pipeline.cli.plan import estimate

    costs = estimate(batch.config)["stages"]
    for stage in stages:
        processes = (where.workers or 1) if stage == "render" else 1
        short = shortage(stage, processes * costs[stage]["peak_rss_gb"])
        if short and not batch.state(stage, frames).fresh:
            raise InputError(f"ringlet: {short}")


def _rendered(loaded: "Loaded", experiment: "Experiment") -> list[Path]:
    """List the frames of a config; frames that an older run left behind are no part of it."""
    numbers = range(1, loaded.config.simulate.frames + 1)
    frames = [experiment.frames / f"{number:04d}.png" for number in numbers]
    missing = [frame for frame in frames if not frame.exists()]
    if missing:
        raise InputError(
            f"{missing[0]}: no such frame; `ringlet run` makes the {len(missing)} that are missing"
        )
    return frames
