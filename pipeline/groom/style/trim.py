"""Trim: strands end where they leave a half space or a sphere, as under scissors.

The hemline is uneven on purpose: layers are cut deeper, clumps are longer or shorter, and every strand has its own
jitter. Below the jaw a strand is measured as if it hung straight down, so that what lies on the shoulders is as long
as what hangs beside them.
"""

from dataclasses import replace

import numpy as np

from pipeline import kernels
from pipeline.config.schema import Trim
from pipeline.groom.style.chance import Chance
from pipeline.groom.style.ground import Ground
from pipeline.groom.style.growth import JAW
from pipeline.groom.style.hair import Hair, Vectors, cut_to, shortened

_OWN, _RARE, _UNEVEN = 0, 1, 2  # uses of chance


def trimmed(hair: Hair, op: Trim, ground: Ground, chance: Chance) -> Hair:
    """Strands without what lies outside, but never shorter than `shortest`."""
    uneven = op.uneven * (2 * chance.uniform(hair.lock(op.per), _UNEVEN) - 1)
    inside = op.layers * chance.layer(hair.index) ** 2 - uneven
    own, rare = (chance.uniform(hair.index, use) for use in (_OWN, _RARE))
    length = shortened(_lengths(hair, op, inside), op.jitter, own, rare)
    length = np.clip(length, np.minimum(op.shortest, hair.length), hair.length)
    return replace(hair, points=cut_to(hair.points, length, ground.points), length=length)


def _lengths(hair: Hair, op: Trim, inside: Vectors) -> Vectors:
    """Arc length (N,) [m] at which strands first come to `inside` (N,) [m] of the surface; all of it if they do not."""
    if op.sphere is not None:
        shape = np.array([*op.sphere.centre, op.sphere.radius])
        return kernels.first_outside(hair.points, -inside, shape, True, -np.inf)
    plane = np.array([0.0, -1.0, np.tan(op.slope), op.height or 0.0])
    return kernels.first_outside(hair.points, -inside, plane, False, JAW if op.hanging else -np.inf)
