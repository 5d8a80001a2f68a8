"""Strands of any number of points, as files hold them; and reading that trusts no header."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import DTypeLike, NDArray

from pipeline.errors import InputError


def widened(points: NDArray[np.floating]) -> NDArray[np.float64]:
    """As float64, also of signalling nans: they are told by index later, as other nans are."""
    with np.errstate(invalid="ignore"):
        return points.astype(np.float64)


@dataclass(frozen=True)
class Ragged:
    """Strands one after the other, root first."""

    points: NDArray[np.float64]
    """(N, 3), in the file's unit and axes."""
    counts: NDArray[np.int64]
    """(S,): points of each strand; their sum is N."""
    pins: NDArray[np.uint8]
    """(S, 2): points held at root and tip."""
    widths: NDArray[np.float32] | None = None
    """(N,): diameters in the file's unit, where the file has them."""
    metres: float | None = None
    """Metres in the file's unit, where the file says so."""
    up_axis: str | None = None
    """"y" or "z", where the file says so."""

    def __len__(self) -> int:
        return len(self.counts)

    @property
    def first(self) -> NDArray[np.int64]:
        """(S,): index of each strand's root in `points`."""
        return np.cumsum(self.counts) - self.counts


def gathered(pieces: Sequence[Ragged], metres: float | None = None, up_axis: str | None = None) -> Ragged:
    """All strands of several pieces, in order; widths are nan for pieces without, and None where no piece has them."""
    widths = None
    if any(piece.widths is not None for piece in pieces):
        nothing = np.float32(np.nan)
        widths = np.concatenate(
            [
                np.full(len(piece.points), nothing) if piece.widths is None else piece.widths
                for piece in pieces
            ]
        )
    return Ragged(
        points=np.concatenate([piece.points for piece in pieces]),
        counts=np.concatenate([piece.counts for piece in pieces]),
        pins=np.concatenate([piece.pins for piece in pieces]),
        widths=widths,
        metres=metres,
        up_axis=up_axis,
    )


class Bytes:
    """The bytes of a file; every access is checked against their number before anything is allocated."""

    def __init__(self, path: Path) -> None:
        """Read the file. Raises InputError when that is not possible."""
        self.path = path
        try:
            self.data = path.read_bytes()
        except FileNotFoundError:
            raise InputError(f"{path}: no such groom file") from None
        except OSError as error:
            raise InputError(f"{path}: cannot be read ({error.strerror})") from error

    def __len__(self) -> int:
        return len(self.data)

    def array(self, what: str, dtype: DTypeLike, count: int, offset: int) -> NDArray[Any]:
        """`count` little-endian numbers at a byte offset; `what` names them in the error."""
        kind = np.dtype(dtype).newbyteorder("<")
        end = offset + count * kind.itemsize
        if offset < 0 or count < 0 or end > len(self.data):
            raise self.error(
                f"{what}: the header promises {count} numbers up to byte {end}, but the file has {len(self.data)}; "
                "it is truncated or its header is wrong"
            )
        return np.frombuffer(self.data, kind, count, offset)

    def number(self, what: str, dtype: DTypeLike, offset: int) -> int:
        """One number at a byte offset."""
        return int(self.array(what, dtype, 1, offset)[0])

    def error(self, message: str) -> InputError:
        """An error that names the file."""
        return InputError(f"{self.path}: {message}")
