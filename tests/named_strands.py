"""Strands by name, (P, 3) float64 [m], root first, at equal spacing."""

import numpy as np
from numpy.typing import NDArray

Points = NDArray[np.float64]


def helix(radius: float, pitch: float, length: float, points: int) -> Points:
    """A helix about x with exactly equal chords; curvature and torsion are those of its smooth curve."""
    rise = pitch / (2 * np.pi)
    angle = np.linspace(0, length, points) / np.hypot(radius, rise)
    return np.stack([rise * angle, radius * np.cos(angle) - radius, radius * np.sin(angle)], axis=-1)
