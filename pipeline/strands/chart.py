"""The chart that partings are drawn in: Lambert's equal-area projection of the head about the crown's whorl.

The scalp is star-shaped about the chart's centre c: q = (p - c) / |p - c| in the chart's axes (e1 the head's right, e2
towards the face, w out of the whorl), (u, v) = (q1, q2) / sqrt(2 (1 + q3)). The whole head is the unit disc, and the
scalp lies within 0.9 of it; there is neither seam nor pole on it. Roots without a head are seen from above: u = x and
v = z in metres.
Source: Lambert, "Anmerkungen und Zusaetze zur Entwerfung der Land- und Himmelscharten" (1772).
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Points = NDArray[np.floating[Any]]
Vectors = NDArray[np.float64]

_BEHIND = 1e-12  # of 1 + q3: the one direction that has no place is that against the whorl


@dataclass(frozen=True)
class Chart:
    """Where points near a head lie in its chart."""

    center: Vectors
    """(3,) [m]: where the rays of chart points start."""
    axes: Vectors
    """(3, 3): rows e1, e2 and w, orthonormal; rows of zeros are the plane seen from above."""

    @staticmethod
    def from_above() -> "Chart":
        """The chart of roots without a head: u = x and v = z [m]."""
        return Chart(np.zeros(3), np.zeros((3, 3)))

    @property
    def flat(self) -> bool:
        """Whether it is that of roots without a head."""
        return not self.axes.any()

    def placed(self, scale: float, offset: Vectors) -> "Chart":
        """The chart of a head that has been scaled and then moved by `offset` (3,) [m]."""
        return Chart(self.center * scale + offset, self.axes)

    def uv(self, points: Points) -> Vectors:
        """Chart points (N, 2) of points (N, 3) [m]; each depends on its own point alone."""
        p = np.asarray(points, np.float64)
        if self.flat:
            return np.ascontiguousarray(p[:, [0, 2]])
        q = p - self.center
        e1, e2, w = (q[:, 0] * a[0] + q[:, 1] * a[1] + q[:, 2] * a[2] for a in self.axes)
        length = np.sqrt(e1 * e1 + e2 * e2 + w * w)
        half = np.sqrt(2 * np.maximum(length * (length + w), _BEHIND * length * length + 1e-300))
        return np.stack([e1 / half, e2 / half], axis=1)

    def rays(self, uv: Points) -> Vectors:
        """Unit rays (N, 3) from the centre through chart points (N, 2) of the unit disc; not of the flat chart."""
        q = np.asarray(uv, np.float64)
        r2 = (q * q).sum(axis=1)[:, None]
        return np.asarray(np.hstack([2 * q * np.sqrt(np.maximum(1 - r2, 0)), 1 - 2 * r2]) @ self.axes)
