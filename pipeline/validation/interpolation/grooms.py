"""Heads of hair that the interpolation is measured on: kinds of curl, combed over a round head.

A strand's middle line lies in the plane of its root and the vertical: it leaves the skin, rises to its layer, runs down
the head and hangs. Roots higher up have higher layers. About it goes a helix of radius r and pitch p which opens over
the first centimetres; its phase varies smoothly over the scalp, or at random, with the radius, from strand to strand.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.body.distance import Grid
from pipeline.groom.head_field import Field
from pipeline.strands.random import uniform
from pipeline.strands.resample import resampled
from pipeline.strands.spacing import arc_length

Floats = NDArray[np.float64]

LENGTH = 0.2
"""Arc length of every strand [m]."""
HEAD = 0.09
"""Radius of the head [m]."""

# [m] lowest layer over the curls, spread of the layers, ramp of the helix
_SKIN, _LAYERS, _OPENS = 1e-3, 0.015, 0.03
_PHASE_WAVELENGTH = 0.04  # [m] over the scalp
_RISES, _STEEPEST = 0.02, 0.7  # [m] over which a strand rises to its layer, and its steepest rise
_FINE = 400  # points of the middle line
_LAYER, _PHASE, _RADIUS = range(0x1F01, 0x1F04)  # salts


@dataclass(frozen=True)
class Kind:
    """What hair a head has: radius and pitch of the curls [m], points of a strand."""

    name: str
    radius: float
    pitch: float
    points: int
    random_phase: bool = False


KINDS = (
    Kind("straight", 0.0, 1.0, 32),
    Kind("wavy", 0.002, 0.04, 48),
    Kind("curly", 0.005, 0.02, 64),
    Kind("curly, random phase", 0.005, 0.02, 64, random_phase=True),
    Kind("tight", 0.003, 0.005, 128),
    Kind("tight, random phase", 0.003, 0.005, 128, random_phase=True),
)


def groom(kind: Kind, strands: int) -> Floats:
    """Strands (S, P, 3) [m] of `LENGTH` (to 0.3 %) at equal spacing; any prefix is evenly spread."""
    index = np.arange(strands)
    middle, normal, across = _middle_lines(kind, index)
    along = np.linspace(0, LENGTH, _FINE)
    turn = 2 * np.pi * along / np.hypot(2 * np.pi * kind.radius, kind.pitch) + _phase(
        kind, middle[:, 0], index
    )
    radius = kind.radius * (0.9 + 0.2 * uniform(1, index, _RADIUS) if kind.random_phase else np.ones(strands))
    open_ = np.clip(along / _OPENS, 0, 1)
    offset = radius[:, None] * open_**2 * (3 - 2 * open_)
    points = (
        middle + (offset * np.cos(turn))[..., None] * normal + (offset * np.sin(turn))[..., None] * across
    )
    return _of_length(points, kind.points)


def round_head(spacing: float = 3e-3) -> Field:
    """Distance to the head."""
    grid = Grid.around(HEAD * np.array([[-1.0, -1, -1], [1, 1, 1]]), spacing)
    axes = [grid.origin[k] + spacing * np.arange(n) for k, n in enumerate(grid.shape)]
    x, y, z = np.meshgrid(*axes, indexing="ij")
    return Field((np.sqrt(x**2 + y**2 + z**2) - HEAD).astype(np.float32), grid.origin, spacing)


def _middle_lines(kind: Kind, index: NDArray[np.int64]) -> tuple[Floats, Floats, Floats]:
    """Points, normals in the plane and normals across it, (S, Q, 3) each, of lines as long as a strand."""
    # Any prefix is even: a sequence of low discrepancy
    height = 1 - 0.95 * ((index + 0.5) * 0.7548776662466927 % 1)
    azimuth = 2 * np.pi * ((index + 0.5) * 0.5698402909980532 % 1)
    plane = _combed(np.asarray(height), _layers(kind, np.asarray(height), index))
    t = np.gradient(plane, axis=1)
    t /= np.linalg.norm(t, axis=2, keepdims=True)
    c, s = np.cos(azimuth)[:, None], np.sin(azimuth)[:, None]
    points = np.stack([plane[..., 0] * c, plane[..., 1], plane[..., 0] * s], axis=-1)
    normal = np.stack([-t[..., 1] * c, t[..., 0], -t[..., 1] * s], axis=-1)
    return points, normal, np.broadcast_to(np.stack([-s, 0 * s, c], axis=-1), points.shape)


def _layers(kind: Kind, height: Floats, index: NDArray[np.int64]) -> Floats:
    """Distance from the skin (S,) [m] at which strands run: no curl reaches into the head."""
    return np.asarray(_SKIN + 1.2 * kind.radius + _LAYERS * (0.8 * height + 0.2 * uniform(1, index, _LAYER)))


def _combed(height: Floats, layer: Floats) -> Floats:
    """Lines (S, Q, 2) [m], outwards and up, from roots at a height over the radius: down along the head, then hanging."""
    step = LENGTH / (_FINE - 1)
    at = [HEAD * np.stack([np.sqrt(1 - height**2), height], axis=1)]
    for _ in range(_FINE - 1):
        out, up = at[-1].T
        hangs = up < 0
        rise = np.minimum((HEAD + layer - np.where(hangs, out, np.hypot(out, up))) / _RISES, _STEEPEST)
        polar = np.arctan2(out, up)
        ahead = np.where(hangs, [0 * up, 0 * up - 1], [np.cos(polar), -np.sin(polar)])
        aside = np.where(hangs, [0 * up + 1, 0 * up], [np.sin(polar), np.cos(polar)])
        at.append(at[-1] + step * ((ahead + rise * aside) / np.hypot(1, rise)).T)
    return np.stack(at, axis=1)


def _phase(kind: Kind, root: Floats, index: NDArray[np.int64]) -> Floats:
    if kind.random_phase:
        return np.asarray(2 * np.pi * uniform(1, index, _PHASE)[:, None])
    return np.asarray(2 * np.pi * (root @ np.array([0.6, 0.5, 0.6]))[:, None] / _PHASE_WAVELENGTH)


def _of_length(points: Floats, count: int) -> Floats:
    """The first `LENGTH` of strands, at equal spacing."""
    at = np.linspace(0, LENGTH, points.shape[1])
    cut = [
        [np.interp(at, s, x[:, k]) for k in range(3)] for s, x in zip(arc_length(points), points, strict=True)
    ]
    return np.asarray(resampled(np.moveaxis(np.array(cut), 1, 2), count))
