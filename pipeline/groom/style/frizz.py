"""Frizz: single strands wriggle."""

from dataclasses import replace

from pipeline.config.schema import Frizz
from pipeline.groom.style.chance import Chance
from pipeline.groom.style.ground import Ground
from pipeline.groom.style.hair import Hair
from pipeline.groom.style.ripple import rippled, sines

_PERIODS, _SHARES = (0.012, 0.03, 0.07), (0.25, 0.5, 1.0)  # [m]


def frizzed(hair: Hair, op: Frizz, ground: Ground, chance: Chance) -> Hair:
    """Strands with noise of their own."""
    period, phase, swing = sines(chance, hair.index, 0, _PERIODS, _SHARES)
    swing *= ground.values(op.amplitude, hair)[:, None, None]
    return replace(hair, points=rippled(hair.points, hair.length, period, phase, swing, op.over))
