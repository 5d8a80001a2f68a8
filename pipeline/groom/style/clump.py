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
    strength = np.where(lock == NOBODY, 0, ground.values(op.strength, hair) * jitter)
    over = np.full(len(hair), op.over)
    points = kernels.drawn_in(hair.points, hair.length, middles.points, middles.length, lock.clip(min=0), strength, over)
    return replace(hair, points=points)
