"""All strands of a moment, chunk by chunk, expanded once as far as memory allows."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from pipeline.strands.expand import Expansion, MovedSkin

Points = NDArray[np.float32]

CHUNK = 65_536  # strands
KEPT = (
    256 << 20
)  # [bytes] points that stay from one pass over the strands to the next; more are expanded again


class Chunks:
    """The first strands of an expansion: `move` to a moment, then iterate as often as needed."""

    def __init__(self, strands: Expansion, count: int) -> None:
        """Give strands 0 to `count`."""
        self._strands, self._count = strands, count
        self._firsts = range(0, count, CHUNK)
        self._fit = KEPT // (12 * CHUNK * strands.points)
        self._kept: list[Points] = []
        self._there: set[int] = set()

    @property
    def two_fit(self) -> bool:
        """Whether memory holds the points of two moments."""
        return bool(2 * 12 * self._count * self._strands.points <= KEPT)

    def move(self, guides: Points, pose: NDArray[np.float64], skin: MovedSkin | None) -> None:
        """Go to a moment, see `Expansion.frame`."""
        self._strands.frame(guides, pose, skin)
        self._there.clear()

    def __iter__(self) -> Iterator[tuple[int, Points]]:
        """Give the number of each chunk's first strand, and its points (S, P, 3) [m]; they are valid until the next."""
        for i, first in enumerate(self._firsts):
            last = min(first + CHUNK, self._count)
            points = self._buffer(i, last - first)
            if i not in self._there:
                self._strands.chunk(first, last, points)
                if i < self._fit:
                    self._there.add(i)
            yield first, points

    def pieces(self, most: int) -> Iterator[tuple[int, Points]]:
        """Give the same, at most so many strands at a time."""
        for first, points in self:
            for begin in range(0, len(points), most):
                yield first + begin, points[begin : begin + most]

    def _buffer(self, i: int, count: int) -> Points:
        """Memory for chunk i: its own, or one for all that are not kept."""
        place = min(i, self._fit)
        while len(self._kept) <= place:
            size = min(CHUNK, self._count - self._firsts[len(self._kept)])
            self._kept.append(np.empty((size, self._strands.points, 3), np.float32))
        own: Points = self._kept[place][:count]
        return own
