"""Distances that guide hair: to the skin, and to the wall that hair flows on."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline import kernels

Points = NDArray[np.floating[Any]]
Vectors = NDArray[np.float64]

# The wall is the skin joined with ellipsoids that shed hair: one in front of the face, so that it falls beside it, and
# a fin on either shoulder, so that it falls before or behind it and does not lie there like a rug.
_FACE = ((0.0, -0.035, 0.068), (0.064, 0.112, 0.090), 0.025)  # centre, radii, blend [m]
_SHOULDERS = tuple(((side * 0.125, -0.200, -0.030), (0.070, 0.100, 0.024), 0.030) for side in (-1, 1))
_ON_SHOULDER = (0.1, -0.2, -0.03)  # below the skin where there are shoulders


@dataclass(frozen=True)
class Field:
    """Signed distance [m] on a grid, negative inside."""

    values: NDArray[np.float32]
    """(nx, ny, nz) [m]."""
    origin: NDArray[np.float64]
    """(3,) [m]."""
    spacing: float
    """[m]"""

    def sample(self, p: Points) -> tuple[Vectors, Vectors]:
        """Distances (N,) [m] and unit outward normals (N, 3) at points (N, 3)."""
        return kernels.distance(self.native, np.ascontiguousarray(p, np.float64))

    def distance(self, p: Points) -> Vectors:
        """Distances (N,) [m] at points (N, 3)."""
        return self.sample(p)[0]

    def traced(self, origin: Vectors, rays: Vectors, reach: float, steps: int) -> Vectors:
        """Points (N, 3) [m] where rays (N, 3) from the origin leave the skin, traced inwards from `reach` [m]."""
        return kernels.traced(self.native, origin, np.ascontiguousarray(rays, np.float64), reach, steps)

    def outside(self, points: Points, clearance: Vectors, rounds: int) -> tuple[Vectors, Vectors]:
        """Strands (N, P, 3) [m] pushed out to `clearance` (P,) [m] (-inf: stays), and how deep they were (N,) [m]."""
        return kernels.outside(self.native, np.ascontiguousarray(points, np.float64), clearance, rounds)

    @property
    def native(self) -> kernels.DistanceField:
        """The field as kernels take it."""
        found = self.__dict__.get("_kernel")
        if found is None:
            found = kernels.DistanceField(self.values, self.origin, self.spacing)
            object.__setattr__(self, "_kernel", found)
        return found

    def rescaled(self, scale: float, offset: Vectors) -> "Field":
        """The same field in coordinates q = (p - offset) / scale."""
        return Field(
            np.ascontiguousarray(self.values / np.float32(scale)),
            (self.origin - offset) / scale,
            self.spacing / scale,
        )

    def guarded(self) -> "Field":
        """The wall: this field joined smoothly with the guards (fitted coordinates)."""
        shoulders = self.distance(np.array([_ON_SHOULDER]))[0] < 0
        values = self.values
        for centre, radii, blend in (_FACE, *(_SHOULDERS if shoulders else ())):
            guard = self._ellipsoid(np.array(centre), np.array(radii))
            h = np.maximum(blend - np.abs(values - guard), 0) / blend
            values = np.minimum(values, guard) - blend / 6 * h**3
        return Field(np.ascontiguousarray(values, np.float32), self.origin, self.spacing)

    def _ellipsoid(self, centre: Vectors, radii: Vectors) -> NDArray[np.float32]:
        """About the distance [m] to an ellipsoid at the points of the grid."""
        axes = [o + self.spacing * np.arange(n) for o, n in zip(self.origin, self.values.shape, strict=True)]
        x, y, z = (
            ((a - c) / r).astype(np.float32).reshape([-1 if k == i else 1 for k in range(3)])
            for i, (a, c, r) in enumerate(zip(axes, centre, radii, strict=True))
        )
        k0 = np.sqrt(x**2 + y**2 + z**2) + 1e-6
        k1 = np.sqrt((x / radii[0]) ** 2 + (y / radii[1]) ** 2 + (z / radii[2]) ** 2)
        return np.asarray(k0 * (k0 - 1) / (k1 + 1e-6), np.float32)
