"""The skin under the guides where the head deforms: its distance, how it drifts, and a frame for every root.

Between two frames the distance is the linear blend of theirs (deformation.hpp), and roots go on smooth curves through
the frames (screws.py), so that their velocity does not jump from frame to frame.
"""

from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from pipeline import kernels
from pipeline.body.frames import BodyFrames
from pipeline.body.roots import SkinRoots
from pipeline.simulate.motion import HeadMotion, Poses
from pipeline.simulate.screws import Pose, curve_of_track

_KEPT = 5  # frames that are remembered: those around the present one
T = TypeVar("T")


@dataclass(frozen=True)
class SkinSteps:
    """The skin during some steps: what `kernels.advance` and `kernels.Drive` take."""

    field: kernels.DistanceField
    roots: NDArray[np.float64]
    """(n+1, G, 3, 4)"""
    deformation: kernels.Deformation | None = None
    blend: NDArray[np.float64] | None = None
    """(n+1,)"""


class MovingSkin:
    """The skin of a body under roots (G, 3) [m]."""

    def __init__(self, body: BodyFrames, roots: NDArray[np.floating], fps: float) -> None:
        self.body, self.fps = body, fps
        self._roots = SkinRoots(body.rest, body.triangles, roots, body.spacing)
        self._memory: OrderedDict[tuple[str, int], object] = OrderedDict()

    def root_poses(self, index: int) -> Pose:
        """The rigid map (G, 4, 4) of each root from rest to a frame, in the head's rest frame."""
        return self._kept("roots", index, lambda: self._roots.poses(self.body.skin(index)))

    def during(self, frame: float, parts: NDArray[np.float64]) -> SkinSteps:
        """The skin at `frame` + parts (n+1,) [frames], all of them between two frames; it stands still before the first."""
        k, last = int(np.floor(frame)), len(self.body) - 1
        if k < 0 or k >= last:
            k = min(max(k, 0), last)
            still = np.broadcast_to(self.root_poses(k)[:, :3], (len(parts), len(self._roots.roots), 3, 4))
            return SkinSteps(self._field(k), np.ascontiguousarray(still))
        blend = frame - k + parts
        around = np.arange(max(k - 1, 0), min(k + 2, last) + 1)
        curve = curve_of_track(around / self.fps, np.stack([self.root_poses(int(i)) for i in around]))
        roots = np.stack([curve((k + part) / self.fps)[:, :3] for part in blend])
        return SkinSteps(self._field(k), roots, self._deformation(k), np.ascontiguousarray(blend))

    def moved(self, head: HeadMotion) -> HeadMotion:
        """The motion of the head with that of its meshes in it."""
        curve = curve_of_track(np.arange(len(self.body)) / self.fps, self.body.poses)

        def with_meshes(piece: Poses, time: float) -> Pose:
            return np.asarray(piece(time) @ curve(max(time, 0.0)))

        return HeadMotion(head.starts, tuple(partial(with_meshes, piece) for piece in head.pieces))

    def _distance(self, index: int) -> kernels.MeshDistance:
        return self._kept("distance", index, lambda: self.body.distance(index))

    def _field(self, index: int) -> kernels.DistanceField:
        return self._kept("field", index, lambda: self.body.grid.field(self._distance(index)))

    def _deformation(self, index: int) -> kernels.Deformation:
        def make() -> kernels.Deformation:
            after = np.ascontiguousarray(self.body.skin(index + 1), np.float64)
            drift = self._distance(index).drift(after)
            return kernels.Deformation(self._field(index), self._distance(index + 1).values, drift)

        return self._kept("deformation", index, make)

    def _kept(self, kind: str, index: int, make: Callable[[], T]) -> T:
        """What was made last of this kind for a frame, or makes it."""
        key = (kind, index)
        if key not in self._memory:
            self._memory[key] = make()
            of_kind = [other for other in self._memory if other[0] == kind]
            if len(of_kind) > (_KEPT if kind == "roots" else 2):
                del self._memory[of_kind[0]]
        found: T = self._memory[key]  # type: ignore[assignment]
        return found
