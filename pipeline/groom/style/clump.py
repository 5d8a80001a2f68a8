"""Clump: strands gather about the middle strand of their clump, at the same arc length."""

from dataclasses import replace

import numpy as np

from pipeline import kernels
from pipeline.config.schema import Clump
from pipeline.groom.style.chance import Chance
from pipeline.groom.style.ground import Ground
from pipeline.groom.style.hair import Hair
from pipeline.strands.partings import NOBODY

_STRENGTH = 0  # use of chance


def clumped(hair: Hair, op: Clump, ground: Ground, chance: Chance) -> Hair:
    """Strands drawn to their middles, more and more over `over`."""
    middles, lock = ground.middles[chance.name], hair.locks[chance.name]
    jitter = 1 - op.strength_jitter * chance.uniform(hair.index, _STRENGTH)
    apart = (lock == NOBODY) | (hair.sections != middles.section[lock])
    strength = np.where(apart, 0, ground.values(op.strength, hair) * jitter)
    begin, lock = hair.free_from, lock.clip(min=0)
    pull = np.stack([strength, np.full(len(hair), op.over), begin, middles.free_from[lock] - begin], axis=1)
    points = kernels.drawn_in(hair.points, hair.length, middles.points, middles.length, lock, pull)
    return replace(hair, points=points)
