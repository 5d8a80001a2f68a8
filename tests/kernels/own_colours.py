"""Strands that each have their own absorption, in the shape that the shading kernels take: a table, and a place in it."""

import numpy as np
from numpy.typing import NDArray

_F32 = NDArray[np.float32]


def own_colours(absorption: _F32) -> tuple[_F32, _F32]:
    """Pigment (2, S, 4) of strands with this absorption (S, 3) [1/radius], and their variation (S, 3)."""
    strands, steps = len(absorption), 1 << len(absorption).bit_length()  # a power of two: places are exact
    pigment = np.ones((2, steps + 1, 4), np.float32)
    pigment[:, :strands, :3] = absorption
    variation = np.zeros((strands, 3), np.float32)
    variation[:, 0], variation[:, 1] = np.arange(strands) / steps, 1
    return pigment, variation
