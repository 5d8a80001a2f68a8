"""Where a skin that deforms carries the roots of strands.

A root is bound to the point of the mesh that is nearest to it at rest, by triangle and barycentric weights. Its frame
turns as the skin around it does: at every corner of the triangle the rotation that best takes the edges around the
corner, and the normal there, from rest to now (Kabsch, "A Solution for the Best Rotation to Relate Two Sets of Vectors",
1976; edges as in Sorkine & Alexa, "As-Rigid-As-Possible Surface Modeling", 2007), blended by the weights. The root keeps
its place over its foot in that frame, so that a skin that moves rigidly carries roots rigidly.
"""

import numpy as np
from numpy.typing import NDArray

from pipeline.body.distance import Grid
from pipeline.body.normals import point_normals

Vectors = NDArray[np.float64]
Indices = NDArray[np.int64]


class SkinRoots:
    """Roots (N, 3) [m] on a mesh at rest."""

    def __init__(
        self,
        rest: NDArray[np.floating],
        triangles: NDArray[np.integer],
        roots: NDArray[np.floating],
        spacing: float,
    ) -> None:
        """Bind roots to a mesh, points (V, 3) [m] and triangles (T, 3); `spacing` [m] of the grid that finds them."""
        self.roots = np.ascontiguousarray(roots, np.float64)
        self.rest: Vectors = np.asarray(rest, np.float64)
        self._triangles: Indices = np.asarray(triangles, np.int64)
        found, weight = Grid.around(self.rest, spacing).measure(self.rest, triangles).feet(self.roots)
        self.corner, self.weight = self._triangles[found], np.asarray(weight, np.float64)
        self._points = np.unique(self.corner)  # whose rotations are needed
        self._at = np.searchsorted(self._points, self.corner)
        self._ring = _edges_of(self._triangles, self._points)
        self._foot = self._blend(self.rest[self.corner])
        self._normals = self._corner_normals(self.rest)

    def poses(self, now: NDArray[np.floating]) -> Vectors:
        """The rigid map (N, 4, 4) of every root from rest to a pose of the mesh (V, 3) [m]."""
        points: Vectors = np.asarray(now, np.float64)
        u, _, vt = np.linalg.svd(self._blend(self._rotations(points)[self._at]))
        rotation = u @ vt
        foot = self._blend(points[self.corner])
        poses = np.zeros((len(rotation), 4, 4))
        poses[:, :3, :3], poses[:, 3, 3] = rotation, 1
        poses[:, :3, 3] = foot - np.einsum("nij,nj->ni", rotation, self._foot)
        return poses

    def places(self, now: NDArray[np.floating]) -> NDArray[np.float32]:
        """Where the roots (N, 3) float32 [m] are at a pose of the mesh (V, 3) [m]."""
        points: Vectors = np.asarray(now, np.float64)
        rotation = self._blend(self._rotations(points)[self._at])
        above = np.einsum("nij,nj->ni", rotation, self.roots - self._foot)
        return np.asarray(self._blend(points[self.corner]) + above, np.float32)

    def _blend(self, at_corners: Vectors) -> Vectors:
        """Values at corners (N, 3, ...), blended by the weights: (N, ...)."""
        return np.asarray(np.einsum("nk,nk...->n...", self.weight, at_corners))

    def _rotations(self, now: Vectors) -> Vectors:
        """The rotation (K, 3, 3) of the skin around each point that is needed."""
        owner, begin, end = self._ring
        before, after = self.rest[end] - self.rest[begin], now[end] - now[begin]
        length = np.linalg.norm(before, axis=1, keepdims=True)
        outer = (after / length)[:, :, None] * (before / length)[:, None, :]
        sums = [np.bincount(owner, part, len(self._points)) for part in outer.reshape(-1, 9).T]
        normals = self._corner_normals(now)[:, :, None] * self._normals[:, None, :]
        u, _, vt = np.linalg.svd(np.stack(sums, axis=1).reshape(-1, 3, 3) + normals)
        u[:, :, 2] *= np.sign(np.linalg.det(u @ vt))[:, None]
        return np.asarray(u @ vt)

    def _corner_normals(self, points: Vectors) -> Vectors:
        """Unit normals (K, 3) at the points that are needed."""
        return point_normals(points, self._triangles)[self._points]


def _edges_of(triangles: Indices, points: Indices) -> tuple[Indices, Indices, Indices]:
    """Edges that begin at some points: index of the point among them, begin and end (E,)."""
    begin = triangles.ravel()
    end = np.roll(triangles, -1, axis=1).ravel()  # in a closed mesh every edge leaves both of its ends once
    kept = np.isin(begin, points)
    begin, end = begin[kept], end[kept]
    return np.searchsorted(points, begin), begin, end


def rigid_part(rest: NDArray[np.floating], now: NDArray[np.floating]) -> Vectors:
    """The rigid map (4, 4) that best takes points (V, 3) from rest to now (Kabsch, 1976)."""
    before, after = np.asarray(rest, np.float64), np.asarray(now, np.float64)
    middle, there = before.mean(axis=0), after.mean(axis=0)
    u, _, vt = np.linalg.svd((after - there).T @ (before - middle))
    u[:, 2] *= np.sign(np.linalg.det(u @ vt))
    pose = np.eye(4)
    pose[:3, :3] = u @ vt
    pose[:3, 3] = there - pose[:3, :3] @ middle
    return pose
