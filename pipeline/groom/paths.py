"""From roots to strands: integrate a direction field over the head.

A strand leaves the skin at `tilt` from the normal, towards the comb direction (away from the parting, swept back near
the front hairline). It then turns, over the length `bend`, towards a target that passes from the combed flow in the
tangent plane to gravity over the length `comb`; the part of the target that dives below the strand's layer is
removed. Layers rise over `lift_over` to a height of the strand's own, so that hair has volume.
Everything is in fitted coordinates, y up.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.config.schema import Groom
from pipeline.groom.head import scalp
from pipeline.groom.head.distance import smoothstep
from pipeline.groom.head_field import Field
from pipeline.groom.partings import PartingLine
from pipeline.strands.random import normal, uniform

Points = NDArray[np.floating[Any]]
Vectors = NDArray[np.float64]

STEP = 4e-3  # [m] of arc length
_CLEARANCE = 0.8e-3  # [m] of the lowest layer
_DOWN = np.array([0.0, -1.0, 0.0])
_JAW, _FADE = -0.07, 0.05  # [m] height below which layers sink, and over which
_LONGEST = 0.42  # [m]
_WHORL = 0.35  # [rad] turn of the flow about the whorl where there is no parting
_FLYAWAY_RISE = 0.3  # most that a flyaway rises above its layer, in units of the lift
_STRETCH = 8  # steps that a wandering direction lasts
_TILT, _DIRECTION, _LAYER, _FLYAWAY, _RISE, _BEND, _COMB, _WANDER = 30, 20, 40, 41, 42, 43, 44, 50  # salts


@dataclass(frozen=True)
class Terrain:
    """What hair grows on: skin, wall (the skin with a guard in front of the face) and the parting."""

    skin: Field
    wall: Field
    parting: PartingLine | None

    def side(self, roots: Vectors) -> NDArray[np.int8]:
        """Side of the parting (N,) that roots lie on: 1 left, -1 right, 0 where there is none."""
        return self.parting.side(roots) if self.parting else np.zeros(len(roots), np.int8)


@dataclass(frozen=True)
class Traits:
    """What sets one strand apart, each (N,)."""

    layer: Vectors
    """0 the lowest layer to 1 the outermost."""
    flyaway: NDArray[np.bool_]


@dataclass(frozen=True)
class Paths:
    """Polylines of equal steps."""

    points: Vectors
    """(N, K, 3) [m], K steps of `STEP`."""
    comb: Vectors
    """(N, 3) unit comb direction at the root."""


def traits(groom: Groom, seed: int, index: NDArray[np.int64]) -> Traits:
    """Layers and flyaways of strands."""
    return Traits(uniform(seed, index, _LAYER), uniform(seed, index, _FLYAWAY) < groom.frizz.flyaways)


def grow(
    groom: Groom, seed: int, index: NDArray[np.int64], roots: Vectors, normals: Vectors, terrain: Terrain
) -> Paths:
    """Integrate the strands with these indices from their roots (N, 3) and skin normals (N, 3)."""
    path = groom.path
    own = traits(groom, seed, index)
    rise = np.where(own.flyaway, 0.2 + _FLYAWAY_RISE * uniform(seed, index, _RISE), 0)
    height = path.lift * (0.25 + 0.75 * own.layer + rise)
    bend = path.bend * (0.8 + 0.4 * uniform(seed, index, _BEND))
    comb_length = path.comb * (0.85 + 0.3 * uniform(seed, index, _COMB))
    front = smoothstep((roots[:, 2] - 0.02) / 0.06)[:, None] * np.array([0, 0, path.sweep])
    side = terrain.side(roots)
    comb = _unit(_flow(terrain, side, roots, normals) + _tangential(front, normals))
    t = _first_direction(groom, seed, index, normals, comb)
    p, points = roots, [roots]
    for k in range(1, int(longest(groom) / STEP) + 1):
        s = k * STEP
        d, m = terrain.wall.sample(p)
        sunk = smoothstep((_JAW - p[:, 1]) / _FADE)
        layer = _CLEARANCE + height * smoothstep(np.asarray(s / path.lift_over)) * (1 - 0.9 * sunk)
        fade = np.exp(-s / comb_length)[:, None]
        flow = _unit(_flow(terrain, side, p, m) + _tangential(front, m))
        if k % _STRETCH == 1:
            noise = path.wander * _noise(seed, index, k // _STRETCH)
        target = _unit(fade * flow + (1 - fade) * _DOWN + noise)
        dive = np.minimum(_dot(target, m), 0) * smoothstep(1.5 - (d - layer) / 0.006)[:, None]
        target = _unit(target - dive * m + m * np.clip((layer - d) / bend, 0, 0.8)[:, None])
        t = _unit(t + (target - t) * np.minimum(STEP / bend, 1)[:, None])
        ahead, n = terrain.wall.sample(p + STEP * t)
        lowest = np.minimum(layer, _CLEARANCE + 0.25 * s)
        t = _unit(STEP * t + 0.6 * np.maximum(lowest - ahead, 0)[:, None] * n)
        p = p + STEP * t
        points.append(p)
    return Paths(np.stack(points, axis=1), comb)


def longest(groom: Groom) -> float:
    """Arc length [m] that paths are integrated over."""
    return _LONGEST if groom.cut.height is not None else groom.cut.length


def cut_lengths(groom: Groom, seed: int, index: NDArray[np.int64], paths: Paths, uneven: Vectors) -> Vectors:
    """Arc length (N,) [m] at which each strand ends: where it falls below the cut height, or the wanted length.

    The hemline is uneven on purpose: layers are cut higher, locks are `uneven` (N,) [m] longer, and every strand has
    its own jitter, more at few. Below the jaw a strand is measured as if it hung straight down, so that what lies on
    the shoulders is as long as what hangs beside them.
    """
    cut, available = groom.cut, (paths.points.shape[1] - 1) * STEP
    lengths = np.full(len(index), available)
    if cut.height is not None:
        level = cut.height - uneven + cut.layers * traits(groom, seed, index).layer ** 2
        lengths = np.minimum(_arc_to_level(paths.points[:, :, 1], level), available)
    shorter = cut.jitter * (0.5 * uniform(seed, index, 61) + 1.5 * uniform(seed, index, 62) ** 6)
    return np.clip(lengths * (1 - shorter), 0.012, available)


def _arc_to_level(height: Vectors, level: Vectors) -> Vectors:
    """Arc length (N,) [m] at which strands of heights (N, K) [m] reach their level (N,); infinite if they do not."""
    hung = np.cumsum(height < _JAW, axis=1) * STEP
    height = np.where(hung > 0, np.minimum(height, _JAW + STEP - hung), height)
    below = height < level[:, None]
    after = np.maximum(below.argmax(axis=1), 1)
    # Between the two steps around the level, so that the hemline has no terraces.
    row = np.arange(len(height))
    y0, y1 = height[row, after - 1], height[row, after]
    part = np.clip((y0 - level) / np.maximum(y0 - y1, 1e-9), 0, 1)
    return np.asarray(np.where(below.any(axis=1), (after - 1 + part) * STEP, np.inf))


def _first_direction(groom: Groom, seed: int, index: NDArray[np.int64], n: Vectors, comb: Vectors) -> Vectors:
    path = groom.path
    tilt = path.tilt + path.tilt_jitter * np.clip(normal(seed, index, _TILT), -2, 2)
    tilt = np.clip(tilt, 0, 1.5)[:, None]
    jitter = np.stack([normal(seed, index, _DIRECTION + k) for k in range(3)], axis=1)
    return _unit(np.cos(tilt) * n + np.sin(tilt) * _unit(comb + path.direction_jitter * jitter))


def _flow(terrain: Terrain, side: NDArray[np.int8], p: Vectors, n: Vectors) -> Vectors:
    """Tangential unit direction of the combing: away from the parting, or from the whorl, and around its end."""
    if terrain.parting is not None:
        away, swirl = terrain.parting.away(p, side), terrain.parting.swirl(p)[:, None]
    else:
        away, swirl = -np.broadcast_to(scalp.whorl(), p.shape), np.full((1, 1), _WHORL)
    away = _unit(_tangential(away, n))
    return np.asarray(np.cos(swirl) * away + np.sin(swirl) * np.cross(n, away))


def _noise(seed: int, index: NDArray[np.int64], stretch: int) -> Vectors:
    return np.stack([normal(seed, index, _WANDER + k + 3 * stretch) for k in range(3)], axis=1)


def _tangential(v: Vectors, n: Vectors) -> Vectors:
    return v - _dot(v, n) * n


def _dot(a: Vectors, b: Vectors) -> Vectors:
    return np.asarray(np.einsum("ij,ij->i", a, b)[:, None])


def _unit(v: Vectors) -> Vectors:
    return np.asarray(v / np.maximum(np.sqrt(_dot(v, v)), 1e-12))
