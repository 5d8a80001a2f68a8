"""Strands rebuilt at rest from nothing but their guides: how well a choice of guides stands for a groom.

Expansion moves a strand's own rest shape, so that at rest it is exact whatever the guides are. What guides do not know
of a groom shows when strands are made from them: directions of guides at the strand's arc lengths, blended by the
strand's weights, are followed from its root over its own segments. A strand unlike that will not move like its guides.
"""

import numpy as np
from numpy.typing import NDArray

from pipeline.strands.follow import GuideSet, follow, shape_of
from pipeline.strands.partings import Neighbours, Partings

Points = NDArray[np.float32]
Floats = NDArray[np.float64]

_CHUNK = 4096
_EMPTY = 1e-30


def rebuild_error(
    points: Points, guides: NDArray[np.uint32], partings: Partings, guides_per_strand: int = 3
) -> Floats:
    """Mean distance of each strand's points from where its guides would put them, as a fraction of its length, (S,).

    Args:
        points: (S, P, 3) [m] at rest.
        guides: rows of them that are guides; they stand for others, not for themselves alone.
        partings: which no strand follows a guide across.
        guides_per_strand: how many a strand follows.

    """
    roots, of_guides = points[:, 0].astype(np.float64), points[guides]
    chosen = GuideSet(Neighbours(roots[guides], partings), shape_of(of_guides), guides)
    error = np.empty(len(points))
    for a in range(0, len(points), _CHUNK):
        rows = slice(a, a + _CHUNK)
        guide, weight = follow(roots[rows], shape_of(points[rows]), chosen, guides_per_strand)
        made = rebuilt(points[rows], of_guides, guide, weight)
        apart = np.linalg.norm(made - points[rows], axis=2).mean(axis=1)
        length = np.linalg.norm(np.diff(points[rows], axis=1), axis=2).sum(axis=1)
        error[rows] = apart / np.maximum(length, _EMPTY)
    return error


def rebuilt(points: Points, guides: Points, guide: NDArray[np.uint32], weight: Points) -> Floats:
    """Points (n, P, 3) [m] of strands with the roots and segment lengths of `points` and their guides' directions.

    Beyond a guide's tip its last direction counts.
    """
    own = np.linalg.norm(np.diff(points.astype(np.float64), axis=1), axis=2)
    edges = np.diff(guides.astype(np.float64), axis=1)
    lengths = np.linalg.norm(edges, axis=2, keepdims=True)
    directions, spacing = edges / np.maximum(lengths, _EMPTY), lengths.mean(axis=(1, 2))
    last = directions.shape[1] - 1
    along = np.arange(own.shape[1]) + 0.5
    mean = np.zeros((*own.shape, 3))
    for g, w in zip(guide.T.astype(np.int64), weight.T, strict=True):
        at = along * (own.mean(axis=1) / np.maximum(spacing[g], _EMPTY))[:, None] - 0.5
        at = at.clip(0, last)
        before = np.minimum(at.astype(np.int64), max(last - 1, 0))
        part = (at - before)[..., None]
        here, after = directions[g[:, None], before], directions[g[:, None], np.minimum(before + 1, last)]
        mean += w[:, None, None] * (here + part * (after - here))
    mean *= (own / np.maximum(np.linalg.norm(mean, axis=2), _EMPTY))[..., None]
    made = np.concatenate([points[:, :1].astype(np.float64), mean], axis=1)
    return np.cumsum(made, axis=1)
