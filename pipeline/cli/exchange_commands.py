"""Commands that exchange strands with other programs: import, export."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import App, Parameter

from pipeline.cli.base import (
    EXCHANGE_GROUP,
    OUTPUTS,
    ConfigFile,
    FrameRange,
    Json,
    Outputs,
    Settings,
    app,
    experiment_of,
    frame_range,
    load_config,
    print_json,
)
from pipeline.errors import InputError

if TYPE_CHECKING:
    from pipeline.groom.inspected import Inspected


@app.command(name="import", group=EXCHANGE_GROUP, sort_key=1)
def import_(
    file: Annotated[
        Path,
        Parameter(help="A groom: .tfx, .hair, .data, .usd (.usda, .usdc, .usdz), .vtp, .vtkhdf or .abc."),
    ],
    *,
    unit_scale: Annotated[
        float | None, Parameter(show_default=False, help="Metres per unit; only USD files know it.")
    ] = None,
    up_axis: Annotated[
        Literal["x", "y", "z"] | None,
        Parameter(show_default=False, help="The axis that points up; only USD files know it."),
    ] = None,
    config: Annotated[
        Path | None,
        Parameter(show_default=False, help="Write a config to begin with; it is printed unless given."),
    ] = None,
    to: Annotated[
        Path | None,
        Parameter(show_default=False, help="Also write the strands as a .usdc, .abc, .hair or .vtp file."),
    ] = None,
    json: Json = False,
) -> None:
    """Look into a groom file: strands, units, what an import repairs; and a config to begin with."""
    from pipeline.groom.inspected import inspect, lines, report, starting_config

    if unit_scale is not None and not unit_scale > 0:
        raise InputError(f"--unit-scale {unit_scale:g}: expected a number above 0")
    if config is not None and config.exists():
        raise InputError(f"{config}: is there already; choose another name")
    found = inspect(file, unit_scale, up_axis)
    if json:
        print_json(report(found))
    else:
        print("\n".join(lines(found)))
    if to is not None:
        _convert(found, to)
    if config is not None:
        config.write_text(starting_config(found, config.parent), encoding="utf-8")
    elif not json and len(found.kept):
        print(f"\n{starting_config(found, Path('configs'))}", end="")


def _convert(found: "Inspected", to: Path) -> None:
    from pipeline.config.schema import Render
    from pipeline.export.export import write_still
    from pipeline.groom.imported import width
    from pipeline.render.geometry import drawn_width

    if not len(found.kept):
        raise InputError(f"{found.path}: no strand of it can serve")
    write_still(to, found.evenly(), width(found.kept) or drawn_width(Render(), len(found.kept)))


export = App(name="export", help_format="plaintext", group=EXCHANGE_GROUP, sort_key=2)
app.command(export)


@export.command(name="openjd")
def export_openjd(
    config: ConfigFile,
    *,
    to: Annotated[
        Path | None,
        Parameter(
            show_default=False,
            help="A file above config and outputs, or both are to be given with the job; <name>.openjd.json.",
        ),
    ] = None,
    sweep: Annotated[
        bool, Parameter(negative="", show_default=False, help="All experiments of the config's [sweep].")
    ] = False,
    settings: Settings = (),
    outputs: Outputs = OUTPUTS,
) -> None:
    """Write a run, or a whole sweep, as a job template of Open Job Description, which render farms read."""
    import json

    from pipeline.cache import replacing
    from pipeline.config.sweep import load_sweep
    from pipeline.farm.openjd import sweep_template, template

    loaded = load_config(config, settings)
    path = to or Path(f"{loaded.config.name}.openjd.json")
    if sweep:
        job = sweep_template(load_sweep(config, settings), config, outputs, path.parent, settings)
    else:
        job = template(loaded.config, config, outputs, path.parent, settings)
    with replacing(path) as temporary:
        temporary.write_text(json.dumps(job, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
    print(path)


@export.default
def export_strands(
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
    from pipeline.batch.stages import Batch
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
