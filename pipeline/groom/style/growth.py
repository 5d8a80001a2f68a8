"""From roots to paths: a direction field over the head, integrated in steps of 4 mm.

A strand starts in a direction of its own. It then turns, over the length `bend`, towards a target that passes from
the combed flow in the tangent plane to gravity over the length `comb`; the part of the target that dives below the
strand's layer is removed. Layers rise over `lift_over` to a height of the strand's own, so that hair has volume.
The integration is `kernels.Terrain.grown`. In fitted coordinates, y up.
"""

from dataclasses import dataclass

import numpy as np

from pipeline.groom.head.distance import smoothstep
from pipeline.groom.style.ground import Terrain
from pipeline.groom.style.hair import Vectors

JAW = -0.07  # [m] height below which hair hangs

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
    length: Vectors
    """[m]: what lies beyond goes straight on."""
    wander: Vectors
    """(N, stretches(steps), 3), added to the target direction one after the other."""


def stretches(steps: int) -> int:
    """How many directions of `wander` so many steps take."""
    return -(-steps // _STRETCH)


def grown(own: Sprouts, terrain: Terrain, lift_over: float, steps: int) -> Vectors:
    """Polylines (N, steps + 1, 3) of equal steps."""
    rows = np.column_stack(
        [
            own.layer,
            np.full(len(own.root), lift_over),
            own.bend,
            own.comb,
            swept(own.root, own.sweep),
            own.standoff,
            own.length,
        ]
    )
    return terrain.native.grown(own.root, own.first, rows, own.wander, steps + 1)


def swept(root: Vectors, sweep: Vectors) -> Vectors:
    """What combing is swept by (N, 3): forwards or backwards by `sweep` (N,), at the front hairline."""
    return np.asarray((smoothstep((root[:, 2] - 0.02) / 0.06) * sweep)[:, None] * np.array([0.0, 0.0, 1.0]))
