"""Which clump a strand belongs to.

The first n strands of the progressive order are the middles, so they are evenly spread; a strand belongs to the
nearest of them that no parting lies before and, in clumps within larger ones, that is in its own larger clump. A strand
that partings shut off from all middles is in no clump.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from pipeline.groom.style.hair import Index, Vectors
from pipeline.strands.partings import NOBODY, Neighbours

_LOOKED_AT = 12  # nearest middles among which one in the same larger clump is looked for
_AT_FIRST = 3  # of them; most roots need no more


class Locks:
    """The clumps of one operator."""

    def __init__(self, count: int, roots: Neighbours, parent: "Locks | None") -> None:
        """Make the first `count` of these roots middles."""
        self.count, self.parent, self._roots = min(count, len(roots.points)), parent, roots
        self._middles = Neighbours(roots.points[: self.count], roots.partings)
        self._parents = parent.of(np.arange(self.count)) if parent else None

    def of(self, index: Index, larger: Index | None = None) -> Index:
        """The clump (N,) of each of these strands (N,), `NOBODY` for none; `larger` are their larger clumps, if known."""
        roots = self._roots.points[index]
        if self.parent is None or self._parents is None:
            return self._middles.near(roots, 1)[:, 0]
        own = self.parent.of(index) if larger is None else larger
        found, fits = self._within(own, roots, _AT_FIRST)
        rest = np.flatnonzero(~fits)
        found[rest] = self._within(own[rest], roots[rest], _LOOKED_AT)[0]
        return found

    def _within(self, own: Index, roots: Vectors, looked_at: int) -> tuple[Index, NDArray[np.bool_]]:
        """The nearest middle (N,) that is in each strand's larger clump, and whether there is one so near."""
        assert self._parents is not None
        near = self._middles.near(roots, looked_at)
        fits = (near != NOBODY) & (self._parents[near] == own[:, None])
        first, found = near[np.arange(len(near)), fits.argmax(axis=1)], fits.any(axis=1)
        # The middle of a larger clump is a middle here too, under the same number: none is left without.
        return np.where(found, first, own), found


def all_locks(found: Mapping[str, Locks], index: Index) -> dict[str, Index]:
    """The clumps (N,) of strands (N,) in every operator by name; larger clumps come before those within them."""
    locks: dict[str, Index] = {}
    names = {own: name for name, own in found.items()}
    for name, own in found.items():
        locks[name] = own.of(index, locks[names[own.parent]] if own.parent else None)
    return locks
