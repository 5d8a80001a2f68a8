"""Trim: strands end where they leave a half space or a sphere, as under scissors.

The hemline is uneven on purpose: layers are cut deeper, clumps are longer or shorter, and every strand has its own
jitter. Below the jaw a strand is measured as if it hung straight down, so that what lies on the shoulders is as long
as what hangs beside them.
"""

from dataclasses import replace

import numpy as np

from pipeline.config.schema import Trim
from pipeline.groom.style.chance import Chance
from pipeline.groom.style.ground import Ground
from pipeline.groom.style.growth import JAW
from pipeline.groom.style.hair import Hair, Vectors, cut_to, shortened
from pipeline.strands.spacing import arc_length

_OWN, _RARE, _UNEVEN = 0, 1, 2  # uses of chance


def trimmed(hair: Hair, op: Trim, ground: Ground, chance: Chance) -> Hair:
    """Strands without what lies outside, but never shorter than `shortest`."""
    whole = arc_length(hair.points)
    uneven = op.uneven * (2 * chance.uniform(hair.lock(op.per), _UNEVEN) - 1)
    inside = op.layers * chance.layer(hair.index) ** 2 - uneven
    outside = _outside(hair.points, whole, op) + inside[:, None]
    own, rare = (chance.uniform(hair.index, use) for use in (_OWN, _RARE))
    length = shortened(_first_crossing(outside, whole), op.jitter, own, rare)
    length = np.clip(length, np.minimum(op.shortest, whole[:, -1]), whole[:, -1])
    return replace(hair, points=cut_to(hair.points, length, ground.points), length=length)


def _outside(points: Vectors, along: Vectors, op: Trim) -> Vectors:
    """Distance (N, K) [m] of points outside of what is kept; negative inside."""
    if op.sphere is not None:
        return np.asarray(np.linalg.norm(points - np.array(op.sphere.centre), axis=2) - op.sphere.radius)
    height = _hung(points[..., 1], along) if op.hanging else points[..., 1]
    plane = (op.height or 0.0) + np.tan(op.slope) * points[..., 2]
    return np.asarray(plane - height)


def _hung(height: Vectors, along: Vectors) -> Vectors:
    """Heights (N, K) [m] that points would have if strands hung straight down from where they pass the jaw."""
    below = height < JAW
    first = np.where(below, along, np.inf).min(axis=1)
    beyond = np.where(below.any(axis=1), first, 0)[:, None]
    straight = JAW - (along - beyond)
    hangs = below.any(axis=1, keepdims=True) & (along >= beyond)
    return np.asarray(np.where(hangs, np.minimum(height, straight), height))


def _first_crossing(outside: Vectors, along: Vectors) -> Vectors:
    """Arc length (N,) [m] at which strands first come outside; all of it where they do not."""
    out = np.asarray(outside > 0)
    after = np.maximum(out.argmax(axis=1), 1)
    row = np.arange(len(out))
    a, b = outside[row, after - 1], outside[row, after]
    part = np.clip(-a / np.maximum(b - a, 1e-9), 0, 1)
    at = along[row, after - 1] + part * (along[row, after] - along[row, after - 1])
    return np.asarray(np.where(out.any(axis=1), at, along[:, -1]))
