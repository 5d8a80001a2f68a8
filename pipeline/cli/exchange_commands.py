"""Commands that exchange strands with other programs: import, export."""

from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from pipeline.cli.base import (
    EXCHANGE_GROUP,
    OUTPUTS,
    ConfigFile,
    FrameRange,
    Outputs,
    Settings,
    app,
    experiment_of,
    frame_range,
    load_config,
)
from pipeline.errors import InputError


@app.command(group=EXCHANGE_GROUP, sort_key=2)
def export(
    config: ConfigFile,
    *,
    kind: Annotated[
        Literal["usd", "abc", "hair", "vtp"],
        Parameter(name="--format", help="usd and abc: one file with all frames; hair and vtp: one a frame."),
    ],
    what: Annotated[
        Literal["strands", "guides"], Parameter(help="The full count of strands, or the guides.")
    ] = "strands",
    frames: FrameRange = "",
    strands: Annotated[
        int | None, Parameter(show_default=False, help="Only the first so many, which are evenly spread.")
    ] = None,
    to: Annotated[
        Path | None, Parameter(show_default=False, help="Folder; outputs/<name>/export unless given.")
    ] = None,
    settings: Settings = (),
    outputs: Outputs = OUTPUTS,
) -> None:
    """Write strands in motion for other programs: metres, y up, widths as diameters."""
    from pipeline.cli.stages import Batch
    from pipeline.export.export import export as write

    if strands is not None and strands < 1:
        raise InputError(f"--strands {strands}: expected a number above 0")
    loaded = load_config(config, settings)
    wanted = frame_range(frames, loaded.config.simulate.frames)
    experiment = experiment_of(loaded, outputs)
    batch = Batch(loaded.config, experiment)
    for stage in ("groom", "simulate") if what == "guides" else ("groom", "simulate", "interpolate"):
        batch.make(stage, touch=False)
    print(
        write(
            loaded.config,
            experiment,
            kind,
            wanted or batch.all_frames,
            what=what,
            strands=strands,
            folder=to,
        )
    )
