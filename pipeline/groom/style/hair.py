"""What style operators work on: some strands, and what is known about each of them."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.strands.partings import NOBODY
from pipeline.strands.spacing import arc_length, at_arc_length

Vectors = NDArray[np.float64]
Index = NDArray[np.int64]

LONGEST = 0.56  # [m]
STEP = 4e-3  # [m] between the points of hair that is not cut yet
UNCUT = round(LONGEST / STEP) + 1  # points


@dataclass(frozen=True)
class Hair:
    """N strands of K points in fitted coordinates, y up. K changes from operator to operator, not from chunk to chunk."""

    index: Index
    """(N,) which strands of the groom they are."""
    root: Vectors
    """(N, 3) [m]"""
    normal: Vectors
    """(N, 3) unit normals of the skin."""
    points: Vectors
    """(N, K, 3) [m], root first, at equal parts of `length`."""
    length: Vectors
    """(N,) [m] of the strand's axis: curls and frizz wind about it."""
    comb: Vectors
    """(N, 3) unit direction that the strand is combed to at its root; frames start from it."""
    locks: Mapping[str, Index] = field(default_factory=dict)
    """Of every clump operator, the clump (N,) that the strands belong to, `NOBODY` where to none."""

    def __len__(self) -> int:
        return len(self.index)

    @property
    def along(self) -> Vectors:
        """Arc length (N, K) [m] of the axis from the root to every point."""
        return np.linspace(0, 1, self.points.shape[1]) * self.length[:, None]

    def lock(self, per: str | None) -> Index:
        """The clump (N,) of an operator that strands belong to; a strand in none is by itself."""
        return self.index if per is None else np.where(self.locks[per] == NOBODY, self.index, self.locks[per])


@dataclass(frozen=True)
class Middles:
    """The middle strands of a clump operator, as they come to it."""

    points: Vectors
    """(M, K, 3) [m]"""
    length: Vectors
    """(M,) [m]"""


def bristles(root: Vectors, normal: Vectors) -> Vectors:
    """Points (N, UNCUT, 3) [m] of hair that nobody has styled: straight out of the skin."""
    return root[:, None] + np.linspace(0, LONGEST, UNCUT)[:, None] * normal[:, None]


def cut_to(points: Vectors, length: Vectors, count: int) -> Vectors:
    """The first `length` (N,) [m] of strands (N, K, 3), as `count` points at equal arc lengths."""
    return np.asarray(at_arc_length(points, arc_length(points), np.linspace(0, 1, count) * length[:, None]))


def shortened(whole: Vectors, jitter: float, own: Vectors, rare: Vectors) -> Vectors:
    """Lengths (N,) [m] with single strands cut shorter: most a little, few much; `own`, `rare` (N,) in 0 to 1."""
    return np.asarray(whole * (1 - jitter * (0.5 * own + 1.5 * rare**6)))


def unit(v: NDArray[Any]) -> Vectors:
    """Vectors (..., 3) of length 1."""
    return np.asarray(v / np.maximum(np.sqrt(dot(v, v)), 1e-12))


def dot(a: NDArray[Any], b: NDArray[Any]) -> Vectors:
    """Products (..., 1) of vectors (..., 3)."""
    return np.asarray(np.einsum("...j,...j->...", a, b)[..., None])
