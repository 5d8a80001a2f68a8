"""Signed distance grid of a closed triangle mesh.

Nodes near the surface take the exact distance to the nearest triangle; all others the nearest foot that sweeps over
the grid bring them from there (Danielsson, "Euclidean Distance Mapping", 1980). Inside or outside is told by the
angle-weighted pseudonormal of the face, edge or point that is nearest (Baerentzen and Aanaes, "Signed Distance
Computation Using the Angle Weighted Pseudonormal", 2005), and away from the surface by the region of nodes that a
node belongs to.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, label
from scipy.spatial import cKDTree

from pipeline.groom.head_field import Field

Vectors = NDArray[np.float64]
Singles = NDArray[np.float32]

_MARGIN = 0.03  # [m] of grid around the mesh
_EXACT = 3.0  # [cells] nodes this close to the surface take their exact foot
_BESIDE = 0.87  # [cells] half the diagonal of a cell: some node is always this close
_TRIED = 3  # samples of the surface whose triangles are tried for a node
_SWEEPS = (0, 1, 2, 0, 1, 2)  # axes


@dataclass(frozen=True)
class Surface:
    """A closed mesh, wound outwards, with what distances need."""

    points: Vectors
    """(V, 3) [m]"""
    triangles: NDArray[np.int64]
    """(T, 3)"""

    @cached_property
    def corners(self) -> Vectors:
        """(T, 3, 3) [m]"""
        return self.points[self.triangles]

    @cached_property
    def normals(self) -> Vectors:
        """Unit normals of the faces (T, 3)."""
        a, b, c = self.corners.transpose(1, 0, 2)
        return _unit(np.cross(b - a, c - a))

    @cached_property
    def pseudonormals(self) -> Vectors:
        """(T, 7, 3): of the three points, of the edges opposite to them, and of the face."""
        at_points, at_edges = np.empty((2, *self.corners.shape))
        for k in range(3):
            i, j = (k + 1) % 3, (k + 2) % 3
            u, v = (_unit(self.corners[:, m] - self.corners[:, k]) for m in (i, j))
            angle = np.arccos(np.clip(_dot(u, v), -1, 1))
            at_points[:, k] = angle[:, None] * self.normals
            at_edges[:, k] = self.normals
        edges = np.sort(
            np.stack([np.roll(self.triangles, -1, 1), np.roll(self.triangles, -2, 1)], axis=2), axis=2
        )
        edge = np.unique(edges[..., 0] * len(self.points) + edges[..., 1], return_inverse=True)[1]
        return np.concatenate(
            [
                _summed(at_points, self.triangles),
                _summed(at_edges, edge.reshape(-1, 3)),
                self.normals[:, None],
            ],
            axis=1,
        )

    def samples(self, spacing: float) -> tuple[Vectors, NDArray[np.int64]]:
        """Points (N, 3) at most `spacing` [m] apart all over the surface, and the triangles (N,) they lie on."""
        longest = np.linalg.norm(self.corners - np.roll(self.corners, 1, axis=1), axis=2).max(axis=1)
        parts = np.maximum(np.ceil(longest / spacing).astype(np.int64), 1)
        found, owner = [], []
        for n in np.unique(parts):
            chosen = np.flatnonzero(parts == n)
            weights = _lattice(int(n))
            found.append(np.einsum("wk,tkx->twx", weights, self.corners[chosen]).reshape(-1, 3))
            owner.append(np.repeat(chosen, len(weights)))
        return np.concatenate(found), np.concatenate(owner)

    def feet(self, triangle: NDArray[np.int64], queries: Vectors) -> tuple[Vectors, Vectors]:
        """Closest points (N, 3) of one triangle for each query (N, 3), and the pseudonormals there."""
        feet, place = _closest_on_triangle(self.corners[triangle], queries)
        return feet, self.pseudonormals[triangle, place]


def distance_grid(points: NDArray[np.float32], triangles: NDArray[np.int32], spacing: float) -> Field:
    """Signed distance on a grid around the mesh; `points` (V, 3) [m], `triangles` (T, 3) closed, wound outwards."""
    surface = Surface(points.astype(np.float64), triangles.astype(np.int64))
    low, high = surface.points.min(axis=0) - _MARGIN, surface.points.max(axis=0) + _MARGIN
    shape = tuple(int(n) for n in np.ceil((high - low) / spacing).astype(int) + 1)
    samples, owner = surface.samples(spacing)
    near = np.flatnonzero(_near(samples, low, spacing, shape))
    nodes = low + spacing * np.stack(np.unravel_index(near, shape), axis=1)
    tried = owner[cKDTree(samples).query(nodes, k=min(_TRIED, len(samples)))[1]].reshape(len(near), -1)
    feet, signed = closest(surface, tried, nodes)
    return Field(_filled(feet, signed, near, low, spacing, shape), low, spacing)


def closest(surface: Surface, tried: NDArray[np.int64], queries: Vectors) -> tuple[Vectors, Vectors]:
    """Closest points (N, 3) on the tried triangles (N, K), and signed distances (N,) [m], negative inside."""
    best = np.full(len(queries), np.inf)
    feet, outwards = np.zeros_like(queries), np.zeros_like(queries)
    for k in range(tried.shape[1]):
        rows = np.flatnonzero((tried[:, k, None] != tried[:, :k]).all(axis=1))  # not tried before
        foot, normal = surface.feet(tried[rows, k], queries[rows])
        d = np.linalg.norm(foot - queries[rows], axis=1)
        closer = d < best[rows]
        rows = rows[closer]
        best[rows], feet[rows], outwards[rows] = d[closer], foot[closer], normal[closer]
    return feet, np.where(_dot(queries - feet, outwards) < 0, -best, best)


def _closest_on_triangle(t: Vectors, q: Vectors) -> tuple[Vectors, NDArray[np.int64]]:
    """Closest points on triangles (N, 3, 3) to q (N, 3), and where: 0-2 a point, 3-5 the edge opposite, 6 inside."""
    a, b, c = t[:, 0], t[:, 1], t[:, 2]
    ab, ac, aq = b - a, c - a, q - a
    d00, d01, d11, d20, d21 = _dot(ab, ab), _dot(ab, ac), _dot(ac, ac), _dot(aq, ab), _dot(aq, ac)
    area = np.maximum(d00 * d11 - d01 * d01, 1e-300)
    v, w = (d11 * d20 - d01 * d21) / area, (d00 * d21 - d01 * d20) / area
    foot = a + v[:, None] * ab + w[:, None] * ac
    place = np.full(len(q), 6)
    out = np.flatnonzero((v < 0) | (w < 0) | (v + w > 1))
    best = np.full(len(out), np.inf)
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        start, along = t[out, i], t[out, j] - t[out, i]
        s = np.clip(_dot(q[out] - start, along) / np.maximum(_dot(along, along), 1e-300), 0, 1)
        on_edge = start + s[:, None] * along
        d = np.linalg.norm(q[out] - on_edge, axis=1)
        closer = d < best
        best[closer], foot[out[closer]] = d[closer], on_edge[closer]
        place[out[closer]] = np.where(s == 0, i, np.where(s == 1, j, 3 + k))[closer]
    return np.asarray(foot), place


def _near(samples: Vectors, low: Vectors, spacing: float, shape: tuple[int, ...]) -> NDArray[np.bool_]:
    """Nodes (nx * ny * nz,) within reach of the samples."""
    away = np.ones(shape, bool)
    away[tuple(np.round((samples - low) / spacing).astype(int).T)] = False
    return np.asarray(distance_transform_edt(away) <= _EXACT).reshape(-1)


def _filled(
    feet: Vectors,
    signed: Vectors,
    near: NDArray[np.int64],
    low: Vectors,
    spacing: float,
    shape: tuple[int, ...],
) -> NDArray[np.float32]:
    """Signed distances (nx, ny, nz) [m] of all nodes from those near the surface."""
    beside = np.abs(signed) <= _BESIDE * spacing
    owner = np.full(shape, -1, np.int32)
    owner.reshape(-1)[near[beside]] = np.flatnonzero(beside)
    nearest = distance_transform_edt(owner < 0, return_distances=False, return_indices=True)
    owner = owner[tuple(nearest)]
    owner.reshape(-1)[near] = np.arange(len(near))
    node = [np.asarray(low[k] + spacing * np.arange(shape[k]), np.float32) for k in range(3)]
    foot = feet.astype(np.float32).T[:, owner]
    square = _square(np.meshgrid(*node, indexing="ij", sparse=True), foot)
    for axis in _SWEEPS:
        _sweep(np.moveaxis(foot, axis + 1, 1), np.moveaxis(square, axis, 0), node, axis)
    values = np.where(_inside(signed, near, shape), -np.sqrt(square), np.sqrt(square))
    values.reshape(-1)[near] = signed
    return values


def _sweep(foot: Singles, square: Singles, node: list[Singles], axis: int) -> None:
    """Each layer of nodes, there and back, takes the feet of the layer before it that are nearer than its own."""
    count = len(square)
    for layers in (range(1, count), range(count - 2, -1, -1)):
        for i in layers:
            offered = foot[:, i - layers.step]
            here = [node[k] if k != axis else node[k][i : i + 1] for k in range(3)]
            away = _square(np.meshgrid(*here, indexing="ij", sparse=True), np.expand_dims(offered, axis + 1))
            away = away.reshape(square[i].shape)
            closer = away < square[i]
            square[i][closer] = away[closer]
            foot[:, i][:, closer] = offered[:, closer]


def _square(node: Sequence[Singles], foot: Singles) -> Singles:
    """Squared distances [m^2] between nodes, given by their coordinates, and feet (3, ...)."""
    return np.asarray(sum((x - f) ** 2 for x, f in zip(node, foot, strict=True)), np.float32)


def _inside(signed: Vectors, near: NDArray[np.int64], shape: tuple[int, ...]) -> NDArray[np.bool_]:
    """Which nodes away from the surface lie inside: those of regions that border on nodes inside."""
    state = np.zeros(shape, np.int8)
    state.reshape(-1)[near] = np.where(signed < 0, -1, 1)
    regions, count = label(state == 0)
    votes = np.zeros(count + 1)
    for axis in range(3):
        one, other = (np.moveaxis(x, axis, 0) for x in (regions, state))
        for region, border in ((one[1:], other[:-1]), (one[:-1], other[1:])):
            votes += np.bincount(region.ravel(), border.ravel(), count + 1)
    votes[0] = 0
    return np.asarray(votes[regions] < 0)


def _lattice(n: int) -> Vectors:
    """Barycentric weights of the middles of the n^2 small triangles of a triangle."""
    i, j = (x.ravel() for x in np.meshgrid(np.arange(n), np.arange(n), indexing="ij"))
    up, down = i + j < n, i + j < n - 1
    u = np.concatenate([i[up] + 1 / 3, i[down] + 2 / 3]) / n
    v = np.concatenate([j[up] + 1 / 3, j[down] + 2 / 3]) / n
    return np.stack([1 - u - v, u, v], axis=1, dtype=np.float64)


def _summed(values: Vectors, index: NDArray[np.int64]) -> Vectors:
    """Sums over equal indices (T, 3) of values (T, 3, 3), at each place of the index."""
    flat = index.ravel()
    sums = np.stack([np.bincount(flat, values[..., k].ravel())[flat] for k in range(3)], axis=1)
    return np.asarray(sums, np.float64).reshape(-1, 3, 3)


def _dot(a: Vectors, b: Vectors) -> Vectors:
    return np.asarray(np.einsum("ij,ij->i", a, b))


def _unit(v: Vectors) -> Vectors:
    return np.asarray(v / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1e-300))
