"""Which guides a strand follows: few, near, of similar shape, and none that a parting lies before.

Notation: d distance of the roots, D differences of the shapes; a guide's distance from a strand is c with
c^2 = (d / 10 mm)^2 + sum (D / 30 mm)^2, its weight that of kriging over such distances (kernels/follow.hpp). On a groom
of 11,400 strands similarity saves a third of the error, or half of the guides.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pipeline import kernels
from pipeline.strands.partings import Neighbours

Floats = NDArray[np.float64]

CANDIDATES = 12  # nearest roots of which the most similar are taken
_ROOT_SCALE, _SHAPE_SCALE = 0.010, 0.030  # [m]
_ALIKE, _UNLIKE = 2.0, 4.0  # shape scales: guides that differ more from the best one do not move the strand
_LEVELS = 3  # points along the strand at which shapes are compared


def shape_of(points: NDArray[np.float32]) -> Floats:
    """Shape of strands (n, P, 3) [m], as points at a third, two thirds and all of the length, from the root.

    Returns (n, 9) float64 in units of the shape scale, so that distances between rows are sums of (D / 30 mm)^2.
    """
    last = points.shape[1] - 1
    levels = [round(last * level / _LEVELS) for level in range(1, _LEVELS + 1)]
    shape = points[:, levels].astype(np.float64) - points[:, :1]
    return np.asarray(shape.reshape(len(points), -1) / _SHAPE_SCALE)


@dataclass(frozen=True)
class GuideSet:
    """The guides at rest, to be looked up by root and shape."""

    roots: Neighbours
    """G roots [m], and the partings between them."""
    shape: Floats
    """(G, 9), see `shape_of`."""
    strand: NDArray[np.uint32]
    """(G,): the groom strand that the guide is, ascending."""

    @cached_property
    def features(self) -> Floats:
        """(G, 12): what the cost compares."""
        return features(self.roots.points, self.shape)


def follow(
    root: Floats, shape: Floats, guides: GuideSet, k: int
) -> tuple[NDArray[np.uint32], NDArray[np.float32]]:
    """Choose k guides for each strand.

    Where fewer than k are on a strand's side of all partings, the rest has weight 0.

    Args:
        root: (n, 3) float64 [m], in the head's rest pose.
        shape: (n, 9), see `shape_of`.
        guides: where to choose from.
        k: how many.

    Returns:
        guide (n, k) uint32 and weight (n, k) float32, greatest first, of sum 1; all 0 for a strand that partings shut
        off from all guides.

    """
    candidate = guides.roots.near(root, CANDIDATES, enough=k + 1)
    return kernels.follow(features(root, shape), guides.features, candidate, k, _ALIKE, _UNLIKE)


def follow_itself(
    index: NDArray[np.uint32], guides: GuideSet, guide: NDArray[np.uint32], weight: NDArray[np.float32]
) -> None:
    """Let strands (n,) that are guides follow themselves alone; changes guide and weight in place."""
    at = np.searchsorted(guides.strand, index).clip(max=len(guides.strand) - 1)
    own = guides.strand[at] == index
    guide[own], weight[own] = at[own, None], 0
    weight[own, 0] = 1


def features(root: Floats, shape: Floats) -> Floats:
    """What strands differ by (n, 12): roots (n, 3) [m] and shapes (n, 9) in units that count the same, see the top."""
    return np.concatenate([root / _ROOT_SCALE, shape], axis=1)
