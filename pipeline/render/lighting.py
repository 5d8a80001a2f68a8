"""Light on hair and head in one frame."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pipeline import kernels
from pipeline.config.schema import Fibre, Scene

if TYPE_CHECKING:
    pass

_F32 = NDArray[np.float32]
_F64 = NDArray[np.float64]


class Lighting:
    """Light on hair and head, frame by frame: `begin`, `add` all strands, `finish`, then `shade` any of them."""

    def __init__(self, scene: Scene, hair: Fibre, grid: int) -> None:
        """Prepare what does not change from frame to frame: `grid` voxels along the longest side."""

    def begin(self, lower: _F64, upper: _F64, width: float) -> None:
        """Start a frame: bounds (3,) float64 [m] of all strands, and a typical drawn width [m]."""

    def add(self, points: _F32, widths: _F32) -> None:
        """Add strands that cast shadows: points (S, P, 3) float32 [m], widths (S, P) float32 [m], in any chunks."""

    def finish(self, head: kernels.DistanceField | None, pose: _F64) -> None:
        """Let light through what was added and the head, which stands at `pose` (4, 4), rest -> world."""

    def shade(self, points: _F32, melanin: _F32, key: NDArray[np.uint32], eye: _F64) -> _F32:
        """Linear RGB (S, P, 3) float32 of strands (S, P, 3) with melanin (S,) and key (S,) as seen from `eye` (3,)."""

    def shade_surface(self, points: _F32, normals: _F32, albedo: _F32, eye: _F64) -> _F32:
        """Linear RGB (N, 3) float32 of points of the head (N, 3), with unit normals and linear albedo (N, 3)."""
