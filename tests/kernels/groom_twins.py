"""numpy twins of the grooming kernels: helices in frames of least rotation, sines, locks, growth."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from pipeline import kernels
from pipeline.strands.spacing import arc_length

Vectors = NDArray[np.float64]
Chart = Callable[[Vectors], Vectors]

STEP = 4e-3  # [m]


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


def turned(points: Vectors, length: Vectors, turn: Vectors) -> Vectors:
    """Segments turned about an axis each, by Rodrigues' formula."""
    axis, (begin, over, angle) = turn[:, None, :3], turn[:, 3:].T[..., None]
    segments = np.diff(points, axis=1)
    middle = (np.arange(segments.shape[1]) + 0.5) / segments.shape[1] * length[:, None]
    by = (smoothstep((middle - begin) / over) * angle)[..., None]
    c, s = np.cos(by), np.sin(by)
    moved = (
        c * segments
        + s * np.cross(axis, segments)
        + (1 - c) * (axis * segments).sum(axis=2, keepdims=True) * axis
    )
    return np.concatenate([points[:, :1], points[:, :1] + np.cumsum(moved, axis=1)], axis=1)


def drawn_in(
    points: Vectors,
    length: Vectors,
    middles: Vectors,
    middle_length: Vectors,
    lock: NDArray[np.int64],
    pull: Vectors,
) -> Vectors:
    strength, over, begin, shift = pull.T[:, :, None]
    along = np.linspace(0, 1, points.shape[1]) * length[:, None]
    target = at(middles, (along + shift) / middle_length[lock][:, None] * (middles.shape[1] - 1), lock)
    weight = strength * smoothstep((along - begin) / over)
    return points + weight[..., None] * (target - points)


def shortened(points: Vectors, length: Vectors, count: int) -> Vectors:
    along = arc_length(points)
    place = [
        np.interp(np.linspace(0, 1, count) * whole, own, np.arange(points.shape[1]))
        for whole, own in zip(length, along, strict=True)
    ]
    return at(points, np.array(place), np.arange(len(points)))


def first_outside(points: Vectors, margin: Vectors, shape: Vectors, round_: bool, hang: float) -> Vectors:
    along, p = arc_length(points), points.copy()
    below = p[..., 1] < hang
    hung = below.any(axis=1)[:, None] & (along >= np.where(below, along, np.inf).min(axis=1)[:, None])
    start = np.where(below, along, np.inf).min(axis=1)[:, None]
    straight = np.where(hung, hang - (along - np.where(np.isfinite(start), start, 0)), 0)
    p[..., 1] = np.where(hung, np.minimum(p[..., 1], straight), p[..., 1])
    from_shape = np.linalg.norm(p - shape[:3], axis=2) - shape[3] if round_ else p @ shape[:3] + shape[3]
    outside = from_shape - margin[:, None]
    out = outside > 0
    after, row = np.maximum(out.argmax(axis=1), 1), np.arange(len(p))
    a, b = outside[row, after - 1], outside[row, after]
    part = np.clip(-a / np.maximum(b - a, 1e-9), 0, 1)
    crossing = along[row, after - 1] + part * (along[row, after] - along[row, after - 1])
    return np.where(out.any(axis=1), crossing, along[:, -1])


def grown(
    wall: kernels.DistanceField,
    chart: Chart,
    grid: NDArray[np.float32],
    roots: Vectors,
    first: Vectors,
    growth: Vectors,
    wander: Vectors,
    steps: int,
) -> Vectors:
    height, over, bend, comb = growth.T[:4]
    sweep, standoff = growth[:, 4:7], growth[:, 7:9]
    p, t, points = roots, first, [roots]
    for k in range(1, steps + 1):
        s = k * STEP
        d, m = kernels.distance(wall, p)
        sunk = smoothstep((-0.07 - p[:, 1]) / 0.05)
        layer = 0.8e-3 + height * smoothstep(s / over) * (1 - 0.9 * sunk)
        fade = np.exp(-s / comb)[:, None]
        combed = unit(tangential(bilinear(grid, chart(p) + standoff), m))
        flow = unit(combed + tangential(sweep, m))
        target = unit(fade * flow + (1 - fade) * np.array([0, -1, 0]) + wander[:, (k - 1) // 8])
        dive = np.minimum(dot(target, m), 0) * smoothstep(1.5 - (d - layer) / 0.006)[:, None]
        target = unit(target - dive * m + m * np.clip((layer - d) / bend, 0, 0.8)[:, None])
        t = unit(t + (target - t) * np.minimum(STEP / bend, 1)[:, None])
        ahead, n = kernels.distance(wall, p + STEP * t)
        lowest = np.minimum(layer, 0.8e-3 + 0.25 * s)
        t = unit(STEP * t + 0.6 * np.maximum(lowest - ahead, 0)[:, None] * n)
        p = p + STEP * t
        points.append(p)
    return np.stack(points, axis=1)


def bilinear(grid: NDArray[np.float32], uv: Vectors) -> Vectors:
    last = grid.shape[0] - 1
    place = np.clip((uv + 1) * (last / 2), 0, last - 1e-9)
    i = place.astype(np.int64)
    u, v = (place - i).T[..., None]
    g = grid.astype(np.float64)[..., :3]
    low = g[i[:, 0], i[:, 1]] * (1 - v) + g[i[:, 0], i[:, 1] + 1] * v
    high = g[i[:, 0] + 1, i[:, 1]] * (1 - v) + g[i[:, 0] + 1, i[:, 1] + 1] * v
    return low * (1 - u) + high * u


def tangential(v: Vectors, n: Vectors) -> Vectors:
    return v - dot(v, n) * n


def unit(v: Vectors) -> Vectors:
    return v / np.maximum(np.sqrt(dot(v, v)), 1e-12)


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
