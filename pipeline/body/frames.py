"""The head in motion: a skin for every frame, in the head's rest frame, and the pose of that frame."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pipeline import kernels
from pipeline.body.distance import Grid


@dataclass(frozen=True)
class BodyFrames:
    """F frames of a mesh; the first is held before it, the last after it."""

    rest: NDArray[np.float32]
    """(V, 3) [m]: points in the rest pose."""
    triangles: NDArray[np.int32]
    """(T, 3)"""
    points: NDArray[np.float32]
    """(F, V, 3) [m]: in the head's rest frame."""
    poses: NDArray[np.float64]
    """(F, 4, 4): the head's rest frame -> world, before any other motion of the head."""
    spacing: float
    """[m] of the distance grids."""

    def __len__(self) -> int:
        return len(self.points)

    @cached_property
    def grid(self) -> Grid:
        """One grid around the skins of all frames."""
        return Grid.around(
            np.stack([self.points.min(axis=(0, 1)), self.points.max(axis=(0, 1))]), self.spacing
        )

    def skin(self, index: float) -> NDArray[np.float32]:
        """Points (V, 3) [m] of a frame, counted from 0; on straight lines between frames."""
        at = min(max(index, 0), len(self) - 1)
        first, part = int(at), np.float32(at % 1)
        if part == 0:
            return np.asarray(self.points[first])
        return np.asarray((1 - part) * self.points[first] + part * self.points[first + 1])

    def distance(self, index: float) -> kernels.MeshDistance:
        """Distance to the skin of a frame, counted from 0."""
        return self.grid.measure(self.skin(index), self.triangles)
