"""Bend: strands turn, over a range of arc length, and stay turned beyond it, as after a round brush."""

from dataclasses import replace

import numpy as np

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
    segments = np.diff(hair.points, axis=1)
    row = np.arange(len(hair))
    first = np.clip((begin / hair.length * segments.shape[1]).astype(np.int64), 0, segments.shape[1] - 1)
    axis = np.cross(unit(segments[row, first]), _towards(hair.points[row, first], op, ground))
    size = np.sqrt(dot(axis, axis))
    angle = ground.values(op.angle, hair) * (1 + op.jitter * (2 * chance.uniform(hair.index, _ANGLE) - 1))
    middle = 0.5 * (hair.along[:, 1:] + hair.along[:, :-1])
    turned = (
        smoothstep((middle - begin[:, None]) / op.over) * (angle * smoothstep(size[:, 0] / _ALONG))[:, None]
    )
    points = hair.points.copy()
    points[:, 1:] = hair.points[:, :1] + np.cumsum(
        _rotated(segments, unit(axis)[:, None], turned[..., None]), axis=1
    )
    return replace(hair, points=points)


def _towards(points: Vectors, op: Bend, ground: Ground) -> Vectors:
    """Unit directions (N, 3) that strands turn towards, where they begin to."""
    if op.towards != "head":
        return unit(np.broadcast_to(np.array(op.towards, float), points.shape))
    level = ground.under(op.op).wall.sample(points)[1] * [1.0, 0.0, 1.0]
    return -unit(level)


def _rotated(v: Vectors, axis: Vectors, angle: Vectors) -> Vectors:
    """Vectors (N, J, 3) turned about unit axes (N, 1, 3) by angles (N, J, 1) [rad] (Rodrigues' formula)."""
    c, s = np.cos(angle), np.sin(angle)
    return np.asarray(c * v + s * np.cross(axis, v) + (1 - c) * dot(axis, v) * axis)
