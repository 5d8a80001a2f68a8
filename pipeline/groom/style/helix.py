"""A helix about every strand: offset radius (cos(th) U + flatness sin(th) V), in frames that do not turn about it.

Rotation-minimising frames by double reflection: Wang, Juettler, Zheng and Liu, "Computation of Rotation Minimizing
Frames", 2008.
"""

from dataclasses import dataclass

import numpy as np

from pipeline.groom.head.distance import smoothstep
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
    u, v = frames(points, reference)
    along = np.linspace(0, 1, points.shape[1]) * length[:, None]
    theta = coil.phase[:, None] + 2 * np.pi * along / coil.pitch[:, None]
    radius = coil.radius[:, None] * smoothstep((along - coil.onset[:, None]) / coil.ramp[:, None])
    second = radius * coil.flatness[:, None] * np.sin(theta)
    return np.asarray(points + (radius * np.cos(theta))[..., None] * u + second[..., None] * v)


def frames(points: Vectors, reference: Vectors) -> tuple[Vectors, Vectors]:
    """Rotation-minimising unit normals U and V, each (N, K, 3), started from the reference direction (N, 3)."""
    t = unit(np.gradient(points, axis=1))
    u = np.empty_like(points)
    u[:, 0] = across(reference, t[:, 0])
    for j in range(points.shape[1] - 1):
        chord = points[:, j + 1] - points[:, j]
        u_mirrored, t_mirrored = _mirror(u[:, j], chord), _mirror(t[:, j], chord)
        u[:, j + 1] = _mirror(u_mirrored, t[:, j + 1] - t_mirrored)
    return u, np.cross(t, u)


def across(reference: Vectors, t: Vectors) -> Vectors:
    """The unit part (N, 3) of reference directions across unit directions t (N, 3)."""
    return unit(reference - dot(reference, t) * t)


def _mirror(v: Vectors, normal: Vectors) -> Vectors:
    return np.asarray(v - 2 * dot(normal, v) / np.maximum(dot(normal, normal), 1e-20) * normal)
