"""Bend: strands turn, over a range of arc length, and stay turned beyond it, as after a round brush."""

from dataclasses import replace

import numpy as np

from pipeline import kernels
from pipeline.config.schema import Bend
from pipeline.groom.head.distance import smoothstep
from pipeline.groom.style.chance import Chance
from pipeline.groom.style.ground import Ground
from pipeline.groom.style.hair import Hair, Vectors, dot, unit

_ANGLE = 0  # use of chance
# Sine of the angle to the direction of the bend below which there is no telling which way to turn
_ALONG = 0.05


def bent(hair: Hair, op: Bend, ground: Ground, chance: Chance) -> Hair:
    """Strands turned about axes of their own; no segment changes its length."""
    begin = hair.free_from + op.start
    if op.measured_from == "tip":
        begin = hair.length - op.start - op.over
    axis, size = _axes(hair, begin, op, ground)
    angle = ground.values(op.angle, hair) * (1 + op.jitter * (2 * chance.uniform(hair.index, _ANGLE) - 1))
    turn = np.stack([begin, np.full(len(hair), op.over), angle * smoothstep(size / _ALONG)], axis=1)
    return replace(
        hair, points=kernels.turned(hair.points, hair.length, np.concatenate([axis, turn], axis=1))
    )


def _axes(hair: Hair, begin: Vectors, op: Bend, ground: Ground) -> tuple[Vectors, Vectors]:
    """Unit axes (N, 3) of turning, and the sine (N,) of the angle between strand and direction where it begins."""
    row, last = np.arange(len(hair)), hair.points.shape[1] - 2
    first = np.clip((begin / hair.length * (last + 1)).astype(np.int64), 0, last)
    at = hair.points[row, first]
    axis = np.cross(unit(hair.points[row, first + 1] - at), _towards(at, op, ground))
    return unit(axis), np.sqrt(dot(axis, axis))[:, 0]


def _towards(points: Vectors, op: Bend, ground: Ground) -> Vectors:
    """Unit directions (N, 3) that strands turn towards, where they begin to."""
    if op.towards != "head":
        return unit(np.broadcast_to(np.array(op.towards, float), points.shape))
    level = ground.under(op.op).wall.sample(points)[1] * [1.0, 0.0, 1.0]
    return -unit(level)
