"""Smooth curves through keyframes that rest at both ends and never go past a keyframe.

Velocities at keyframes are the harmonic means of Fritsch & Butland ("A Method for Constructing Local Monotone Piecewise
Cubic Interpolants", 1984), for vectors; between keyframes the curve is Hermite's cubic.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]


def harmonic(rate: Vector, length: Vector) -> Vector:
    """Velocities (K-2, n) at inner keyframes between pieces of these rates (K-1, n) and lengths (K-1, 1)."""
    a, b, h, k = rate[:-1], rate[1:], length[:-1], length[1:]
    mean = (2 * k + h) * b + (k + 2 * h) * a
    along = np.maximum((a * b).sum(axis=1, keepdims=True), 0)
    return np.asarray(3 * (h + k) * along * mean / np.maximum((mean**2).sum(axis=1, keepdims=True), 1e-300))


def keyed(times: Vector, values: Vector) -> Callable[[float], Vector]:
    """The value (n,) at a time of the curve through values (K, n) at ascending times (K,); held outside of them."""
    if len(times) == 1:
        return lambda _: values[0]
    length = np.diff(times)[:, None]
    velocity = np.zeros_like(values)
    velocity[1:-1] = harmonic(np.diff(values, axis=0) / length, length)

    def at(time: float) -> Vector:
        time = min(max(time, float(times[0])), float(times[-1]))
        i = min(int(np.searchsorted(times, time, side="right")), len(times) - 1) - 1
        h = float(times[i + 1] - times[i])
        u = (time - float(times[i])) / h
        to, on = u * u * (3 - 2 * u), u * (1 - u)
        ends = (1 - to) * values[i] + to * values[i + 1]
        return np.asarray(ends + h * on * ((1 - u) * velocity[i] - u * velocity[i + 1]))

    return at
