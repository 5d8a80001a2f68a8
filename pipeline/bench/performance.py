"""All benchmarks of the performance page: which commands, of which sizes, and how their figures are told."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pipeline.bench import command
from pipeline.bench.machine import describe

FORMAT = 1
Figures = dict[str, Any]
Rows = list[tuple[str, Figures]]


@dataclass(frozen=True)
class Sizes:
    """How much is measured."""

    guides: int = 1024
    most_guides: int = 4096
    """Of the table that tells how cost grows."""
    strands: int = 1_000_000
    groomed: int = 1_000_000
    drawn: int = 1_000_000
    whole: bool = True
    """Whether to run all stages of the config, too."""
    frames: int = 96
    """Of the farm."""
    pixels: int = 256
    experiments: int = 8
    quick: bool = False
    """Whether this is the short form of the command."""


QUICK = Sizes(
    256, 512, 100_000, 50_000, 30_000, whole=False, frames=12, pixels=128, experiments=3, quick=True
)


def _one(figures: Figures) -> Rows:
    return [("", figures)]


@dataclass(frozen=True)
class Task:
    """One command of `ringlet bench`, and the rows that its figures make."""

    what: str
    words: tuple[object, ...]
    unfold: Callable[[Figures], Rows] = _one

    @property
    def command(self) -> str:
        """As one types it."""
        return " ".join(map(str, ("ringlet", "bench", *self.words)))


@dataclass(frozen=True)
class Section:
    """A table of the page."""

    title: str
    about: str
    columns: dict[str, str]
    """Heading of each figure that is shown."""
    tasks: list[Task] = field(default_factory=list)


def sections(sizes: Sizes, config: Path) -> list[Section]:
    """Every table; `config` is the one that is groomed, and run as a whole."""
    return [_simulate(sizes), _growth(sizes), _before(sizes, config), _frames(sizes, config), *_many(sizes)]


def measure(sizes: Sizes, config: Path, done: Callable[[], None] = lambda: None) -> Figures:
    """Run one command after the other, and `done` after each; returns the report, fit for JSON."""
    machine, measured = describe(), []
    for section in sections(sizes, config):
        for task in section.tasks:
            figures = command.figures(*task.words)
            measured.append({"section": section.title, "command": task.command, "figures": figures})
            done()
    return {"format": FORMAT, "quick": sizes.quick, "machine": machine, "measured": measured}


def _simulate(sizes: Sizes) -> Section:
    def task(what: str, *options: object) -> Task:
        return Task(what, ("simulate", "--guides", sizes.guides, *options))

    tasks = []
    for torsion in ("rotor", "kirchhoff"):
        for state, option in (("at rest", ("--still",)), ("shaking head", ())):
            for precision in ("float32", "float64"):
                options = ("--torsion", torsion, "--precision", precision, *option)
                tasks.append(task(f"{torsion}, {precision}, {state}", *options))
    tasks += [
        task(f"{torsion}, float32, shaking head", "--torsion", torsion) for torsion in ("frenet", "none")
    ]
    tasks += [
        task(f"{torsion}, hair-hair grid", "--torsion", torsion, "--hair", "grid")
        for torsion in ("rotor", "kirchhoff")
    ]
    tasks.append(task("rotor, capsules, curls that fall onto one another", "--hair", "capsule", "--falling"))
    return Section(
        "Simulation",
        f"Steps of 1/240 s of {sizes.guides:,} guides of 32 points on a head, ten a frame. The peak is that of all processors, "
        "in FMAs of full vectors; operations are counted by hand for `rotor` without hair on hair.",
        {
            "ns_per_point_step": "ns a point and step",
            "frames_per_second": "frames/s",
            "hair_ms_per_step": "hair on hair [ms a step]",
            "gflops": "GFLOP/s",
            "part_of_peak": "part of the peak",
        },
        tasks,
    )


def _growth(sizes: Sizes) -> Section:
    def unfold(figures: Figures) -> Rows:
        rows: Rows = []
        for name, value in figures.items():
            if name.startswith("ns_"):
                shape, threads, _ = name.removeprefix("ns_").split("_")
                guides, points = shape.split("x")
                each = f"{_count(int(guides), 'guide')} x {points} points, {_count(int(threads), 'thread')}"
                rows.append((each, {"ns": value}))
        names = {
            "speed_up": "speed-up by two threads",
            "exponent_guides": "exponent of the cost in guides",
            "exponent_points": "exponent of the cost in points",
        }
        return rows + [(text, {"value": figures[name]}) for name, text in names.items()]

    words = ("simulate", "--scaling", "--guides", sizes.most_guides)
    return Section(
        "How the cost of a step grows",
        "`rotor`, float32, shaking head. An exponent of 1 is linear; few guides do not fill vectors and threads, which makes it smaller.",
        {"ns": "ns a point and step", "value": ""},
        [Task("", words, unfold)],
    )


def _before(sizes: Sizes, config: Path) -> Section:
    groomed = [max(sizes.groomed // 10, 1), sizes.groomed]
    strands = [max(sizes.strands // 10, 1), sizes.strands]
    tasks = [Task(f"groom {n:,} strands", ("groom", config, "--strands", n)) for n in groomed]
    tasks += [Task(f"expand {n:,} strands of 32 points", ("interpolate", "--strands", n)) for n in strands]
    return Section(
        "Groom and interpolation",
        "Grooming is once for an experiment, by all style operators of the config; so is binding strands to guides. Expanding them is "
        "once for a frame, from 1,000 guides.",
        {
            "seconds": "groom [s]",
            "seconds_to_bind": "bind [s]",
            "seconds_per_frame": "expand [s a frame]",
            "peak_rss_gb": "memory [GB]",
        },
        tasks,
    )


def _frames(sizes: Sizes, config: Path) -> Section:
    def unfold(figures: Figures) -> Rows:
        rows: Rows = [(row["what"], row) for row in figures["rows"]]
        same = "yes" if figures["equal"] else "**NO**"
        return [
            *rows,
            ("exponent of the time in strands", {"value": figures["exponent"]}),
            ("equal pictures by any threads and chunks", {"value": same}),
        ]

    whole = ("--config", config) if sizes.whole else ()
    return Section(
        "Frames",
        "Full HD, 16 points a strand, 2 x 2 supersampling; twelve frames in a row after a first one, but one of tubes.",
        {"seconds": "s", "peak_rss_gb": "memory [GB]", "value": ""},
        [Task("", ("render-table", "--strands", sizes.drawn, *whole), unfold)],
    )


def _many(sizes: Sizes) -> list[Section]:
    size = ("--size", sizes.pixels)
    farm = Task("", ("farm", "--frames", sizes.frames, "--workers", 2, *size), _listed)
    sweep = Task("", ("sweep", "--experiments", sizes.experiments, *size), _listed)
    return [
        Section(
            "Workers",
            "Small frames by one process, and by workers on the same processors; [many machines](farm.md#what-it-costs) tells what the names mean.",
            {"value": ""},
            [farm],
        ),
        Section(
            "Sweeps",
            "Experiments that differ in a light. Overhead is all that is neither drawing nor a stage before it.",
            {"value": ""},
            [sweep],
        ),
    ]


def _listed(figures: Figures) -> Rows:
    return [(name.replace("_", " "), {"value": value}) for name, value in figures.items()]


def _count(number: int, what: str) -> str:
    return f"{number:,} {what}{'' if number == 1 else 's'}"
