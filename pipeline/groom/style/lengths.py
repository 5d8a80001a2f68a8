"""Length: strands end at an arc length, constant or varying over the scalp."""

from dataclasses import replace

import numpy as np

from pipeline.config.schema import Lengths
from pipeline.groom.style.chance import Chance
from pipeline.groom.style.ground import Ground
from pipeline.groom.style.hair import Hair, cut_to, shortened
from pipeline.strands.spacing import arc_length

SHORTEST = 1e-3  # [m] of what is left of hair that is cut to nothing

_OWN, _RARE = 0, 1  # uses of chance


def lengthened(hair: Hair, op: Lengths, ground: Ground, chance: Chance) -> Hair:
    """Strands cut to their length; those that are shorter stay."""
    own, rare = (chance.uniform(hair.index, use) for use in (_OWN, _RARE))
    wanted = shortened(ground.values(op.length, hair), op.jitter, own, rare)
    length = np.minimum(np.maximum(wanted, SHORTEST), arc_length(hair.points)[:, -1])
    return replace(hair, points=cut_to(hair.points, length, ground.points), length=length)
