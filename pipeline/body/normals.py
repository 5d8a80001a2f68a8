"""Normals of a mesh at its points."""

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
