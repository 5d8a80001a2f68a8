"""A mesh with a point in the middle of every edge: shadows are told at points, and edges of heads are wider than pixels.

Of a closed mesh, only what faces the eye is drawn, and so only that is shaded.
"""

import numpy as np
from numpy.typing import NDArray

_F32 = NDArray[np.float32]
_F64 = NDArray[np.float64]


class Finer:
    """Every triangle as four; made once of the triangles (T, 3) of a mesh of `count` points."""

    def __init__(self, triangles: NDArray[np.int32], count: int) -> None:
        """Find the edges: each has one middle, whichever triangles share it."""
        corners = np.asarray(triangles, np.int64)
        both = np.stack([corners, np.roll(corners, -1, axis=1)], axis=-1).reshape(-1, 2)
        ends = np.sort(both, axis=-1)
        names = ends[:, 0] * count + ends[:, 1]
        _, first, middle, uses = np.unique(names, return_index=True, return_inverse=True, return_counts=True)
        turns = np.bincount(middle, np.where(both[:, 0] < both[:, 1], 1, -1))
        self.closed = bool((uses == 2).all() and (turns == 0).all())
        """Whether every edge has two triangles, which go along it either way: then no back is ever seen."""
        self._corners, self._ends = corners, ends[first]
        a, b, c = corners.T
        ab, bc, ca = (count + middle.reshape(-1, 3)).T
        parts = [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        self._parts = np.stack([np.stack(part, axis=1) for part in parts], axis=1).astype(np.int32)
        self._points = count + len(first)

    def __call__(self, values: _F32) -> _F32:
        """Values (V, ...) of the mesh's points and, behind them, the means at the middles of its edges."""
        begin, end = self._ends.T
        return np.concatenate([values, np.float32(0.5) * (values[begin] + values[end])])

    def facing(self, points: _F32, normals: _F32, eye: _F64) -> tuple[NDArray[np.intp], NDArray[np.int32]]:
        """What an eye (3,) [m] may see of the mesh with points (V, 3) [m] and normals (V, 3) that point outwards.

        Returns the numbers (N,) of the fine points, and triangles (M, 3) of these.
        """
        parts = self._parts
        if self.closed:
            a, b, c = (points[corner].astype(np.float64) for corner in self._corners.T)
            across = np.cross(b - a, c - a)
            outward = np.sign((across * normals[self._corners[:, 0]]).sum(axis=1).sum())
            parts = parts[outward * (across * (eye - a)).sum(axis=1) > 0]
        triangles = parts.reshape(-1, 3)
        seen = np.zeros(self._points, bool)
        seen[triangles] = True
        number = np.cumsum(seen, dtype=np.int32) - np.int32(1)
        return np.flatnonzero(seen), number[triangles]
