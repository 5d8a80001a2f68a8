"""The combing of the scalp: which way hair flows along it, and how far partings are.

Hair flows away from every parting, as charges do from a charged wire: with Q along the partings and D the distance
from there,
    v(p) = sum over Q of (p - Q) / (D^2 + e^2)^3 ds,    D^2 = dx^2 + dz^2 + h dy^2
so that the nearest pieces decide, and between two of them hair goes to where there is room. Heights count for less
(h < 1): hair beside a parting falls straight down from it. About an end of a parting on the scalp the flow turns, so
that hair crosses there and covers it. Without partings hair flows from the crown's whorl and turns about it.

All of it is stored once, on a grid over the scalp's chart. It jumps across a parting: a root that stands near one looks
the flow up some way from it, on its own side.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.groom.head.distance import smoothstep
from pipeline.groom.heads import Head
from pipeline.groom.partings import refined
from pipeline.strands.chart import Chart
from pipeline.strands.partings import Partings

Points = NDArray[np.floating[Any]]
Vectors = NDArray[np.float64]

CELLS = 256  # nodes along a side of the grid: 1.5 mm of the scalp
_RIM = 0.999  # chart radius beyond which nodes repeat it
_STEP = 0.008  # of the chart: pieces of a parting, 1.6 mm
_HEIGHTS = 0.3  # what heights count in D^2
_SOFT = 1e-3  # [m] e
_APART = 0.015  # of the chart: roots look the flow up as if they stood this far from a parting, 3 mm
_NEAR = 0.01  # [m] from a parting: that far no standoff reaches
_APART_FROM = 0.15  # of the chart: but less and less this near to an end of it
_CROWDING, _CROWDED = 0.7, 0.015  # more roots at a parting than elsewhere, over this distance [m]
MOST_CROWDED = 1 + _CROWDING
_SWIRL, _SWIRLED = 1.1, 0.018  # [rad] turn about an end of a parting, [m] how far it reaches
_WHORL = 0.35  # [rad] turn of the flow about the whorl where there is no parting
_BLOCK = 8192


@dataclass(frozen=True)
class Combing:
    """Flow and partings over the scalp's chart, in fitted coordinates."""

    chart: Chart
    grid: NDArray[np.float32]
    """(U, V, 4): unit direction tangential to the skin, and distance [m] from the nearest parting (1 without); node i, j is
    chart point -1 + 2 (i, j) / (U - 1)."""
    segments: Vectors
    """(L, 2, 2): the partings, in the chart."""

    def flow(self, points: Points, normals: Points, standoff: Vectors) -> Vectors:
        """Unit directions of the combing (N, 3) in the planes of the normals (N, 3), for strands with these standoffs."""
        v = _looked_up(self.grid, self.chart.uv(points) + standoff)[:, :3]
        return _unit(tangential(v, normals))

    def crowding(self, points: Points) -> Vectors:
        """Density of roots (N,): more beside a parting, as hair flows away from it and none lies over it."""
        return np.asarray(1 + _CROWDING * (1 - smoothstep(self.distance(points) / _CROWDED)), np.float64)

    def distance(self, points: Points) -> Vectors:
        """Distance (N,) [m] from the nearest parting, 1 without any."""
        return _looked_up(self._apart, self.chart.uv(points))[:, 0]

    def standoff(self, roots: Points) -> Vectors:
        """What is added to the chart points of a strand where it looks the flow up (N, 2), from its root (N, 3)."""
        uv = self.chart.uv(roots)
        found = np.zeros_like(uv)
        if not len(self.segments):
            return found
        near = np.flatnonzero(_looked_up(self._apart, uv)[:, 0] < _NEAR)
        found[near] = self._standing_off(uv[near])
        return found

    def _standing_off(self, uv: Vectors) -> Vectors:
        """The standoffs (N, 2) of chart points by the distance of each from every segment."""
        found = np.zeros_like(uv)
        a, along = self.segments[:, 0], self.segments[:, 1] - self.segments[:, 0]
        squares = np.maximum((along**2).sum(axis=1), 1e-300)
        for first in range(0, len(uv), _BLOCK):
            own = uv[first : first + _BLOCK]
            part = np.clip(np.einsum("nli,li->nl", own[:, None] - a, along) / squares, 0, 1)
            off = own[:, None] - (a + part[..., None] * along)
            distance = np.linalg.norm(off, axis=2)
            row, nearest = np.arange(len(own)), distance.argmin(axis=1)
            d, off = distance[row, nearest], off[row, nearest]
            apart = _APART * smoothstep(self._to_end(own) / _APART_FROM)
            found[first : first + _BLOCK] = (np.maximum(apart - d, 0) / np.maximum(d, 1e-12))[:, None] * off
        return found

    def _to_end(self, uv: Vectors) -> Vectors:
        """Chart distance (N,) from the nearest end of a line; far where there is none."""
        ends = _ends(self.segments)
        if not len(ends):
            return np.full(len(uv), np.inf)
        return np.asarray(np.linalg.norm(uv[:, None] - ends, axis=2).min(axis=1))

    @cached_property
    def _apart(self) -> NDArray[np.float32]:
        """(U, V, 1) [m]: the grid's distances from partings."""
        return np.ascontiguousarray(self.grid[..., 3:])


