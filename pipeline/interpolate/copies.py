"""Copies: strands beyond the groom's count, with roots between the roots of the groom.

Copy i takes the shape of groom strand i modulo the groom's count, and grows near it, on the same side of all partings.
The groom's every prefix is evenly spread, so every prefix of the copies is too.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pipeline import kernels
from pipeline.config.schema import Variation
from pipeline.strands.partings import NOBODY, Neighbours, Partings
from pipeline.strands.random import hashed, normal, uniform

Floats = NDArray[np.float64]

_NEIGHBOURS = 6
_FAR = 4.0  # a neighbour this many times farther than the nearest belongs to another patch of hair
_KEY, _FIRST, _SECOND, _ALONG, _ACROSS, _LENGTH, _PHASE = range(0x1C01, 0x1C08)  # salts


@dataclass(frozen=True)
class Roots:
    """The groom's roots, and the skin that new ones are put on."""

    root: Floats
    """(S, 3) [m]."""
    partings: Partings
    field: kernels.DistanceField | None
    """Distance to the head; None where there is no head."""

    @cached_property
    def neighbours(self) -> NDArray[np.intp]:
        """(S, 6): the nearest roots that no parting lies before, nearest first; repeated where there are fewer near by."""
        own = np.arange(len(self.root))[:, None]
        if len(self.root) == 1:
            return np.repeat(own, _NEIGHBOURS, axis=1)
        near = Neighbours(self.root, self.partings).near(self.root, _NEIGHBOURS + 1, enough=2)
        distance = np.linalg.norm(self.root[near] - self.root[:, None], axis=2)
        distance[(near == NOBODY) | (near == own)] = np.inf
        order = np.argsort(distance, axis=1, kind="stable")[:, : min(_NEIGHBOURS, len(self.root) - 1)]
        near, distance = (np.take_along_axis(of, order, axis=1) for of in (near, distance))
        near = np.where(distance > _FAR * distance[:, :1], near[:, :1], near)
        near = np.where(np.isfinite(distance[:, :1]), near, own)
        return near[:, np.arange(_NEIGHBOURS) % near.shape[1]]

    def between(self, index: NDArray[np.int64], seed: int) -> NDArray[np.float32]:
        """Root (n, 3) [m] for each copy: in a triangle of its parent and two neighbours, its parent nearest.

        Where a parting reaches between the parent and that place, the copy grows where its parent does.
        """
        parent = index % len(self.root)
        root = self._in_triangle(index, parent, seed).astype(np.float32)
        if self.partings:
            uv, own = (self.partings.chart.uv(of) for of in (root, self.root[parent]))
            across = self.partings.across(uv, own, np.arange(len(uv))[:, None])
            root = np.where(across, self.root[parent].astype(np.float32), root)
        return root

    def _in_triangle(self, index: NDArray[np.int64], parent: NDArray[np.int64], seed: int) -> Floats:
        corners = [parent] + [
            self.neighbours[parent, (uniform(seed, index, salt) * _NEIGHBOURS).astype(int)]
            for salt in (_FIRST, _SECOND)
        ]
        share = _barycentric(uniform(seed, index, _ALONG), uniform(seed, index, _ACROSS))
        flat = sum(share[:, i : i + 1] * self.root[corner] for i, corner in enumerate(corners))
        if self.field is None:
            return np.asarray(flat)
        depth = sum(share[:, i] * self._depth[corner] for i, corner in enumerate(corners))
        return _at_depth(self.field, np.asarray(flat), np.asarray(depth))

    @cached_property
    def _depth(self) -> Floats:
        assert self.field is not None
        return kernels.distance(self.field, np.ascontiguousarray(self.root))[0]


@dataclass(frozen=True)
class Looks:
    """How each of n strands differs from its parent: columns of the binding."""

    key: NDArray[np.uint32]
    scale: NDArray[np.float32]
    phase: NDArray[np.float32]


def looks(index: NDArray[np.int64], variation: Variation, seed: int) -> Looks:
    """Random key, length factor and phase [rad] of copies, from their index alone."""
    return Looks(
        key=hashed(seed, index, _KEY),
        scale=(1 - variation.length * uniform(seed, index, _LENGTH)).astype(np.float32),
        phase=(variation.phase * normal(seed, index, _PHASE)).astype(np.float32),
    )


def _barycentric(u: Floats, v: Floats) -> Floats:
    """Uniform points of a triangle (n, 3), folded into the part that is nearest its first corner."""
    fold = u + v > 1
    u, v = np.where(fold, 1 - u, u), np.where(fold, 1 - v, v)
    share = np.stack([1 - u - v, u, v], axis=1)
    return np.asarray(-np.sort(-share, axis=1))


def _at_depth(field: kernels.DistanceField, points: Floats, depth: Floats) -> Floats:
    for _ in range(3):  # Newton along the normal; the distance is nearly linear there
        phi, normal_of = kernels.distance(field, np.ascontiguousarray(points))
        points = points - (phi - depth)[:, None] * normal_of
    return points
