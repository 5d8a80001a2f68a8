"""A helix about every strand: offset radius (cos(th) U + flatness sin(th) V), in frames that do not turn about it.

Rotation-minimising frames by double reflection: Wang, Juettler, Zheng and Liu, "Computation of Rotation Minimizing
Frames", 2008.
"""

from dataclasses import dataclass

import numpy as np

from pipeline import kernels
from pipeline.groom.style.hair import Vectors, dot, unit


@dataclass(frozen=True)
class Coil:
    """A helix for each strand; each (N,)."""

    radius: Vectors
    """[m]"""
    pitch: Vectors
    """[m] of arc length a turn."""
    phase: Vectors
    """[rad] at the root."""
    flatness: Vectors
    """Second axis over the first; its sign is the handedness."""
    onset: Vectors
    """[m]"""
    ramp: Vectors
    """[m] over which the radius is reached."""


def coiled(points: Vectors, length: Vectors, reference: Vectors, coil: Coil) -> Vectors:
    """Points (N, K, 3) [m] wound about strands of `length` (N,) whose frames start from `reference` (N, 3)."""
    c = coil
    rows = np.stack([c.radius, c.pitch, c.phase / (2 * np.pi), c.flatness, c.onset, c.ramp], axis=1)
    return kernels.coiled(points, reference, length, rows)


def across(reference: Vectors, t: Vectors) -> Vectors:
    """The unit part (N, 3) of reference directions across unit directions t (N, 3)."""
    return unit(reference - dot(reference, t) * t)
