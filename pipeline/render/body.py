"""The head in motion as it is drawn: its skin of every frame."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pipeline.body.frames import BodyFrames
from pipeline.body.normals import point_normals
from pipeline.cache.expansion import MovingSkin
from pipeline.render.frame import Moment, Skin


class DrawnBody:
    """A body under the roots (N, 3) [m] of all strands."""

    def __init__(self, body: BodyFrames, skin: Skin, roots: NDArray[np.float32]) -> None:
        self.body, self.skin = body, skin
        self._moving = MovingSkin(body, roots)

    def at(self, index: float, moment: Moment) -> Moment:
        """The moment with the skin of a frame, counted from 0, or of a time between two."""
        points = self.body.skin(index)
        moved = self._moving.at(index)
        normals = point_normals(points, self.body.triangles).astype(np.float32)
        skin = replace(self.skin, points=points, normals=normals, field=moved.field)
        return replace(moment, skin=skin, moved=moved)
