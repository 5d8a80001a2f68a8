"""Which guides a strand follows: few, near, of similar shape, and none that a parting lies before.

Notation: d distance of the roots, D differences of the shapes; a guide's cost is c^2 = (d / 10 mm)^2 + sum (D / 30 mm)^2,
its weight a Gaussian of c. On a groom of 11,400 strands similarity saves a third of the error, or half of the guides.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.strands.partings import NOBODY, Neighbours

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
    """The guides at rest, to be looked up by root and shape."""

    roots: Neighbours
    """G roots [m], and the partings between them."""
    shape: Floats
    """(G, 9), see `shape_of`."""
    strand: NDArray[np.uint32]
    """(G,): the groom strand that the guide is, ascending."""


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
    return _best(root, shape, candidate, guides, k)


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
    there = candidate != NOBODY
    apart = (guides.roots.points[candidate] - root[:, None]) / _ROOT_SCALE
    unlike = guides.shape[candidate] - shape[:, None]
    cost = np.where(there, (apart**2).sum(axis=2) + (unlike**2).sum(axis=2), np.inf)
    order = np.argsort(cost, axis=1, kind="stable")
    cost = np.take_along_axis(cost, order, axis=1)
    guide = np.take_along_axis(candidate, order, axis=1)
    taken = min(k, guide.shape[1])
    weight = _weights(cost, taken)
    guide = np.where(guide == NOBODY, guide[:, :1], guide)[:, :taken].clip(min=0)
    missing = ((0, 0), (0, k - taken))
    return np.pad(guide, missing, mode="edge").astype(np.uint32), np.pad(weight, missing).astype(np.float32)


def _weights(cost: Floats, k: int) -> Floats:
    """Gaussian as wide as the mean of the k costs, which falls to 0 where the next guide would take the place.

    Without that fall neighbouring strands would part visibly where their k-th guides change. Infinite costs weigh 0.
    """
    best, there = cost[:, :k], np.isfinite(cost)
    count = np.maximum(there[:, :k].sum(axis=1, keepdims=True), 1)
    known = np.where(there[:, :k], best, 0)
    weight = np.where(there[:, :k], np.exp(-known / (known.sum(axis=1, keepdims=True) / count + 1e-12)), 0)
    if cost.shape[1] > k:
        weight *= 1.001 - known / (cost[:, k : k + 1] + 1e-12)
    return np.asarray(weight / np.maximum(weight.sum(axis=1, keepdims=True), 1e-300))
