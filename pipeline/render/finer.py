"""A mesh with a point in the middle of every edge: shadows are told at points, and edges of heads are wider than pixels.

Of a closed mesh, only what faces the eye is drawn, and so only that is shaded.
"""

import numpy as np
from numpy.typing import NDArray

_F32 = NDArray[np.float32]
_F64 = NDArray[np.float64]

_KEPT = 4  # arrays: points, normals, colours and curvature of a head


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
        self._made: list[tuple[_F32, _F32]] = []
        self._faces: tuple[_F32, _F64, _F64] | None = None

    def __call__(self, values: _F32) -> _F32:
        """Values (V, ...) of the mesh's points and, behind them, the means at the middles of its edges.

        Of arrays that come again, as those of a stiff head do with every frame, they are kept.
        """
        for before, fine in self._made:
            if before is values:
                return fine
        begin, end = self._ends.T
        fine = np.concatenate([values, np.float32(0.5) * (values[begin] + values[end])])
        self._made = [*self._made[-_KEPT + 1 :], (values, fine)]
        return fine

    def facing(self, points: _F32, normals: _F32, eye: _F64) -> tuple[NDArray[np.intp], NDArray[np.int32]]:
        """What an eye (3,) [m] may see of the mesh with points (V, 3) [m] and normals (V, 3) that point outwards.

        Returns the numbers (N,) of the fine points, and triangles (M, 3) of these.
        """
        parts = self._parts
        if self.closed:
            if self._faces is None or self._faces[0] is not points:
                self._faces = (points, *self._planes(points, normals))
            _, across, offset = self._faces
            x, y, z = across
            parts = parts[x * eye[0] + y * eye[1] + z * eye[2] > offset]
        triangles = parts.reshape(-1, 3)
        seen = np.zeros(self._points, bool)
        seen[triangles] = True
        number = np.cumsum(seen, dtype=np.int32) - np.int32(1)
        return np.flatnonzero(seen), number[triangles]

    def _planes(self, points: _F32, normals: _F32) -> tuple[_F64, _F64]:
        """Outward normals n (3, T) of the triangles, not of unit length, and n.x (T,) of their points x."""
        a, b, c = (points[corner].astype(np.float64) for corner in self._corners.T)
        across = np.cross(b - a, c - a)
        across *= np.sign((across * normals[self._corners[:, 0]]).sum(axis=1).sum())
        return np.ascontiguousarray(across.T), (across * a).sum(axis=1)
