"""Which points of strands are held, and by whom: nobody, the head or the hand.

One held point is a hinge, two are a clamp. A file of pins has a row for each strand, in the groom's order (of a groom
file, in the file's), from root to tip as they are in the pipeline:
    root, tip           how many points the head holds at the root, and the hand at the tip
    a number a point    0 free, 1 held by the head, 2 held by the hand
as text (.csv) or as a numpy array (.npy).
"""

from pathlib import Path
from tokenize import TokenError

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pipeline.errors import InputError
from pipeline.strands.formats.table import read_table

FREE, HEAD, HAND = 0, 1, 2

Mask = NDArray[np.uint8]


def held_ends(pins: NDArray[np.integer], points: int) -> Mask:
    """The mask (S, P) of strands that are held at `pins` (S, 2) points of root and tip."""
    index = np.arange(points)
    held = np.where(index < pins[:, :1], HEAD, FREE)
    return np.where(index >= points - pins[:, 1:].astype(int), HAND, held).astype(np.uint8)


def read_held(path: Path, strands: int, points: int) -> Mask:
    """The mask (strands, points) of a file of pins.

    Raises InputError, with file and line, for another number of strands or of columns, a value that is none of those
    above, and ends that hold more points than there are.
    """
    expected = f"a strand has 2 (held at root and tip) or {points} (one a point, groom.points)"
    if path.suffix.lower() == ".npy":
        values, lines = _read_npy(path), None
        if values.ndim != 2 or values.shape[1] not in (2, points):
            raise InputError(f"{path}: an array of shape {values.shape}; {expected}")
    else:
        table = read_table(path, (2, points), expected)
        values, lines = table.values, table
    if len(values) != strands:
        raise InputError(f"{path}: pins of {len(values)} strands; the groom has {strands}")

    def refuse(bad: ArrayLike, what: str) -> None:
        if np.any(bad):
            row = int(np.argmax(bad))
            raise InputError(f"{lines.where(row) if lines else f'{path}: row {row}'}: {what}")

    refuse(~(values == np.round(values)).all(axis=1), "pins are whole numbers")
    if values.shape[1] == 2:
        refuse((values < 0).any(axis=1), "a number of held points is negative")
        refuse(values.sum(axis=1) > points, f"more held points than the {points} of a strand")
        return held_ends(values.astype(np.int64), points)
    refuse(
        ~np.isin(values, (FREE, HEAD, HAND)).all(axis=1),
        "expected 0 (free), 1 (by the head) or 2 (by the hand)",
    )
    return values.astype(np.uint8)


def _read_npy(path: Path) -> NDArray[np.float64]:
    try:
        mapped = np.load(path, mmap_mode="r", allow_pickle=False)  # a file shorter than it says is refused
        return np.asarray(mapped, np.float64)
    except (OSError, ValueError, EOFError, TypeError, SyntaxError, TokenError, MemoryError) as error:
        raise InputError(f"{path}: not a numpy array of numbers ({error})") from None
