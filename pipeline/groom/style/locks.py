"""Which clump a strand belongs to.

The first n strands of the progressive order are the middles, so they are evenly spread; a strand belongs to the
nearest root on its side of the parting and, in clumps within larger ones, in its own larger clump.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from pipeline.groom.style.hair import Index, Vectors

_SIDE = 0.02  # [m] distance that the parting puts between its sides
_LOOKED_AT = 12  # nearest middles among which one in the same larger clump is looked for


class Locks:
    """The clumps of one operator."""

    def __init__(self, count: int, roots: Vectors, side: NDArray[np.int8], parent: "Locks | None") -> None:
        """Make the first `count` of these roots (N, 3) middles."""
        self.count, self.parent = min(count, len(roots)), parent
        self._tree = cKDTree(_features(roots[: self.count], side[: self.count]))
        self._parents = parent.of(roots[: self.count], side[: self.count]) if parent else None

    def of(self, roots: Vectors, side: NDArray[np.int8]) -> Index:
        """The clump (N,) that each root belongs to."""
        features = _features(roots, side)
        if self.parent is None or self._parents is None:
            return np.asarray(self._tree.query(features)[1], np.int64)
        # The middle of a larger clump is a middle here too, under the same number: none is left without.
        own = self.parent.of(roots, side)
        near = np.asarray(self._tree.query(features, k=np.arange(1, min(_LOOKED_AT, self.count) + 1))[1])
        fits = self._parents[near] == own[:, None]
        first = near[np.arange(len(near)), fits.argmax(axis=1)]
        return np.where(fits.any(axis=1), first, own).astype(np.int64)


def _features(roots: Vectors, side: NDArray[Any]) -> Vectors:
    return np.column_stack([roots, _SIDE * side])
