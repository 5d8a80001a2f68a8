"""Random numbers as a hash of (seed, strand, salt): strand 123 gets the same number at 1K and at 1M strands.

The mixing function is a 32-bit integer finaliser (xor-shift, multiply, twice), so the numbers do not depend on
the order, the chunks or the machine in which they are asked for.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Index = NDArray[np.integer[Any]]

_PAIR = 0x5BD1  # salt of the second number of a normal


def hashed(seed: int, index: Index, salt: int) -> NDArray[np.uint32]:
    """Hash each index; uint32 of the index's shape."""
    with np.errstate(over="ignore"):
        h = np.asarray(index).astype(np.uint32) * np.uint32(0x9E3779B1)
        h += np.uint32((seed * 0x85EBCA6B + salt * 0xC2B2AE35) & 0xFFFFFFFF)
        for shift, factor in ((16, 0x7FEB352D), (15, 0x846CA68B)):
            h = (h ^ (h >> np.uint32(shift))) * np.uint32(factor)
        return h ^ (h >> np.uint32(16))


def uniform(seed: int, index: Index, salt: int) -> NDArray[np.float64]:
    """Uniform numbers in [0, 1), one for each index; `salt` tells the uses of one strand apart."""
    return hashed(seed, index, salt) / 2.0**32


def normal(seed: int, index: Index, salt: int) -> NDArray[np.float64]:
    """Standard normal numbers (Box and Muller 1958), one for each index."""
    radius = np.sqrt(-2 * np.log1p(-uniform(seed, index, salt)))
    return np.asarray(radius * np.cos(2 * np.pi * uniform(seed, index, salt ^ _PAIR)))
