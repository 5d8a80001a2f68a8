"""Clumps: strands move towards the middle strand of their lock.

The first n strands of the progressive order are the middles, so they are evenly spread; a strand belongs to the
nearest root on its side of the parting.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from pipeline.config.schema import Clump
from pipeline.groom.head.distance import smoothstep
from pipeline.strands.random import uniform

Vectors = NDArray[np.float64]

_SIDE = 0.02  # [m] distance that the parting puts between its sides


@dataclass(frozen=True)
class Bundle:
    """Strands as polylines of equal fractions, with their arc lengths."""

    points: Vectors
    """(N, P, 3) [m]"""
    length: Vectors
    """(N,) [m]"""


class Locks:
    """One level of clumps."""

    def __init__(self, clump: Clump, roots: Vectors, side: NDArray[np.int8], salt: int) -> None:
        """Make the first `clump.count` of these roots (N, 3) middles."""
        self.clump, self.salt = clump, salt
        self.count = min(clump.count, len(roots))
        self._tree = cKDTree(_features(roots[: self.count], side[: self.count])) if self.count else None

    def of(self, roots: Vectors, side: NDArray[np.int8]) -> NDArray[np.int64]:
        """The lock (N,) that each root belongs to; the strand's own nearest middle."""
        if self._tree is None:
            return np.zeros(len(roots), np.int64)
        _, nearest = self._tree.query(_features(roots, side))
        return np.asarray(nearest, np.int64)

    def gather(
        self,
        bundle: Bundle,
        middles: Bundle,
        lock: NDArray[np.int64],
        keep: Vectors,
        seed: int,
        index: NDArray[np.int64],
    ) -> Vectors:
        """Points (N, P, 3) moved towards the middle's at the same arc length; `keep` (N,) scales the strength."""
        if self.count == 0:
            return bundle.points
        p = bundle.points.shape[1]
        fraction = np.linspace(0, 1, p)
        along = fraction * bundle.length[:, None]
        target = _at(middles.points, along / middles.length[lock][:, None] * (p - 1), lock)
        strength = self.clump.strength * keep * (0.85 + 0.15 * uniform(seed, index, self.salt))
        weight = strength[:, None] * smoothstep(along / self.clump.over)
        return np.asarray(bundle.points + weight[..., None] * (target - bundle.points))


def _at(points: Vectors, place: Vectors, which: NDArray[np.int64]) -> Vectors:
    """Points of the strands `which` (N,) at fractional point indices (N, P), straight on past the tip."""
    last = points.shape[1] - 1
    place = np.clip(place, 0, last + 4.0)
    i = np.minimum(place.astype(np.int64), last - 1)
    u = (place - i)[..., None]
    row = which[:, None]
    return np.asarray(points[row, i] * (1 - u) + points[row, i + 1] * u)


def _features(roots: Vectors, side: NDArray[Any]) -> Vectors:
    return np.column_stack([roots, _SIDE * side])
