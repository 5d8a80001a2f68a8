"""From roots to paths: a direction field over the head, integrated in steps of 4 mm.

A strand starts in a direction of its own. It then turns, over the length `bend`, towards a target that passes from
the combed flow in the tangent plane to gravity over the length `comb`; the part of the target that dives below the
strand's layer is removed. Layers rise over `lift_over` to a height of the strand's own, so that hair has volume.
Arrays alone, in fitted coordinates, y up.
"""

from dataclasses import dataclass

import numpy as np

from pipeline.groom.head.distance import smoothstep
from pipeline.groom.style.ground import Terrain, tangential
from pipeline.groom.style.hair import STEP, Vectors, dot, unit

JAW = -0.07  # [m] height below which hair hangs

_CLEARANCE = 0.8e-3  # [m] of the lowest layer
_DOWN = np.array([0.0, -1.0, 0.0])
_FADE = 0.05  # [m] over which layers sink below the jaw
_STRETCH = 8  # steps that a wandering direction lasts


@dataclass(frozen=True)
class Sprouts:
    """What sets the growth of single strands apart; each (N,) or (N, 3)."""

    root: Vectors
    standoff: Vectors
    """(N, 2), see `Combing`."""
    first: Vectors
    """Unit direction of the first step."""
    sweep: Vectors
    """Forward part of the combing near the front hairline."""
    layer: Vectors
    """Height [m] of the strand's layer above the skin."""
    bend: Vectors
    """[m]"""
    comb: Vectors
    """[m]"""
    wander: Vectors
    """(N, stretches(steps), 3), added to the target direction one after the other."""


def stretches(steps: int) -> int:
    """How many directions of `wander` so many steps take."""
    return -(-steps // _STRETCH)


def grown(own: Sprouts, terrain: Terrain, lift_over: float, steps: int) -> Vectors:
    """Polylines (N, steps + 1, 3) of equal steps."""
    front = swept(own.root, own.sweep)
    p, t = own.root, own.first
    points = np.empty((len(p), steps + 1, 3))
    points[:, 0] = p
    for k in range(1, steps + 1):
        s = k * STEP
        d, m = terrain.wall.sample(p)
        sunk = smoothstep((JAW - p[:, 1]) / _FADE)
        layer = _CLEARANCE + own.layer * smoothstep(np.asarray(s / lift_over)) * (1 - 0.9 * sunk)
        fade = np.exp(-s / own.comb)[:, None]
        flow = unit(terrain.combing.flow(p, m, own.standoff) + tangential(front, m))
        target = unit(fade * flow + (1 - fade) * _DOWN + own.wander[:, (k - 1) // _STRETCH])
        dive = np.minimum(dot(target, m), 0) * smoothstep(1.5 - (d - layer) / 0.006)[:, None]
        target = unit(target - dive * m + m * np.clip((layer - d) / own.bend, 0, 0.8)[:, None])
        t = unit(t + (target - t) * np.minimum(STEP / own.bend, 1)[:, None])
        ahead, n = terrain.wall.sample(p + STEP * t)
        lowest = np.minimum(layer, _CLEARANCE + 0.25 * s)
        t = unit(STEP * t + 0.6 * np.maximum(lowest - ahead, 0)[:, None] * n)
        p = p + STEP * t
        points[:, k] = p
    return points


def swept(root: Vectors, sweep: Vectors) -> Vectors:
    """What combing is swept by (N, 3): forwards or backwards by `sweep` (N,), at the front hairline."""
    return np.asarray((smoothstep((root[:, 2] - 0.02) / 0.06) * sweep)[:, None] * np.array([0.0, 0.0, 1.0]))
