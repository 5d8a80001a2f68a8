"""Signed distance grid of a closed triangle mesh.

Distances are to the nearest triangle near the surface (within a few cells) and to the nearest foot of a near node
elsewhere, as for the mannequin; the sign is vtk's (inside or outside of the closed surface by the angle-weighted
normal of the nearest element: Baerentzen and Aanaes, "Signed Distance Computation Using the Angle Weighted
Pseudonormal", 2005).
"""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt
from scipy.spatial import cKDTree

from pipeline.groom.head_field import Field

_MARGIN = 0.03  # [m] of grid around the mesh
_BAND = 2.0  # [cells] nodes this close to the surface take their exact foot
_CANDIDATES = 12  # triangles tried for a node


def distance_grid(points: NDArray[np.float32], triangles: NDArray[np.int32], spacing: float) -> Field:
    """Signed distance on a grid around the mesh; `points` (V, 3) [m], `triangles` (T, 3) closed, wound outwards."""
    p = points.astype(np.float64)
    lo, hi = p.min(axis=0) - _MARGIN, p.max(axis=0) + _MARGIN
    shape = tuple(int(n) for n in np.ceil((hi - lo) / spacing).astype(int) + 1)
    nodes = np.stack(np.meshgrid(*[lo[k] + spacing * np.arange(shape[k]) for k in range(3)], indexing="ij"), -1)
    nodes = nodes.reshape(-1, 3)
    near = np.flatnonzero(_near_surface(p[triangles], lo, spacing, shape))
    feet, side = closest(p, triangles, nodes[near])
    far = np.ones(len(nodes), bool)
    far[near] = False
    nearest = distance_transform_edt(far.reshape(shape), return_distances=False, return_indices=True)
    at = np.ravel_multi_index(tuple(nearest.reshape(3, -1)), shape)
    foot_of = np.empty((len(nodes), 3))
    foot_of[near] = feet
    sign = np.empty(len(nodes))
    sign[near] = side
    inside = _inside(sign, far, shape)
    d = np.linalg.norm(nodes - foot_of[at], axis=1)
    values = np.where(inside, -d, d).reshape(shape)
    return Field(np.ascontiguousarray(values, np.float32), lo, spacing)


def closest(
    p: NDArray[np.float64], triangles: NDArray[np.int32], queries: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Closest points (N, 3) on the triangles and the side (N,), +1 outside, -1 inside."""
    corners = p[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    tree = cKDTree(corners.mean(axis=1))
    count = min(_CANDIDATES, len(triangles))
    _, index = tree.query(queries, k=count)
    index = index.reshape(len(queries), count)
    best = np.full(len(queries), np.inf)
    feet = np.zeros_like(queries)
    push = np.zeros_like(queries)  # sum of the unit normals of all triangles that share the closest point
    for k in range(count):
        foot = _closest_on_triangle(corners[index[:, k]], queries)
        d = np.linalg.norm(foot - queries, axis=1)
        unit = normals[index[:, k]]
        unit = unit / np.maximum(np.linalg.norm(unit, axis=1, keepdims=True), 1e-300)
        closer, equal = d < best - 1e-9, np.abs(d - best) <= 1e-9
        push = np.where(closer[:, None], unit, np.where(equal[:, None], push + unit, push))
        feet = np.where(closer[:, None], foot, feet)
        best = np.where(closer, d, best)
    side = np.where(np.einsum("ij,ij->i", queries - feet, push) < 0, -1.0, 1.0)
    return feet, side


def _closest_on_triangle(t: NDArray[np.float64], q: NDArray[np.float64]) -> NDArray[np.float64]:
    """Closest points on triangles (N, 3, 3) to q (N, 3): inside by barycentrics, else on the nearest edge."""
    a, b, c = t[:, 0], t[:, 1], t[:, 2]
    ab, ac, aq = b - a, c - a, q - a
    d00, d01, d11 = (np.einsum("ij,ij->i", u, v) for u, v in ((ab, ab), (ab, ac), (ac, ac)))
    d20, d21 = np.einsum("ij,ij->i", aq, ab), np.einsum("ij,ij->i", aq, ac)
    area = np.maximum(d00 * d11 - d01 * d01, 1e-300)
    v, w = (d11 * d20 - d01 * d21) / area, (d00 * d21 - d01 * d20) / area
    foot = a + v[:, None] * ab + w[:, None] * ac
    outside = (v < 0) | (w < 0) | (v + w > 1)
    best = np.where(outside, np.inf, 0.0)
    for start, end in ((a, b), (b, c), (c, a)):
        along = end - start
        s = np.einsum("ij,ij->i", q - start, along) / np.maximum(np.einsum("ij,ij->i", along, along), 1e-300)
        on_edge = start + np.clip(s, 0, 1)[:, None] * along
        d = np.linalg.norm(q - on_edge, axis=1)
        foot = np.where((d < best)[:, None], on_edge, foot)
        best = np.minimum(best, d)
    return foot


def _near_surface(
    corners: NDArray[np.float64], lo: NDArray[np.float64], spacing: float, shape: tuple[int, ...]
) -> NDArray[np.bool_]:
    """Nodes within the band, by sampling every triangle at the grid's spacing and growing the samples."""
    from scipy.ndimage import distance_transform_edt as edt

    marked = np.ones(shape, bool)
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    for n in np.unique(np.ceil(longest / spacing).astype(int)):
        chosen = corners[np.ceil(longest / spacing).astype(int) == n]
        steps = max(int(n), 1)
        for i in range(steps + 1):
            for j in range(steps + 1 - i):
                u, v = i / steps, j / steps
                p = chosen[:, 0] * (1 - u - v) + chosen[:, 1] * u + chosen[:, 2] * v
                marked[tuple(np.round((p - lo) / spacing).astype(int).T)] = False
    return np.asarray(edt(marked) <= _BAND).reshape(-1)


def _inside(sign: NDArray[np.float64], far: NDArray[np.bool_], shape: tuple[int, ...]) -> NDArray[np.bool_]:
    """Inside by the sign near the surface; away from it by whether a region of far nodes touches inside nodes."""
    from scipy.ndimage import binary_dilation, label

    inside = np.where(far, False, sign < 0).reshape(shape)
    regions, count = label(far.reshape(shape))
    touching = binary_dilation(inside) & (regions > 0)
    votes_in = np.bincount(regions[touching], minlength=count + 1)
    outside = np.where(far, False, sign > 0).reshape(shape)
    votes_out = np.bincount(regions[binary_dilation(outside) & (regions > 0)], minlength=count + 1)
    inner = votes_in > votes_out
    inner[0] = False
    return np.asarray(inside | inner[regions]).reshape(-1)
