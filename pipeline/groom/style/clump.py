"""Clump: strands gather about the middle strand of their clump, at the same arc length."""

from dataclasses import replace

import numpy as np

from pipeline.config.schema import Clump
from pipeline.groom.head.distance import smoothstep
from pipeline.groom.style.chance import Chance
from pipeline.groom.style.ground import Ground
from pipeline.groom.style.hair import Hair, Index, Vectors
from pipeline.strands.partings import NOBODY

_STRENGTH = 0  # use of chance
_PAST_THE_TIP = 4.0  # points that a middle is drawn on, straight, for strands longer than it


def clumped(hair: Hair, op: Clump, ground: Ground, chance: Chance) -> Hair:
    """Strands drawn to their middles, more and more over `over`."""
    middles, lock = ground.middles[chance.name], hair.locks[chance.name]
    jitter = 1 - op.strength_jitter * chance.uniform(hair.index, _STRENGTH)
    strength = np.where(lock == NOBODY, 0, ground.values(op.strength, hair) * jitter)
    points = gathered(
        hair.points, hair.length, middles.points, middles.length, lock.clip(min=0), strength, op.over
    )
    return replace(hair, points=points)


def gathered(
    points: Vectors,
    length: Vectors,
    middles: Vectors,
    middle_length: Vectors,
    lock: Index,
    strength: Vectors,
    over: float,
) -> Vectors:
    """Points (N, K, 3) [m] moved by `strength` (N,) towards those of the middles (M, K, 3) `lock` (N,)."""
    last = points.shape[1] - 1
    along = np.linspace(0, 1, last + 1) * length[:, None]
    target = _at(middles, along / middle_length[lock][:, None] * last, lock)
    weight = strength[:, None] * smoothstep(along / over)
    return np.asarray(points + weight[..., None] * (target - points))


def _at(points: Vectors, place: Vectors, which: Index) -> Vectors:
    """Points of the strands `which` (N,) at fractional point numbers (N, K), straight on past the tip."""
    last = points.shape[1] - 1
    place = np.clip(place, 0, last + _PAST_THE_TIP)
    i = np.minimum(place.astype(np.int64), last - 1)
    u = (place - i)[..., None]
    row = which[:, None]
    return np.asarray(points[row, i] * (1 - u) + points[row, i + 1] * u)
