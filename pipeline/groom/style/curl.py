"""Curl: strands wind in a helix; phase, pitch and handedness belong to a clump, so that neighbours curl together."""

from dataclasses import replace

import numpy as np

from pipeline.config.schema import Curl
from pipeline.groom.style.chance import Chance
from pipeline.groom.style.ground import Ground
from pipeline.groom.style.hair import Hair
from pipeline.groom.style.helix import Coil, coiled

_SHORTEST_PITCH = 1e-3  # [m]
_PITCH, _OWN_PITCH, _PHASE, _OWN_PHASE, _HAND, _RADIUS, _OWN_RADIUS = range(7)  # uses of chance


def curled(hair: Hair, op: Curl, ground: Ground, chance: Chance) -> Hair:
    """Strands wound about themselves."""
    index, lock = hair.index, hair.lock(op.per)
    pitch = ground.values(op.pitch, hair) * (1 + op.pitch_jitter * (2 * chance.uniform(lock, _PITCH) - 1))
    pitch *= 1 + 0.25 * op.strand_jitter * np.clip(chance.normal(index, _OWN_PITCH), -2, 2)
    phase = 2 * np.pi * op.phase_spread * chance.uniform(lock, _PHASE)
    radius = ground.values(op.radius, hair)
    radius = radius * np.clip(1 + op.radius_jitter * chance.normal(lock, _RADIUS), 0.5, 1.5)
    radius *= 1 + op.strand_jitter * (2 * chance.uniform(index, _OWN_RADIUS) - 1)
    hand = np.where(chance.uniform(lock, _HAND) < 0.5, -1.0, 1.0)
    coil = Coil(
        radius=radius,
        pitch=np.maximum(pitch, _SHORTEST_PITCH),
        phase=phase + op.phase_jitter * chance.normal(index, _OWN_PHASE),
        flatness=op.flatness * hand,
        onset=hair.free_from + ground.values(op.onset, hair),
        ramp=np.full(len(hair), op.ramp),
    )
    return replace(hair, points=coiled(hair.points, hair.length, hair.comb, coil))
