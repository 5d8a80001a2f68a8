"""Which strands are simulated: k-means on root and shape, then the real strand nearest to each centre.

Of the choices measured on a real groom, clusters of root and shape reconstruct it best: 500 of them beat 1,000 random
guides. Centres start from an even spread over the progressive order; every step is deterministic.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from pipeline.strands.partings import NOBODY, Neighbours, Partings

_ROOT = 10e-3  # [m] of root distance that count as one
_SHAPE = 30e-3  # [m] of shape difference that count as one
_PREFIX = 20_000  # strands that are looked at, or more for many guides
_ROUNDS = 12


def looked_at(count: int) -> int:
    """How many strands `choose_guides` looks at for `count` guides: any prefix is a valid groom."""
    return max(_PREFIX, 4 * count)


def choose_guides(points: NDArray[np.float32], count: int) -> NDArray[np.uint32]:
    """Indices (G,) of the guides among strands (S, P, 3) [m], ascending; all strands when there are few."""
    if count >= len(points):
        return np.arange(len(points), dtype=np.uint32)
    x = features(points[: looked_at(count)])
    centres = x[:count].copy()
    for _ in range(_ROUNDS):
        _, nearest = cKDTree(centres).query(x)
        size = np.bincount(nearest, minlength=count)
        for k in range(x.shape[1]):
            total = np.bincount(nearest, x[:, k], count)
            centres[:, k] = np.where(size > 0, total / np.maximum(size, 1), centres[:, k])
    return _nearest_strands(x, centres)


def shut_in(guides: NDArray[np.uint32], roots: NDArray[np.float32], partings: Partings) -> NDArray[np.uint32]:
    """The strands, ascending, that have to be guides too: so that each of the roots (S, 3) [m] has one on its side.

    They are found in progressive order: the first strand of every part of the scalp that partings shut off.
    """
    found: list[int] = []
    if partings:
        near = Neighbours(roots[guides].astype(np.float64), partings).near(roots, 1)[:, 0]
        left = np.flatnonzero(near == NOBODY)
        uv = partings.chart.uv(roots[left])
        while len(left):
            found.append(int(left[0]))
            still = partings.across(uv, uv[:1], np.zeros((len(uv), 1), np.int64))[:, 0]
            left, uv = left[still], uv[still]
    return np.array(found, np.uint32)


def features(points: NDArray[np.float32]) -> NDArray[np.float64]:
    """What guides are chosen by, (S, 12): root and three points relative to it."""
    root, last = points[:, 0].astype(np.float64), points.shape[1] - 1
    shape = [points[:, round(last * part)] - root for part in (1 / 3, 2 / 3, 1)]
    return np.column_stack([root / _ROOT, *(s / _SHAPE for s in shape)])


def _nearest_strands(x: NDArray[np.float64], centres: NDArray[np.float64]) -> NDArray[np.uint32]:
    """The strand nearest to each centre; where two centres ask for one strand, the next one of the second."""
    tree = cKDTree(x)
    _, wanted = tree.query(centres, k=min(8, len(x)))
    taken: dict[int, None] = {}
    for choices in np.asarray(wanted):
        free = next((int(i) for i in choices if int(i) not in taken), None)
        if free is not None:
            taken[free] = None
    spare = (i for i in range(len(x)) if i not in taken)
    while len(taken) < len(centres):
        taken[next(spare)] = None
    return np.sort(np.array(list(taken), np.uint32))
