"""The expansion that an experiment's caches describe, for whoever draws or exports its strands."""

import numpy as np
from numpy.typing import NDArray

from pipeline import kernels
from pipeline.body.frames import BodyFrames
from pipeline.body.placement import Placement
from pipeline.body.roots import SkinRoots
from pipeline.cache.store import Reader
from pipeline.config import Config
from pipeline.strands.expand import Binding, Expansion, MovedSkin, Style


def expansion_from(groom: Reader, strands: Reader, config: Config) -> Expansion:
    """All strands of strands.h5 at rest on the groom of groom.h5; raises Damaged.

    Holds the rest shapes that some strand takes and the binding: 12 P bytes for each groom strand and about 60
    for each strand.
    """
    columns = ("parent", "root", "guide", "weight", "key", "scale", "phase")
    binding = Binding(**{name: strands[f"strands/{name}"][:] for name in columns})
    shapes = int(binding.parent.max()) + 1 if len(binding) else 0
    options = config.interpolate
    return Expansion(
        rest=groom["strands/points"][:shapes],
        guide_rest=groom["strands/points"][groom["guides/strand"][:]],
        binding=binding,
        field=distance_field(groom),
        style=Style(options.skin, options.variation.clump, options.variation.frizz),
    )


def distance_field(groom: Reader) -> kernels.DistanceField | None:
    """Distance to the head of groom.h5, in its rest frame; None where there is no head."""
    if "head/distance" not in groom:
        return None
    values, origin = groom["head/distance"][:], groom["head/origin"][:]
    return kernels.DistanceField(values, np.asarray(origin, np.float64), float(groom["head/spacing"][0]))


def placement(groom: Reader) -> Placement:
    """Where the head of groom.h5 stands; without one, where the built-in head would."""
    if "head/placement" not in groom:
        return Placement()
    scale, *offset = groom["head/placement"][:].tolist()
    return Placement(scale, (offset[0], offset[1], offset[2]))


def body_frames(groom: Reader) -> BodyFrames | None:
    """The head in motion of groom.h5; None where it is rigid."""
    if "body/points" not in groom:
        return None
    return BodyFrames(
        rest=groom["head/points"][:],
        triangles=groom["head/triangles"][:],
        points=groom["body/points"][:],
        poses=groom["body/pose"][:],
        spacing=float(groom["head/spacing"][0]),
    )


class MovingSkin:
    """A head in motion under the roots (N, 3) [m] of all strands."""

    def __init__(self, body: BodyFrames, roots: NDArray[np.float32]) -> None:
        self.body = body
        self._roots = SkinRoots(body.rest, body.triangles, roots, body.spacing)

    def at(self, index: float) -> MovedSkin:
        """The skin of a frame, counted from 0, or of a time between two, and where it has carried the roots."""
        return MovedSkin(
            self._roots.places(self.body.skin(index)), self.body.grid.field(self.body.distance(index))
        )
