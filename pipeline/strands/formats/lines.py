"""What writers of moving strands are told. A moment comes in chunks of whole strands, in order, so that a file may be
larger than memory.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Chunks = Iterable[NDArray[np.float32]]
"""Points (n, P, 3) float32 [m] of strands, chunk after chunk; the same numbers of strands in every moment."""


@dataclass(frozen=True)
class Lines:
    """Strands of one number of points and one profile of widths."""

    strands: int
    points: int
    widths: NDArray[np.float32]
    """(P,) [m]: diameters from root to tip."""
    fps: float
    about: str
    """A few words on where the strands come from, kept in the file; ASCII, 87 letters at most."""
    uv: NDArray[np.float32] | None = None
    """(S, 2): where roots lie on the scalp, as image maps of grooms see it: 0 to 1 both ways."""
