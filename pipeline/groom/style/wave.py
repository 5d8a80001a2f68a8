"""Wave: strands swing in one plane. Crests lie at one height all around the head, as in hair that was set.

The phase counts from where a strand passes the level of the ears: of hair that falls from there, equal phases lie at
equal heights, wherever its roots are. Clumps differ from that by a part of a turn.
"""

from dataclasses import replace

import numpy as np

from pipeline.config.schema import Wave
from pipeline.groom.style.chance import Chance
from pipeline.groom.style.ground import Ground
from pipeline.groom.style.hair import Hair, Vectors, unit
from pipeline.groom.style.helix import Coil, across, coiled

_SHORTEST_WAVE = 1e-3  # [m]
_WAVELENGTH, _PHASE, _OWN_PHASE, _AMPLITUDE = range(4)  # uses of chance


def waved(hair: Hair, op: Wave, ground: Ground, chance: Chance) -> Hair:
    """Strands that swing about their middle line."""
    index, lock = hair.index, hair.lock(op.per)
    wavelength = ground.values(op.wavelength, hair)
    wavelength *= 1 + op.wavelength_jitter * (2 * chance.uniform(lock, _WAVELENGTH) - 1)
    wavelength = np.maximum(wavelength, _SHORTEST_WAVE)
    amplitude = ground.values(op.amplitude, hair)
    amplitude *= np.clip(1 + op.amplitude_jitter * chance.normal(lock, _AMPLITUDE), 0.5, 1.5)
    phase = 2 * np.pi * op.phase_spread * (chance.uniform(lock, _PHASE) - 0.5)
    phase += op.phase_jitter * chance.normal(index, _OWN_PHASE)
    coil = Coil(
        radius=amplitude,
        pitch=wavelength,
        phase=phase - 2 * np.pi * _at_the_ears(hair) / wavelength,
        flatness=np.zeros(len(hair)),
        onset=hair.free_from + ground.values(op.onset, hair),
        ramp=np.full(len(hair), op.ramp),
    )
    return replace(hair, points=coiled(hair.points, hair.length, _swing(hair, op.sideways), coil))


def _at_the_ears(hair: Hair) -> Vectors:
    """Arc length (N,) [m] at which strands pass the ears (y = 0), as if they hung where they do not."""
    height, along = hair.points[..., 1], hair.along
    below = height <= 0
    after = np.maximum(below.argmax(axis=1), 1)
    row = np.arange(len(height))
    a, b = height[row, after - 1], height[row, after]
    part = np.clip(a / np.maximum(a - b, 1e-9), 0, 1)
    found = along[row, after - 1] + part * (along[row, after] - along[row, after - 1])
    found = np.where(below.any(axis=1), found, hair.length + height[:, -1])
    return np.asarray(np.where(below[:, 0], height[:, 0], found))


def _swing(hair: Hair, sideways: float) -> Vectors:
    """Unit directions (N, 3) that strands swing in at their roots."""
    t = unit(hair.points[:, 1] - hair.points[:, 0])
    outwards = across(hair.comb, t)
    angle = 0.5 * np.pi * sideways
    return np.asarray(np.cos(angle) * outwards + np.sin(angle) * np.cross(t, outwards))
