"""Flyaway: a few strands leave their lock, rise above the others and bend slowly."""

from dataclasses import replace

import numpy as np

from pipeline.config.schema import Flyaway
from pipeline.groom.head.distance import smoothstep
from pipeline.groom.style.chance import Chance
from pipeline.groom.style.ground import Ground
from pipeline.groom.style.hair import Hair
from pipeline.groom.style.ripple import rippled, sines

_CHOSEN, _RISE, _BENDS = 0, 1, 8  # uses of chance
_PERIODS, _SHARES = (0.07, 0.15), (0.5, 1.0)  # [m]


def flown(hair: Hair, op: Flyaway, ground: Ground, chance: Chance) -> Hair:
    """Strands of which some have left."""
    which = np.flatnonzero(chance.uniform(hair.index, _CHOSEN) < ground.values(op.fraction, hair))
    index, length, points = hair.index[which], hair.length[which], hair.points[which]
    _, outwards = ground.under(op.op).wall.sample(points.reshape(-1, 3))
    rise = op.rise * chance.uniform(index, _RISE)
    along = np.linspace(0, 1, points.shape[1]) * length[:, None]
    away = (rise[:, None] * smoothstep(along / op.over))[..., None]
    period, phase, swing = sines(chance, index, _BENDS, _PERIODS, _SHARES)
    moved = hair.points.copy()
    moved[which] = rippled(
        points + away * outwards.reshape(points.shape), length, period, phase, op.wander * swing, op.over
    )
    return replace(hair, points=moved)
