"""numpy twin of equal spacing: points of a strand at equal spacing along the smooth curve through them.

The curve is the natural cubic spline over chord lengths: twice differentiable, so that it has the curvature that
bending needs, and exactly straight through two points or a straight strand. Notation: t parameter [m], h its step
from point to point, M second derivative at the points.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.strands.spacing import arc_length

Vectors = NDArray[np.float64]

_ROUNDS = 30
_EQUAL = 3e-7  # of a segment's length; two of its ends make 6e-7
_BLOCK = 256  # strands that stay in the processor's cache
_SMALLEST = 1e-12  # [m] keeps a step that does not exist from being divided by


@dataclass(frozen=True)
class SmoothCurve:
    """A curve through the points of each strand: on each segment a cubic in u, the parameter from its start."""

    t: Vectors
    """(S, P) [m]: chord length from the root."""
    cubic: Vectors
    """(S, P-1, 4, 3): coefficients of 1, u, u^2, u^3."""

    @classmethod
    def through(cls, x: Vectors) -> "SmoothCurve":
        """The natural cubic spline through points (S, P, 3) [m]."""
        t = arc_length(x)
        h = np.maximum(np.diff(t, axis=1), _SMALLEST)[..., None]
        slope = np.diff(x, axis=1) / h
        M = _second_derivative(slope, h)
        start, end = M[:, :-1], M[:, 1:]
        cubic = [x[:, :-1], slope - h / 6 * (2 * start + end), start / 2, (end - start) / (6 * h)]
        return cls(t, np.stack(cubic, axis=2))

    def of(self, strands: NDArray[np.int64]) -> "SmoothCurve":
        """The curves of some of the strands."""
        return SmoothCurve(self.t[strands], self.cubic[strands])

    def at(self, t: Vectors) -> Vectors:
        """Points (S, Q, 3) [m] at parameters (S, Q) [m], ascending along each strand."""
        segment = segments_at(self.t, t)
        row = np.arange(len(t))[:, None]
        u = (t - self.t[row, segment])[..., None]
        c = self.cubic[row, segment]
        return np.asarray(c[:, :, 0] + u * (c[:, :, 1] + u * (c[:, :, 2] + u * c[:, :, 3])))


def resampled(points: Vectors, count: int) -> Vectors:
    """Points (S, P, 3) [m] as (S, count, 3) at equal spacing along the smooth curve; root and tip stay.

    Segments of a strand agree to 1e-6 of their length, unless it turns back within one segment.
    """
    blocks = [_equal_chords(points[a : a + _BLOCK], count) for a in range(0, len(points), _BLOCK)]
    return np.concatenate([np.empty((0, count, 3)), *blocks])


def _equal_chords(points: Vectors, count: int) -> Vectors:
    """Chords of equal arcs differ where a strand bends: rounds move the parameters to where they agree."""
    curve = SmoothCurve.through(points)
    fraction = np.linspace(0, 1, count)
    t = np.asarray(curve.t[:, -1:] * fraction)
    found = curve.at(t)
    left = np.arange(len(points))
    for _ in range(_ROUNDS):
        chords = arc_length(found[left])
        wanted = chords[:, -1:] * fraction
        unequal = (np.abs(chords - wanted) > _EQUAL * wanted[:, 1:2]).any(axis=1)
        left, chords, wanted = left[unequal], chords[unequal], wanted[unequal]
        if not len(left):
            break
        t[left] = at_arc_length(t[left, :, None], chords, wanted)[..., 0]
        found[left] = curve.of(left).at(t[left])
    return found


def _second_derivative(slope: Vectors, h: Vectors) -> Vectors:
    """M (S, P, 3) [1/m], zero at both ends, of a curve with slopes that agree at the points.

    h_{j-1} M_{j-1} + 2 (h_{j-1} + h_j) M_j + h_j M_{j+1} = 6 (slope_j - slope_{j-1})
    """
    strands, segments, _ = slope.shape
    M = np.zeros((strands, segments + 1, 3))
    ratio = np.zeros((strands, segments, 1))
    for j in range(1, segments):  # eliminate downwards
        pivot = 2 * (h[:, j - 1] + h[:, j]) - h[:, j - 1] * ratio[:, j - 1]
        ratio[:, j] = h[:, j] / pivot
        M[:, j] = (6 * (slope[:, j] - slope[:, j - 1]) - h[:, j - 1] * M[:, j - 1]) / pivot
    for j in range(segments - 1, 0, -1):  # substitute back
        M[:, j] -= ratio[:, j] * M[:, j + 1]
    return M


def segments_at(lengths: NDArray[np.float64], wanted: NDArray[np.float64]) -> NDArray[np.int64]:
    """Segment (S, Q) of each strand that holds the wanted arc lengths (S, Q) [m], by `arc_length(points)`."""
    strands, count = lengths.shape
    row = np.arange(strands)[:, None]
    whole = np.maximum(lengths[:, -1:], 1e-300)
    # In a row, so that one search serves all
    along, sought = (2 * row + at / whole for at in (lengths, wanted))
    left = np.searchsorted(along.ravel(), sought.ravel(), "right").reshape(wanted.shape) - 1 - row * count
    return np.asarray(np.clip(left, 0, count - 2))


def at_arc_length(points: Vectors, lengths: NDArray[np.float64], wanted: NDArray[np.float64]) -> Vectors:
    """Vectors (S, Q, 3) on the polylines at arc lengths (S, Q) [m], clamped to their ends.

    `lengths` is `arc_length(points)`; root and tip stay where they are. Whatever else is given at the points, as
    (S, P, K), is interpolated in the same way.
    """
    wanted = np.clip(wanted, 0, lengths[:, -1:])
    left = segments_at(lengths, wanted) + np.arange(len(lengths))[:, None] * lengths.shape[1]
    flat = lengths.ravel()
    span = np.maximum(flat[left + 1] - flat[left], 1e-12)
    weight = np.clip((wanted - flat[left]) / span, 0, 1)[..., None]
    p = points.reshape(-1, points.shape[2])
    return np.asarray(p[left] * (1 - weight) + p[left + 1] * weight)
