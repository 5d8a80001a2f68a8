"""Compare two pictures, or all pictures of two folders by name."""

from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from pipeline.compare.gates import Limits, judge
from pipeline.compare.metrics import Metrics, measure
from pipeline.compare.pictures import ENDINGS, load_picture, renderer_of
from pipeline.errors import InputError


@dataclass(frozen=True)
class Pair:
    """Two pictures of one name and how far they lie apart; no metrics when one of them is missing."""

    name: str
    reference: Path | None
    picture: Path | None
    metrics: Metrics | None
    reasons: list[str] = field(default_factory=list)
    """Why it fails; empty when it passes."""
    limits: Limits | None = None
    """What is accepted; None where every pixel has to be equal."""

    @property
    def identical(self) -> bool:
        return self.metrics is not None and self.metrics.identical


@dataclass(frozen=True)
class Comparison:
    """All pairs; identical when each pair is there and equal to the last pixel, passed when no gate fails."""

    pairs: list[Pair]

    @property
    def identical(self) -> bool:
        return all(pair.identical for pair in self.pairs)

    @property
    def passed(self) -> bool:
        return not any(pair.reasons for pair in self.pairs)

    def as_json(self) -> dict[str, Any]:
        """Return a summary that JSON can hold."""
        pairs = [
            {
                "name": pair.name,
                "metrics": asdict(pair.metrics) if pair.metrics else None,
                "reasons": pair.reasons,
            }
            for pair in self.pairs
        ]
        return {"identical": self.identical, "passed": self.passed, "pairs": pairs}


def compare(reference: Path, picture: Path, limits: Limits | None = None) -> Comparison:
    """Compare two picture files, or two folders of PNG and EXR files.

    Without limits every pixel has to be equal; with them, pictures of another renderer pass within the limits.
    Raises InputError for a missing path, a file against a folder, folders without a picture, and for two files
    that are unreadable or of different size; in folders such a pair fails, with the reason.
    """
    for path in (reference, picture):
        if not path.exists():
            raise InputError(f"{path}: no such file or folder")
    if reference.is_dir() != picture.is_dir():
        raise InputError(f"{reference} and {picture}: compare two files or two folders")
    if not reference.is_dir():
        return Comparison([judged(picture.name, reference, picture, limits)])
    return Comparison([_pair(name, *both, limits) for name, both in _entries(reference, picture).items()])


def judged(name: str, reference: Path, picture: Path, limits: Limits | None) -> Pair:
    """Measure two pictures that are there, and put them through the gates; raises InputError as `measure` does."""
    metrics = measure(load_picture(reference), load_picture(picture))
    renderer = renderer_of(reference)
    same = limits is None or (renderer is not None and renderer == renderer_of(picture))
    return Pair(name, reference, picture, metrics, judge(metrics, same, limits), None if same else limits)


def _entries(reference: Path, picture: Path) -> dict[str, tuple[Path | None, Path | None]]:
    left, right = (
        {path.name: path for path in folder.iterdir() if path.suffix.lower() in ENDINGS}
        for folder in (reference, picture)
    )
    if not left and not right:
        raise InputError(f"{reference} and {picture}: no PNG or EXR in either folder")
    return {name: (left.get(name), right.get(name)) for name in sorted(left | right)}


def _pair(name: str, reference: Path | None, picture: Path | None, limits: Limits | None) -> Pair:
    if reference is None or picture is None:
        missing = "the reference" if reference is None else "the new picture"
        return Pair(name, reference, picture, None, [f"{missing} is missing"])
    try:
        return judged(name, reference, picture, limits)
    except InputError as error:
        return Pair(name, reference, picture, None, [str(error)])
