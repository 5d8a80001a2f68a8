"""Waves, curls and frizz on top of smooth strands.

A curl is a helix about the strand: offset A (cos(th) U + flatness hand sin(th) V) in rotation-minimising frames
(double reflection: Wang, Juettler, Zheng and Liu, "Computation of Rotation Minimizing Frames", 2008).
Phase, pitch and handedness belong to the lock, so that neighbours curl together.
"""

import numpy as np
from numpy.typing import NDArray

from pipeline.config.schema import Curl, Frizz
from pipeline.groom.head.distance import smoothstep
from pipeline.strands.random import normal, uniform

Vectors = NDArray[np.float64]

_OWN_PITCH = 0.008  # a strand's pitch within its lock: more would spoil the lock's last turns
_WAVELENGTHS, _AMPLITUDES = (0.012, 0.03, 0.07), (0.25, 0.5, 1.0)  # [m] of the frizz, and their shares


def curled(
    curl: Curl,
    seed: int,
    index: NDArray[np.int64],
    lock: NDArray[np.int64],
    points: Vectors,
    along: Vectors,
    reference: Vectors,
) -> Vectors:
    """Points (N, P, 3) with the curl added; `along` (N, P) [m] arc length, `reference` (N, 3) the frames' start."""
    if curl.radius == 0:
        return points
    u, v = frames(points, reference)
    spread = 2 * uniform(seed, lock, 80) - 1
    pitch = curl.pitch * (1 + curl.pitch_jitter * spread) * (1 + 0.04 * normal(seed, index, 81))
    phase = 2 * np.pi * curl.phase_spread * uniform(seed, lock, 82) + curl.phase_jitter * normal(
        seed, index, 83
    )
    hand = np.where(uniform(seed, lock, 84) < 0.5, -1.0, 1.0)
    radius = curl.radius * np.clip(1 + curl.radius_jitter * normal(seed, lock, 85), 0.5, 1.5)
    radius = radius * (0.85 + 0.3 * uniform(seed, index, 86))
    theta = phase[:, None] + 2 * np.pi * along / pitch[:, None]
    amplitude = radius[:, None] * smoothstep((along - curl.onset) / curl.ramp)
    round_part = (curl.flatness * hand)[:, None] * np.sin(theta)
    return points + (amplitude * np.cos(theta))[..., None] * u + (amplitude * round_part)[..., None] * v


def frizzed(
    frizz: Frizz,
    seed: int,
    index: NDArray[np.int64],
    flyaway: NDArray[np.bool_],
    points: Vectors,
    along: Vectors,
) -> Vectors:
    """Points (N, P, 3) with three smooth sines of random direction added, growing over the first 5 cm."""
    if frizz.amplitude == 0:
        return points
    noise = np.zeros_like(points)
    for k, (wavelength, share) in enumerate(zip(_WAVELENGTHS, _AMPLITUDES, strict=True)):
        period = wavelength * (0.7 + 0.6 * uniform(seed, index, 91 + k))
        phase = uniform(seed, index, 95 + k)
        direction = np.stack([normal(seed, index, 100 + 3 * k + j) for j in range(3)], axis=1)
        wave = np.sin(2 * np.pi * (along / period[:, None] + phase[:, None]))
        noise += share * direction[:, None] * wave[..., None]
    amplitude = frizz.amplitude * np.where(flyaway, 3.0, 1.0) * (0.5 + uniform(seed, index, 90))
    return points + (amplitude[:, None] * smoothstep(along / 0.05))[..., None] * noise


def _turned(u: Vectors, v: Vectors, angle: Vectors) -> tuple[Vectors, Vectors]:
    """Frames (N, P, 3) turned about the strand by an angle (N,) [rad]: a wave swings sideways as well as outwards."""
    c, s = np.cos(angle)[:, None, None], np.sin(angle)[:, None, None]
    return c * u + s * v, c * v - s * u


def frames(points: Vectors, reference: Vectors) -> tuple[Vectors, Vectors]:
    """Rotation-minimising unit normals U and V, each (N, P, 3), started from the reference direction (N, 3)."""
    t = np.gradient(points, axis=1)
    t /= np.maximum(np.linalg.norm(t, axis=2, keepdims=True), 1e-12)
    u = np.empty_like(points)
    start = reference - _dot(reference, t[:, 0]) * t[:, 0]
    u[:, 0] = start / np.maximum(np.linalg.norm(start, axis=1, keepdims=True), 1e-12)
    for j in range(points.shape[1] - 1):
        chord = points[:, j + 1] - points[:, j]
        u_mirrored, t_mirrored = _mirror(u[:, j], chord), _mirror(t[:, j], chord)
        u[:, j + 1] = _mirror(u_mirrored, t[:, j + 1] - t_mirrored)
    return u, np.cross(t, u)


def _mirror(v: Vectors, normal_: Vectors) -> Vectors:
    return v - 2 * _dot(normal_, v) / np.maximum(_dot(normal_, normal_), 1e-20) * normal_


def _dot(a: Vectors, b: Vectors) -> Vectors:
    return np.asarray(np.einsum("ij,ij->i", a, b)[:, None])
