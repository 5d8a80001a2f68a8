"""Where a picture is taken from, and through which point of the lens.

A lens of diameter A that is sharp at the distance D along the line of sight shows a point at distance d as a disc of
A |1 - D/d| across, measured in the plane of sharpness. Pictures through points of the lens, each with its frustum
sheared so that this plane stays where it is, add up to that: Haeberli & Akeley, "The Accumulation Buffer: Hardware
Support for High-Quality Rendering" (1990).
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

Place = NDArray[np.float64]


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
    aperture: float = 0.0
    """Diameter of the lens [m]; 0 is a pinhole."""
    focus: float = 1.0
    """Distance along the line of sight that is sharp [m]."""
    shift: tuple[float, float] = (0.0, 0.0)
    """Slopes to the right and up by which the frustum is sheared."""

    def through(self, x: float, y: float) -> "View":
        """The view through a point of the lens, of a unit disc: what is in the plane of sharpness stays where it is."""
        right, up = self.across()
        dx, dy = self.aperture / 2 * x, self.aperture / 2 * y
        move = dx * right + dy * up
        shift = -dx / self.focus, -dy / self.focus
        return replace(self, position=self.position + move, look_at=self.look_at + move, shift=shift)

    def ahead(self) -> Place:
        """The unit direction (3,) of the line of sight."""
        way = self.look_at - self.position
        return np.asarray(way / np.linalg.norm(way))

    def across(self) -> tuple[Place, Place]:
        """The unit directions (3,) that are to the right and up in the picture."""
        ahead = self.ahead()
        right = np.cross(ahead, np.array(self.up))
        right /= np.linalg.norm(right)
        return right, np.cross(right, ahead)
