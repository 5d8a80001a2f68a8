"""Compare two PNGs, or all PNGs of two folders by name."""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.compare.metrics import Metrics, Picture, measure
from pipeline.errors import InputError


@dataclass(frozen=True)
class Pair:
    """Two pictures of one name and how far they lie apart; no metrics when one of them is missing."""

    name: str
    reference: Path | None
    picture: Path | None
    metrics: Metrics | None


@dataclass(frozen=True)
class Comparison:
    """All pairs; identical when each pair is there and equal to the last pixel."""

    pairs: list[Pair]

    @property
    def identical(self) -> bool:
        return all(pair.metrics is not None and pair.metrics.identical for pair in self.pairs)

    def as_json(self) -> dict[str, Any]:
        """Return a summary that JSON can hold."""
        pairs = [
            {"name": pair.name, "metrics": asdict(pair.metrics) if pair.metrics else None}
            for pair in self.pairs
        ]
        return {"identical": self.identical, "pairs": pairs}


def compare(reference: Path, picture: Path, page: Path | None = None) -> Comparison:
    """Compare two PNG files or two folders of PNG files; `page` gets an HTML page of all that differ.

    Raises InputError for a missing path, a file against a folder, folders without a PNG, unreadable
    pictures and pictures of different size.
    """
    for path in (reference, picture):
        if not path.exists():
            raise InputError(f"{path}: no such file or folder")
    if reference.is_dir() != picture.is_dir():
        raise InputError(f"{reference} and {picture}: compare two files or two folders")
    found = Comparison([_pair(*entry) for entry in _entries(reference, picture)])
    if page is not None:
        from pipeline.compare.page import write_page

        write_page(page, f"{reference} against {picture}", found.pairs)
    return found


def load_picture(path: Path) -> Picture:
    """Read a picture as (H, W, 3) uint8 sRGB; raises InputError when it cannot be read."""
    from PIL import Image, UnidentifiedImageError

    try:
        with Image.open(path) as image:
            return np.asarray(image.convert("RGB"))
    except (UnidentifiedImageError, OSError, SyntaxError) as error:
        raise InputError(f"{path}: not a readable picture ({error})") from error


def _entries(reference: Path, picture: Path) -> list[tuple[str, Path | None, Path | None]]:
    if not reference.is_dir():
        return [(picture.name, reference, picture)]
    left, right = ({path.name: path for path in folder.glob("*.png")} for folder in (reference, picture))
    if not left and not right:
        raise InputError(f"{reference} and {picture}: no PNG in either folder")
    return [(name, left.get(name), right.get(name)) for name in sorted(left | right)]


def _pair(name: str, reference: Path | None, picture: Path | None) -> Pair:
    if reference is None or picture is None:
        return Pair(name, reference, picture, None)
    return Pair(name, reference, picture, measure(load_picture(reference), load_picture(picture)))
