"""What the eye cannot see because hair and head are in front of it: left out before it is shaded and drawn.

The number of drawn strands between a point and the eye is a line integral of the density grid, as for a light. Of a
point with n strands before it e^-n is seen; beyond 16 that is nothing. The grid is coarse and the eye not quite a
direction, so the least depth of the neighbouring voxels counts.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from pipeline import kernels

_F32 = NDArray[np.float32]
_F64 = NDArray[np.float64]

HIDDEN: Final = 16.0
"""Strands before a point that hide it."""


class Veil:
    """Which points are hidden from an eye."""

    def __init__(self, density: _F32, origin: _F64, spacing: float, eye: _F64) -> None:
        """Look through (nx, ny, nz) drawn strands per metre, in voxels of `spacing` [m] from `origin` (3,) [m]."""
        from scipy.ndimage import minimum_filter

        self._origin, self._spacing = origin, spacing
        middle = origin + spacing * np.array(density.shape) / 2
        direction = (eye - middle) / np.linalg.norm(eye - middle)
        depth = kernels.optical_depth(density[None], spacing, direction[None].astype(np.float32))[0]
        self._hidden = np.asarray(minimum_filter(depth, size=3, mode="nearest") > HIDDEN)
        self._shift = 0.5 * spacing * direction

    def visible(self, points: _F32) -> NDArray[np.bool_]:
        """Which points (S, P, 3) [m] may be seen, (S, P)."""
        start = (self._origin - self._shift).astype(np.float32)
        voxel = ((points - start) / np.float32(self._spacing)).astype(np.int32)
        np.clip(voxel, 0, np.array(self._hidden.shape, np.int32) - 1, out=voxel)
        _, ny, nz = self._hidden.shape
        flat = (voxel[..., 0] * ny + voxel[..., 1]) * nz + voxel[..., 2]
        return np.asarray(~self._hidden.reshape(-1)[flat])
