"""Where a picture is taken from."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.body.placement import Placement
from pipeline.config.schema import Camera

Place = NDArray[np.float64]

_POSITION, _LOOK_AT = (
    (0.40, 0.02, 0.80),
    (0.0, -0.03, 0.0),
)  # [m] from the built-in head, unless they are told


@dataclass(frozen=True)
class View:
    """A camera in the world."""

    position: Place
    """(3,) [m]"""
    look_at: Place
    """(3,) [m]: the middle of the picture."""
    up: tuple[float, float, float]
    field_of_view: float
    """Vertical [rad]."""

    @classmethod
    def of(cls, camera: Camera, head: Placement) -> "View":
        """A camera's view; what its options leave open follows from where the head stands."""
        told = zip((camera.position, camera.look_at), (_POSITION, _LOOK_AT), strict=True)
        position, look_at = (head.world(usual) if place is None else np.array(place) for place, usual in told)
        return cls(position, look_at, camera.up, camera.field_of_view)
