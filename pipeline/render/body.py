"""The head in motion as it is drawn: its skin of every frame, and where that has carried the roots of all strands."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pipeline.body.frames import BodyFrames
from pipeline.body.normals import point_normals
from pipeline.body.roots import SkinRoots
from pipeline.render.frame import Moment, Skin
from pipeline.strands.expand import MovedSkin


class DrawnBody:
    """A body under the roots (N, 3) [m] of all strands."""

    def __init__(self, body: BodyFrames, skin: Skin, roots: NDArray[np.float32]) -> None:
        self.body, self.skin = body, skin
        self._roots = SkinRoots(body.rest, body.triangles, roots, body.spacing)

    def at(self, index: int, moment: Moment) -> Moment:
        """The moment with the skin of a frame, counted from 0."""
        points = self.body.skin(index)
        field = self.body.grid.field(self.body.distance(index))
        normals = point_normals(points, self.body.triangles).astype(np.float32)
        skin = replace(self.skin, points=points, normals=normals, field=field)
        return replace(moment, skin=skin, moved=MovedSkin(self._roots.places(points), field))
