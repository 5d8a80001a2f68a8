"""A mesh with a point in the middle of every edge: shadows are told at points, and edges of heads are wider than pixels."""

import numpy as np
from numpy.typing import NDArray

_F32 = NDArray[np.float32]


class Finer:
    """Every triangle as four; made once of the triangles (T, 3) of a mesh of `count` points."""

    def __init__(self, triangles: NDArray[np.int32], count: int) -> None:
        """Find the edges: each has one middle, whichever triangles share it."""
        corners = np.asarray(triangles, np.int64)
        ends = np.sort(np.stack([corners, np.roll(corners, -1, axis=1)], axis=-1), axis=-1).reshape(-1, 2)
        _, first, middle = np.unique(ends[:, 0] * count + ends[:, 1], return_index=True, return_inverse=True)
        self._ends = ends[first]
        a, b, c = corners.T
        ab, bc, ca = (count + middle.reshape(-1, 3)).T
        parts = [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        self.triangles = np.ascontiguousarray(np.concatenate([np.stack(p, axis=1) for p in parts]), np.int32)
        """(4 T, 3)"""

    def __call__(self, values: _F32) -> _F32:
        """Values (V, ...) of the mesh's points and, behind them, the means at the middles of its edges."""
        begin, end = self._ends.T
        return np.concatenate([values, np.float32(0.5) * (values[begin] + values[end])])
