"""What all commands share: the application, the options that recur, and JSON on standard output."""

import importlib.metadata
import json
import math
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import App, Group, Parameter

from pipeline.errors import InputError
from pipeline.log import Format

if TYPE_CHECKING:
    from pipeline.cache import Experiment
    from pipeline.config import Loaded

STAGES_GROUP = Group("Run", sort_key=0)
LOOK_GROUP = Group("Look", sort_key=1)
EXCHANGE_GROUP = Group("Exchange", sort_key=2)
CHECK_GROUP = Group("Check and measure", sort_key=3)

app = App(
    name="ringlet",
    help="Batch hair pipeline: config -> groom -> simulate -> interpolate -> render.",
    help_format="plaintext",
    help_epilogue=(
        "Exit codes: 0 done; 1 a check failed; 2 wrong input, too little disk or memory;\n"
        "70 a fault of ringlet; 129, 130, 143 stopped by SIGHUP, SIGINT, SIGTERM."
    ),
    version=lambda: importlib.metadata.version("ringlet"),
    suppress_keyboard_interrupt=False,
)

Settings = Annotated[
    tuple[str, ...],
    Parameter(
        name=["-s", "--set"],
        negative="",
        show_default=False,
        allow_leading_hyphen=True,
        help='Override a value, as in -s "simulate.hair.radius=45 um"; may be repeated.',
    ),
]
Outputs = Annotated[Path, Parameter(help="Folder that holds a folder for each experiment.")]
Json = Annotated[
    bool, Parameter(name="--json", negative="", show_default=False, help="Print one JSON object.")
]
Flag = Parameter(negative="", show_default=False)
ConfigFile = Annotated[Path, Parameter(help="A config, such as configs/default.toml.")]


@Parameter(name="*")
@dataclass(frozen=True)
class Manner:
    """How a command that makes something goes about it, whatever it makes."""

    log_format: Annotated[
        Format,
        Parameter(
            env_var="RINGLET_LOG_FORMAT", help="Lines on standard error: plain text, or JSON for programs."
        ),
    ] = "text"
    force: Annotated[
        bool, Parameter(negative="", show_default=False, help="Begin even if memory may not suffice.")
    ] = False


AS_USUAL = Manner()


@Parameter(name="*")
@dataclass(frozen=True)
class Where:
    """Where a command that makes something does it: here, or on workers."""

    workers: Annotated[
        int | None,
        Parameter(show_default=False, help="Start so many worker processes, which share this machine."),
    ] = None
    scheduler: Annotated[
        str,
        Parameter(show_default=False, help='Use the workers of a Dask scheduler, such as "tcp://host:8786".'),
    ] = ""

    @property
    def here(self) -> bool:
        """Whether there are no workers."""
        return self.workers is None and not self.scheduler


HERE = Where()

FrameRange = Annotated[
    str, Parameter(show_default=False, help='Only these frames, counted from 1: "10-20", or one, "7".')
]

Stage = Annotated[str, Parameter(help="The last stage to run: groom, simulate, interpolate or render.")]

OUTPUTS = Path("outputs")


def load_config(config: Path, settings: tuple[str, ...]) -> "Loaded":
    """Load a config with its overrides; raises InputError."""
    from pipeline.config import load

    return load(config, settings)


def experiment_of(loaded: "Loaded", outputs: Path) -> "Experiment":
    """Return the experiment's folder, named after the config."""
    from pipeline.cache import Experiment

    return Experiment(outputs / loaded.config.name)


def stages_until(stage: str) -> tuple[str, ...]:
    """Stages from the first to that of `--until`. Raises InputError."""
    from pipeline.config import STAGES

    if stage not in STAGES:
        raise InputError(f"--until {stage}: expected one of {', '.join(STAGES)}")
    return STAGES[: STAGES.index(stage) + 1]


def frame_range(text: str, count: int) -> range | None:
    """Frames of `--frames`, counted from 1; None for all. Raises InputError."""
    if not text:
        return None
    first, dash, last = text.partition("-")
    try:
        wanted = range(int(first), int(last if dash else first) + 1)
    except ValueError:
        raise InputError(f'--frames {text}: expected a range such as "10-20" or a number') from None
    if not wanted or wanted[0] < 1 or wanted[-1] > count:
        raise InputError(f"--frames {text}: expected a range within 1-{count}")
    return wanted


def print_json(value: dict[str, Any]) -> None:
    """Print one object on standard output; what is not a finite number is null, as JSON has no other word."""
    json.dump(_finite(value), sys.stdout, indent=2, ensure_ascii=False, allow_nan=False)
    sys.stdout.write("\n")


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def print_figures(figures: dict[str, Any], json: bool) -> None:
    """Print figures, one a line, or as JSON."""
    if json:
        print_json(figures)
        return
    for name, value in figures.items():
        print(f"{name:<22} {value:.4g}" if isinstance(value, float) else f"{name:<22} {value}")


def print_table(rows: list[dict[str, Any]], columns: tuple[str, ...]) -> None:
    """Print these columns of rows, aligned."""
    cells = [columns] + [tuple(_cell(row[name]) for name in columns) for row in rows]
    widths = [max(len(row[index]) for row in cells) for index in range(len(columns))]
    for row in cells:
        print("  ".join(f"{cell:<{width}}" for cell, width in zip(row, widths, strict=True)).rstrip())


def _cell(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "NO"
    return f"{value:.5g}" if isinstance(value, float) else str(value)
