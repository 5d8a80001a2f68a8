"""Grids on which the distance to a mesh is known."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline import kernels

Vectors = NDArray[np.float64]

_MARGIN = 0.03  # [m] of grid around the mesh


@dataclass(frozen=True)
class Grid:
    """Nodes at origin + spacing * index."""

    origin: Vectors
    """(3,) [m]"""
    spacing: float
    """[m]"""
    shape: tuple[int, int, int]

    @classmethod
    def around(cls, points: NDArray[np.floating], spacing: float) -> "Grid":
        """The grid around points (..., 3) [m], with 3 cm to spare."""
        flat = np.asarray(points, np.float64).reshape(-1, 3)
        low, high = flat.min(axis=0) - _MARGIN, flat.max(axis=0) + _MARGIN
        nx, ny, nz = (int(n) + 1 for n in np.ceil((high - low) / spacing))
        return cls(low, spacing, (nx, ny, nz))

    def measure(self, points: NDArray[np.floating], triangles: NDArray[np.integer]) -> kernels.MeshDistance:
        """Signed distance to a mesh: points (V, 3) [m], triangles (T, 3), closed and wound outwards."""
        return kernels.MeshDistance(
            np.ascontiguousarray(points, np.float64),
            np.ascontiguousarray(triangles, np.int32),
            self.origin,
            self.spacing,
            self.shape,
        )

    def field(self, distance: kernels.MeshDistance) -> kernels.DistanceField:
        """The distances as kernels sample them."""
        return kernels.DistanceField(distance.values, self.origin, self.spacing)
