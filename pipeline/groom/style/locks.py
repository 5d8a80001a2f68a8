"""Which clump a strand belongs to.

The first n strands of the progressive order are the middles, so they are evenly spread; a strand belongs to the
nearest of them that no parting lies before and, in clumps within larger ones, that is in its own larger clump. A strand
that partings shut off from all middles is in no clump.
"""

import numpy as np

from pipeline.groom.style.hair import Index
from pipeline.strands.partings import NOBODY, Neighbours

_LOOKED_AT = 12  # nearest middles among which one in the same larger clump is looked for


class Locks:
    """The clumps of one operator."""

    def __init__(self, count: int, roots: Neighbours, parent: "Locks | None") -> None:
        """Make the first `count` of these roots middles."""
        self.count, self.parent, self._roots = min(count, len(roots.points)), parent, roots
        self._middles = Neighbours(roots.points[: self.count], roots.partings)
        self._parents = parent.of(np.arange(self.count)) if parent else None

    def of(self, index: Index) -> Index:
        """The clump (N,) of each of these strands (N,), `NOBODY` for none."""
        roots = self._roots.points[index]
        if self.parent is None or self._parents is None:
            return self._middles.near(roots, 1)[:, 0]
        # The middle of a larger clump is a middle here too, under the same number: none is left without.
        own = self.parent.of(index)
        near = self._middles.near(roots, _LOOKED_AT)
        fits = (near != NOBODY) & (self._parents[near] == own[:, None])
        first = near[np.arange(len(near)), fits.argmax(axis=1)]
        return np.where(fits.any(axis=1), first, own)
