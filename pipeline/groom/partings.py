"""The parting: a line on the skull from the hairline to the crown that hair flows away from."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.config.schema import Parting
from pipeline.groom.head.distance import smoothstep
from pipeline.groom.head_field import Field

Points = NDArray[np.floating[Any]]

_FRONT, _BACK = 0.10, -0.045  # [m] its ends, in z
_FADE_FROM, _FADE_OVER = -0.08, 0.09  # [m] an off-centre parting bends to the middle towards the back
_POINTS = 60
_APART = 3e-3  # [m] strands on the parting fall to their side as if they stood this far from it
_APART_FROM = 0.03  # [m] but not at its end on the crown
_CROWDING, _CROWDED = 0.7, 0.015  # more roots at the parting than elsewhere, over this distance [m]
_SWIRL, _SWIRLED = 1.1, 0.018  # [rad], [m]


class PartingLine:
    """The parting on a head, in fitted coordinates."""

    def __init__(self, parting: Parting, skin: Field) -> None:
        self.offset = parting.offset
        self._z = np.linspace(_BACK, _FRONT, _POINTS)
        line = np.stack([self._x(self._z), np.full(_POINTS, 0.16), self._z], axis=1)
        for _ in range(30):  # lower it onto the skin
            line[:, 1] -= skin.distance(line)
        self._y = line[:, 1]

    def side(self, p: Points) -> NDArray[np.int8]:
        """+1 for points to the left of the parting, -1 for those to its right."""
        return np.where(p[:, 0] > self._x(p[:, 2]), 1, -1).astype(np.int8)

    def away(self, p: Points, side: NDArray[np.int8]) -> NDArray[np.float64]:
        """Unit vectors from the parting's point beside each p, for strands that keep to their side of it."""
        z = np.clip(p[:, 2], _BACK, _FRONT)
        v = p - np.stack([self._x(z), np.interp(z, self._z, self._y), z], axis=1)
        apart = side * np.maximum(side * v[:, 0], _APART)
        v[:, 0] += smoothstep((p[:, 2] - _BACK) / _APART_FROM) * (apart - v[:, 0])
        return np.asarray(v / np.linalg.norm(v, axis=1, keepdims=True))

    def crowding(self, p: Points) -> NDArray[np.float64]:
        """Density of roots, 1 but for more beside the parting: hair flows away from it, and none lies over it."""
        return np.asarray(1 + _CROWDING * (1 - smoothstep(self.distance(p) / _CROWDED)))

    def swirl(self, p: Points) -> NDArray[np.float64]:
        """Angle [rad] by which the flow turns about the parting's end on the crown: hair crosses there and covers it."""
        to_end = np.hypot(p[:, 0] - self._x(np.array([_BACK])), p[:, 2] - _BACK)
        return np.asarray(_SWIRL * np.exp(-((to_end / _SWIRLED) ** 2)))

    def distance(self, p: Points) -> NDArray[np.float64]:
        """Distance (N,) [m] of points (N, 3) from the parting, seen from above."""
        z = np.clip(p[:, 2], _BACK, _FRONT)
        return np.asarray(np.hypot(p[:, 0] - self._x(z), p[:, 2] - z))

    def _x(self, z: Points) -> NDArray[np.float64]:
        return np.asarray(self.offset * smoothstep((z - _FADE_FROM) / _FADE_OVER))
