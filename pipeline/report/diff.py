"""What differs between two runs: the values and versions that their files were made with, and their pictures."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from pipeline import cache
from pipeline.compare import Metrics, Pair, load_picture, measure
from pipeline.config import STAGES
from pipeline.errors import InputError
from pipeline.report.facts import Facts, facts_of, frames_of

MEASURED = 12  # frames whose difference is measured, evenly chosen of those that differ

Two = tuple[Any, Any]


@dataclass(frozen=True)
class Pictures:
    """How the frames of two runs lie apart."""

    both: int
    """Frames that both runs have."""
    only: tuple[int, int]
    """Frames that only the first, only the second run has."""
    differ: list[str] = field(default_factory=list)
    """Names of the frames that are not equal to the last pixel."""
    measured: dict[str, Metrics] = field(default_factory=dict)
    problems: list[str] = field(default_factory=list)

    @property
    def equal(self) -> bool:
        return not self.differ and not self.problems and self.only == (0, 0)


@dataclass(frozen=True)
class Difference:
    """Two runs side by side; what is equal in both is left out."""

    values: dict[str, Two]
    versions: dict[str, Two]
    stages: dict[str, Two]
    """Stages that one run lacks, with the reasons."""
    pictures: Pictures

    @property
    def equal(self) -> bool:
        return not (self.values or self.versions or self.stages) and self.pictures.equal

    def as_json(self) -> dict[str, Any]:
        """Everything, as JSON can hold it."""
        return {"equal": self.equal, **asdict(self)}

    def lines(self) -> list[str]:
        """Everything, for the eye."""
        found = []
        for title, pairs in (("values", self.values), ("versions", self.versions), ("stages", self.stages)):
            found += (
                [title, *(f"  {name}: {one} -> {other}" for name, (one, other) in pairs.items())]
                if pairs
                else []
            )
        return [*found, "frames", *(f"  {line}" for line in _told(self.pictures))]


def diff(first: cache.Experiment, second: cache.Experiment) -> Difference:
    """Compare what two experiments have on disk; raises InputError for a folder that holds no run."""
    one, other = (_known(experiment) for experiment in (first, second))
    values: dict[str, Two] = {}
    versions: dict[str, Two] = {}
    stages: dict[str, Two] = {}
    for stage in STAGES:
        a, b = one[stage], other[stage]
        if not (a.key and b.key):
            if a.problem != b.problem or a.key != b.key:
                stages[stage] = (a.problem or "made", b.problem or "made")
            continue
        for name in sorted(a.inputs.keys() | b.inputs.keys()):
            if name != "code" and not name.startswith("stage "):
                _note(values, name, a.inputs.get(name, "unset"), b.inputs.get(name, "unset"))
        _note(versions, f"code of {stage}", a.code, b.code)
        for name in sorted(a.libraries.keys() | b.libraries.keys()):
            _note(versions, name, a.libraries.get(name, "none"), b.libraries.get(name, "none"))
        _note(versions, "kernels", a.kernels, b.kernels)
        for part, parts in zip(_PARTS, zip(_split(a.renderer), _split(b.renderer), strict=True), strict=True):
            _note(versions, part, *parts)
    return Difference(values, versions, stages, _pictures(frames_of(first), frames_of(second)))


def pairs_of(difference: Difference, first: cache.Experiment, second: cache.Experiment) -> list[Pair]:
    """The frames that were measured, as the page of comparisons shows them."""
    return [
        Pair(name, first.frames / name, second.frames / name, metrics, ["differs"])
        for name, metrics in difference.pictures.measured.items()
    ]


_PARTS = ("OpenGL", "libraries of the renderer", "kernels of the renderer", "processor")


def _split(renderer: str) -> list[str]:
    parts = renderer.split("; ", len(_PARTS) - 1)
    return [*parts, *[""] * (len(_PARTS) - len(parts))]


def _note(found: dict[str, Two], name: str, one: Any, other: Any) -> None:
    if one != other:
        found[name] = (one, other)


def _known(experiment: cache.Experiment) -> dict[str, Facts]:
    facts = facts_of(experiment)
    if not any(fact.key for fact in facts.values()):
        reasons = {fact.problem for fact in facts.values()} - {"not made yet"}
        raise InputError(
            f"{experiment.folder}: no run in this folder{''.join(f'; {reason}' for reason in sorted(reasons))}"
        )
    return facts


def _pictures(first: Sequence[Path], second: Sequence[Path]) -> Pictures:
    left, right = ({path.name: path for path in frames} for frames in (first, second))
    both = sorted(left.keys() & right.keys())
    differ, problems = [], []
    for name in both:
        try:
            if not _same(left[name], right[name]):
                differ.append(name)
        except InputError as error:
            problems.append(str(error))
    count = min(len(differ), MEASURED)
    chosen = [differ[round(i * (len(differ) - 1) / max(count - 1, 1))] for i in range(count)]
    measured: dict[str, Metrics] = {}
    for name in chosen:
        try:
            measured[name] = measure(load_picture(left[name]), load_picture(right[name]))
        except InputError as error:
            problems.append(f"{name}: {error}")
    only = (len(left) - len(both), len(right) - len(both))
    return Pictures(len(both), only, differ, measured, list(dict.fromkeys(problems)))


def _same(one: Path, other: Path) -> bool:
    if one.read_bytes() == other.read_bytes():
        return True
    a, b = load_picture(one), load_picture(other)
    return a.shape == b.shape and a.dtype == b.dtype and bool((a == b).all())


def _told(pictures: Pictures) -> list[str]:
    lines = []
    if any(pictures.only):
        lines.append(f"{pictures.only[0]} only in the first run, {pictures.only[1]} only in the second")
    lines.append(f"{len(pictures.differ)} of {pictures.both} that both have differ")
    if pictures.measured:
        worst = max(pictures.measured, key=lambda name: pictures.measured[name].flip)
        flip = float(np.mean([metrics.flip for metrics in pictures.measured.values()]))
        figures = "  ".join(f"{name} {value:.5f}" for name, value in vars(pictures.measured[worst]).items())
        lines.append(f"FLIP {flip:.5f} in the mean of {len(pictures.measured)}; most in {worst}: {figures}")
    return [*lines, *pictures.problems]
