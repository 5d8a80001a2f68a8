"""Normals and curvature of a mesh at its points."""

import numpy as np
from numpy.typing import NDArray


def point_normals(points: NDArray[np.floating], triangles: NDArray[np.integer]) -> NDArray[np.float64]:
    """Unit outward normals (V, 3) of points (V, 3), the mean of the faces (T, 3) around a point weighted by area."""
    p = points.astype(np.float64)[triangles]
    area = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    corners = triangles.ravel()
    sums = [np.bincount(corners, np.repeat(part, 3), len(points)) for part in area.T]
    normals = np.stack(sums, axis=1)
    return np.asarray(normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300))


def point_curvature(
    points: NDArray[np.floating], normals: NDArray[np.floating], triangles: NDArray[np.integer]
) -> NDArray[np.float64]:
    """Mean curvature (V,) [1/m] of a mesh around its points: how far its unit normals (V, 3) turn along its edges.

    The mean over the edges at a point, weighted by the squares of their lengths, then over its neighbours.
    """
    ends = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    turn, way = (np.linalg.norm(np.diff(of[ends], axis=1)[:, 0], axis=1) for of in (normals, points))
    both, count = ends.T.ravel(), len(points)

    def gathered(values: NDArray[np.floating]) -> NDArray[np.float64]:
        return np.asarray(np.bincount(both, np.tile(values, 2), count), np.float64)

    rough = gathered(turn * way) / np.maximum(gathered(way * way), 1e-300)
    around = np.bincount(both, rough[ends[:, ::-1].T.ravel()], count)
    return np.asarray(around / np.maximum(np.bincount(both, minlength=count), 1))