def comb(head: Head, partings: Partings) -> Combing:
    """Lay out the combing of a head with these partings."""
    chart = head.fitted_chart
    axis = np.linspace(-1, 1, CELLS)
    uv = np.stack(np.meshgrid(axis, axis, indexing="ij"), axis=-1).reshape(-1, 2)
    uv *= np.minimum(1, _RIM / np.maximum(np.hypot(*uv.T), 1e-12))[:, None]
    points = head.on_skin(uv)
    normals = head.fitted_field.sample(points)[1]
    apart = np.ones(len(points))
    if partings:
        away, swirl, apart = _from_partings(head, partings, points)
    else:
        away, swirl = np.tile(-chart.axes[2], (len(points), 1)), np.full(len(points), _WHORL)
    away = _unit(tangential(away, normals))
    c, s = np.cos(swirl)[:, None], np.sin(swirl)[:, None]
    flow = c * away + s * np.cross(normals, away)
    grid = np.column_stack([flow, apart]).astype(np.float32).reshape(CELLS, CELLS, 4)
    return Combing(chart, grid, partings.segments)


def _from_partings(head: Head, partings: Partings, points: Vectors) -> tuple[Vectors, Vectors, Vectors]:
    """Directions away from all partings (N, 3), turns [rad] about their ends (N,) and distances [m] (N,)."""
    lines = [head.on_skin(refined(line, _STEP)) for line in partings.lines]
    pieces = [np.linalg.norm(np.diff(line, axis=0), axis=1) for line in lines]
    middle = np.concatenate([0.5 * (line[1:] + line[:-1]) for line in lines])
    ds = np.concatenate(pieces)
    ends = head.on_skin(_ends(partings.segments))
    ends = ends[head.density(ends) > 0]
    flat = np.sqrt([1, _HEIGHTS, 1])
    away, swirl, nearest = np.empty_like(points), np.zeros(len(points)), np.empty(len(points))
    for first in range(0, len(points), _BLOCK):
        rows = slice(first, first + _BLOCK)
        weight = ds / (_squares(points[rows] * flat, middle * flat) + _SOFT**2) ** 3
        away[rows] = points[rows] * weight.sum(axis=1)[:, None] - weight @ middle
        nearest[rows] = np.sqrt(_squares(points[rows], middle).min(axis=1))
    for end in ends:
        swirl += _SWIRL * np.exp(-((points - end) ** 2).sum(axis=1) / _SWIRLED**2)
    return away, swirl, nearest


def _squares(a: Vectors, b: Vectors) -> Vectors:
    """Squared distances (N, M) of points (N, 3) from points (M, 3)."""
    return np.asarray(np.maximum((a * a).sum(axis=1)[:, None] - 2 * a @ b.T + (b * b).sum(axis=1), 0))


def _ends(segments: Vectors) -> Vectors:
    """Where lines end (E, 2): the points that only one of the segments (L, 2, 2) has."""
    if not len(segments):
        return np.zeros((0, 2))
    points, count = np.unique(segments.reshape(-1, 2), axis=0, return_counts=True)
    return np.asarray(points[count == 1])


def _looked_up(grid: NDArray[np.float32], uv: Vectors) -> Vectors:
    """Values (N, K) of a grid (U, U, K) over the chart at chart points (N, 2), bilinearly."""
    last = grid.shape[0] - 1
    place = np.clip((uv + 1) * (last / 2), 0, last - 1e-9)
    i = place.astype(np.int64)
    u, v = (place - i).T[..., None]
    flat, at = grid.reshape(-1, grid.shape[2]), i[:, 0] * (last + 1) + i[:, 1]
    low = flat[at] * (1 - v) + flat[at + 1] * v
    high = flat[at + last + 1] * (1 - v) + flat[at + last + 2] * v
    return np.asarray(low * (1 - u) + high * u)


def tangential(v: NDArray[Any], n: Points) -> Vectors:
    """Vectors (N, 3) without their part along unit normals n (N, 3)."""
    return np.asarray(v - np.einsum("ij,ij->i", v, n)[:, None] * n)


def _unit(v: Vectors) -> Vectors:
    return np.asarray(v / np.maximum(np.linalg.norm(v, axis=1), 1e-12)[:, None])
