"""Which guides a strand follows: few, near, of the same side of the parting and of similar shape.

Notation: d distance of the roots, D differences of the shapes; a guide's cost is c^2 = (d / 10 mm)^2 + sum (D / 30 mm)^2,
its weight a Gaussian of c. On a groom of 11,400 strands similarity saves a third of the error, or half of the guides.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

Floats = NDArray[np.float64]

CANDIDATES = 12  # nearest roots of which the most similar are taken
_ROOT_SCALE, _SHAPE_SCALE = 0.010, 0.030  # [m]
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
    """The guides at rest, to be looked up by root, side and shape."""

    root: Floats
    """(G, 3) [m]."""
    shape: Floats
    """(G, 9), see `shape_of`."""
    side: NDArray[np.int8]
    """(G,)."""
    strand: NDArray[np.uint32]
    """(G,): the groom strand that the guide is, ascending."""

    @cached_property
    def sides(self) -> dict[int, tuple[NDArray[np.intp], "cKDTree"]]:
        """The guides of each side and a tree of their roots."""
        from scipy.spatial import cKDTree

        found = {int(side): np.flatnonzero(self.side == side) for side in np.unique(self.side)}
        return {side: (guides, cKDTree(self.root[guides])) for side, guides in found.items()}

    @cached_property
    def everywhere(self) -> tuple[NDArray[np.intp], "cKDTree"]:
        """All guides, for strands of a side that has none."""
        from scipy.spatial import cKDTree

        return np.arange(len(self.root)), cKDTree(self.root)


def follow(
    root: Floats, shape: Floats, side: NDArray[np.int8], guides: GuideSet, k: int
) -> tuple[NDArray[np.uint32], NDArray[np.float32]]:
    """Choose k guides for each strand.

    A strand of a side without guides follows those of the others; where a side has fewer than k, the rest has
    weight 0.

    Args:
        root: (n, 3) float64 [m], in the head's rest pose.
        shape: (n, 9), see `shape_of`.
        side: (n,) side of the parting.
        guides: where to choose from.
        k: how many.

    Returns:
        guide (n, k) uint32 and weight (n, k) float32, greatest first, of sum 1.

    """
    guide = np.zeros((len(root), k), np.uint32)
    weight = np.zeros((len(root), k), np.float32)
    for label in np.unique(side):
        rows = np.flatnonzero(side == label)
        members, tree = guides.sides.get(int(label), guides.everywhere)
        count = min(CANDIDATES, len(members))
        _, near = tree.query(root[rows], count)
        candidate = members[near.reshape(len(rows), count)]
        guide[rows], weight[rows] = _best(root[rows], shape[rows], candidate, guides, k)
    return guide, weight


def follow_itself(
    index: NDArray[np.uint32], guides: GuideSet, guide: NDArray[np.uint32], weight: NDArray[np.float32]
) -> None:
    """Let strands (n,) that are guides follow themselves alone; changes guide and weight in place."""
    at = np.searchsorted(guides.strand, index).clip(max=len(guides.strand) - 1)
    own = guides.strand[at] == index
    guide[own], weight[own] = at[own, None], 0
    weight[own, 0] = 1


def _best(
    root: Floats, shape: Floats, candidate: NDArray[np.intp], guides: GuideSet, k: int
) -> tuple[NDArray[np.uint32], NDArray[np.float32]]:
    apart = (guides.root[candidate] - root[:, None]) / _ROOT_SCALE
    unlike = guides.shape[candidate] - shape[:, None]
    cost = (apart**2).sum(axis=2) + (unlike**2).sum(axis=2)
    order = np.argsort(cost, axis=1, kind="stable")
    cost = np.take_along_axis(cost, order, axis=1)
    guide = np.take_along_axis(candidate, order, axis=1)
    taken = min(k, guide.shape[1])
    weight = _weights(cost, taken)
    missing = ((0, 0), (0, k - taken))
    return (
        np.pad(guide[:, :taken], missing, mode="edge").astype(np.uint32),
        np.pad(weight, missing).astype(np.float32),
    )


def _weights(cost: Floats, k: int) -> Floats:
    """Gaussian as wide as the mean of the k costs, which falls to 0 where the next guide would take the place.

    Without that fall neighbouring strands would part visibly where their k-th guides change.
    """
    best = cost[:, :k]
    weight = np.exp(-best / (best.mean(axis=1, keepdims=True) + 1e-12))
    if cost.shape[1] > k:
        weight *= 1.001 - best / (cost[:, k : k + 1] + 1e-12)
    return np.asarray(weight / weight.sum(axis=1, keepdims=True))
