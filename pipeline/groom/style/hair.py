"""What style operators work on: some strands, and what is known about each of them."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from pipeline import kernels
from pipeline.strands.partings import NOBODY

Vectors = NDArray[np.float64]
Index = NDArray[np.int64]

LONGEST = 0.56  # [m]
STEP = 4e-3  # [m] between the points of hair that is not cut yet
UNCUT = round(LONGEST / STEP) + 1  # points


@dataclass(frozen=True)
class Ties:
    """Rings that strands are pulled through."""

    at: Vectors
    """(N,) [m] arc length from the root to the ring; 0 where there is none."""
    ring: Vectors
    """(N, 6) its middle [m] and axis; not-a-number where there is none."""


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
    ties: Ties | None = None
    """What ties strands together; None where nothing does."""
    section: Index | None = None
    """(N,) the part of the hair that strands were set apart as: clumps do not reach from one to another. None: all are one."""

    def __len__(self) -> int:
        return len(self.index)

    @property
    def along(self) -> Vectors:
        """Arc length (N, K) [m] of the axis from the root to every point."""
        return np.linspace(0, 1, self.points.shape[1]) * self.length[:, None]

    @property
    def free_from(self) -> Vectors:
        """Arc length (N,) [m] from which strands hang free: 0, or where they are tied."""
        return np.zeros(len(self)) if self.ties is None else self.ties.at

    @property
    def sections(self) -> Index:
        """The section (N,) of every strand; 0 is what was not set apart."""
        return np.zeros(len(self), np.int64) if self.section is None else self.section

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
    free_from: Vectors
    """(M,) [m]"""
    section: Index
    """(M,)"""


def set_apart(hair: Hair, which: Index, name: str) -> Index:
    """The sections (N,) of hair of which some strands are now one of this name."""
    section = hair.sections.copy()
    section[which] = crc32(name.encode())
    return section


def bristles(root: Vectors, normal: Vectors) -> Vectors:
    """Root and tip (N, 2, 3) [m], `LONGEST` apart, of hair that nobody has styled: straight out of the skin."""
    return np.stack([root, root + LONGEST * normal], axis=1)


def divided(hair: Hair) -> Hair:
    """Hair in points that can be moved: `UNCUT` of them, where there are but root and tip."""
    if hair.points.shape[1] > 2:
        return hair
    return replace(hair, points=cut_to(hair.points, hair.length, UNCUT))


def cut_to(points: Vectors, length: Vectors, count: int) -> Vectors:
    """The first `length` (N,) [m] of strands (N, K, 3), as `count` points at equal arc lengths."""
    return kernels.shortened(points, length, count)


def shortened(whole: Vectors, jitter: float, own: Vectors, rare: Vectors) -> Vectors:
    """Lengths (N,) [m] with single strands cut shorter: most a little, few much; `own`, `rare` (N,) in 0 to 1."""
    return np.asarray(whole * (1 - jitter * (0.5 * own + 1.5 * rare**6)))


def unit(v: NDArray[Any]) -> Vectors:
    """Vectors (..., 3) of length 1."""
    return np.asarray(v / np.maximum(np.sqrt(dot(v, v)), 1e-12))


def dot(a: NDArray[Any], b: NDArray[Any]) -> Vectors:
    """Products (..., 1) of vectors (..., 3)."""
    return np.asarray(np.einsum("...j,...j->...", a, b)[..., None])
