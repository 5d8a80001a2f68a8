"""Strands of any spacing as points at equal spacing along a smooth curve through them.

The curve is the natural cubic spline over chord lengths: twice differentiable, so that it has the curvature that bending
needs, and exactly straight through two points or a straight strand. Notation: t parameter [m], h its step from point
to point, M second derivative at the points.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.strands.spacing import arc_length, at_arc_length, segments_at

Vectors = NDArray[np.float64]

_ROUNDS = 30
_EQUAL = 3e-7  # of a segment's length; two of its ends make 6e-7
_BLOCK = 512  # strands that stay in the processor's cache
_SMALLEST = 1e-12  # [m] keeps a step that does not exist from being divided by


@dataclass(frozen=True)
class SmoothCurve:
    """A curve through the points of each strand."""

    points: Vectors
    """(S, P, 3) [m]"""
    t: Vectors
    """(S, P) [m]: chord length from the root."""
    M: Vectors
    """(S, P, 3) [1/m]"""

    @classmethod
    def through(cls, points: Vectors) -> "SmoothCurve":
        """The natural cubic spline through points (S, P, 3) [m]."""
        t = arc_length(points)
        return cls(points, t, _second_derivative(points, np.maximum(np.diff(t, axis=1), _SMALLEST)))

    def at(self, t: Vectors) -> Vectors:
        """Points (S, Q, 3) [m] at parameters (S, Q) [m], ascending along each strand."""
        j = segments_at(self.t, t)
        row = np.arange(len(t))[:, None]
        h = np.maximum(self.t[row, j + 1] - self.t[row, j], _SMALLEST)[..., None]
        b = np.clip((t - self.t[row, j])[..., None] / h, 0, 1)
        a = 1 - b
        bent = (a**3 - a) * self.M[row, j] + (b**3 - b) * self.M[row, j + 1]
        return np.asarray(a * self.points[row, j] + b * self.points[row, j + 1] + h**2 / 6 * bent)


def resampled(points: Vectors, count: int) -> Vectors:
    """Points (S, P, 3) [m] as (S, count, 3) at equal spacing along the smooth curve; root and tip stay.

    Segments of a strand agree to 1e-6 of their length, unless it turns back within one segment.
    """
    blocks = [_equal_chords(points[a : a + _BLOCK], count) for a in range(0, len(points), _BLOCK)]
    return np.concatenate([np.empty((0, count, 3)), *blocks])


def _equal_chords(points: Vectors, count: int) -> Vectors:
    """Chords of equal arcs differ where a strand bends: each round moves the parameters to where they would agree."""
    curve = SmoothCurve.through(points)
    fraction = np.linspace(0, 1, count)
    t = curve.t[:, -1:] * fraction
    for _ in range(_ROUNDS):
        found = curve.at(t)
        chords = arc_length(found)
        wanted = chords[:, -1:] * fraction
        if (np.abs(chords - wanted) <= _EQUAL * wanted[:, 1:2]).all():
            break
        t = at_arc_length(t[..., None], chords, wanted)[..., 0]
    return found


def _second_derivative(x: Vectors, h: Vectors) -> Vectors:
    """M (S, P, 3), zero at both ends: h_{j-1} M_{j-1} + 2 (h_{j-1} + h_j) M_j + h_j M_{j+1} = 6 (x'_j - x'_{j-1})."""
    slope = np.diff(x, axis=1) / h[..., None]
    M = np.zeros_like(x)
    count = x.shape[1]
    ratio = np.zeros(x.shape[:2])
    for j in range(1, count - 1):  # eliminate downwards
        pivot = 2 * (h[:, j - 1] + h[:, j]) - h[:, j - 1] * ratio[:, j - 1]
        ratio[:, j] = h[:, j] / pivot
        M[:, j] = (6 * (slope[:, j] - slope[:, j - 1]) - h[:, j - 1, None] * M[:, j - 1]) / pivot[:, None]
    for j in range(count - 3, 0, -1):  # substitute back
        M[:, j] -= ratio[:, j, None] * M[:, j + 1]
    return M
