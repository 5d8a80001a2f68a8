"""numpy twins of the grooming kernels: helices in frames of least rotation, sines, locks, growth."""

import numpy as np
from numpy.typing import NDArray

Vectors = NDArray[np.float64]


def smoothstep(t: Vectors) -> Vectors:
    t = np.clip(t, 0, 1)
    return t * t * (3 - 2 * t)


def coiled(points: Vectors, reference: Vectors, length: Vectors, coil: Vectors) -> Vectors:
    radius, pitch, phase, minor, onset, ramp = coil.T[:, :, None]
    along = np.linspace(0, 1, points.shape[1]) * length[:, None]
    u, v = frames(points, reference)
    theta = 2 * np.pi * (phase + along / pitch)
    amplitude = radius * smoothstep((along - onset) / ramp)
    return (
        points
        + (amplitude * np.cos(theta))[..., None] * u
        + (amplitude * minor * np.sin(theta))[..., None] * v
    )


def shaken(points: Vectors, length: Vectors, sines: Vectors, rise: Vectors) -> Vectors:
    along = np.linspace(0, 1, points.shape[1]) * length[:, None]
    wave = np.sin(2 * np.pi * (along[:, :, None] / sines[:, None, :, 0] + sines[:, None, :, 1]))
    return points + smoothstep(along / rise[:, None])[..., None] * np.einsum(
        "spk,ski->spi", wave, sines[..., 2:]
    )


def drawn_in(
    points: Vectors,
    length: Vectors,
    middles: Vectors,
    middle_length: Vectors,
    lock: NDArray[np.int64],
    strength: Vectors,
    over: Vectors,
) -> Vectors:
    along = np.linspace(0, 1, points.shape[1]) * length[:, None]
    target = at(middles, along / middle_length[lock][:, None] * (middles.shape[1] - 1), lock)
    weight = strength[:, None] * smoothstep(along / over[:, None])
    return points + weight[..., None] * (target - points)


def shortened(points: Vectors, step: float, length: Vectors, count: int) -> Vectors:
    return at(points, np.linspace(0, 1, count) * length[:, None] / step, np.arange(len(points)))


def at(points: Vectors, place: Vectors, which: NDArray[np.int64]) -> Vectors:
    """Points of the strands `which` (N,) at fractional point indices (N, P), straight on past the tip."""
    last = points.shape[1] - 1
    place = np.clip(place, 0, last + 4.0)
    i = np.minimum(place.astype(np.int64), last - 1)
    u = (place - i)[..., None]
    row = which[:, None]
    return points[row, i] * (1 - u) + points[row, i + 1] * u


def frames(points: Vectors, reference: Vectors) -> tuple[Vectors, Vectors]:
    """Rotation-minimising unit normals U and V, each (N, P, 3), started from the reference direction (N, 3)."""
    t = np.gradient(points, axis=1)
    t /= np.maximum(np.linalg.norm(t, axis=2, keepdims=True), 1e-12)
    u = np.empty_like(points)
    start = reference - dot(reference, t[:, 0]) * t[:, 0]
    u[:, 0] = start / np.maximum(np.linalg.norm(start, axis=1, keepdims=True), 1e-12)
    for j in range(points.shape[1] - 1):
        chord = points[:, j + 1] - points[:, j]
        u_mirrored, t_mirrored = mirror(u[:, j], chord), mirror(t[:, j], chord)
        u[:, j + 1] = mirror(u_mirrored, t[:, j + 1] - t_mirrored)
    return u, np.cross(t, u)


def mirror(v: Vectors, normal: Vectors) -> Vectors:
    return v - 2 * dot(normal, v) / np.maximum(dot(normal, normal), 1e-20) * normal


def dot(a: Vectors, b: Vectors) -> Vectors:
    return np.einsum("ij,ij->i", a, b)[:, None]
