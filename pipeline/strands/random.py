"""Random numbers as a hash of (seed, strand, salt): strand 123 gets the same number at 1K and at 1M strands.

The mixing function is a 32-bit integer finaliser (xor-shift, multiply, twice), so the numbers do not depend on
the order, the chunks or the machine in which they are asked for.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline import kernels

Index = NDArray[np.integer[Any]]

_PAIR = 0x5BD1  # salt of the second number of a normal


def hashed(seed: int, index: Index, salt: int) -> NDArray[np.uint32]:
    """Hash each index; uint32 of the index's shape."""
    flat = np.ascontiguousarray(np.ravel(index).astype(np.uint32))
    return kernels.hashed(flat, _word(seed, salt)).reshape(np.shape(index))


def uniform(seed: int, index: Index, salt: int) -> NDArray[np.float64]:
    """Uniform numbers in [0, 1), one for each index; `salt` tells the uses of one strand apart.

    >>> alone, among_others = uniform(1, np.array([123]), 7), uniform(1, np.arange(1000), 7)
    >>> bool(alone[0] == among_others[123])
    True
    """
    return hashed(seed, index, salt) / 2.0**32


def normal(seed: int, index: Index, salt: int) -> NDArray[np.float64]:
    """Standard normal numbers (Box and Muller 1958), one for each index."""
    flat = np.ascontiguousarray(np.ravel(index).astype(np.uint32))
    numbers = kernels.normal(flat, _word(seed, salt), _word(seed, salt ^ _PAIR))
    return numbers.reshape(np.shape(index))


def _word(seed: int, salt: int) -> int:
    """What is added to the scrambled index: 32 bits of the seed and the salt."""
    return (seed * 0x85EBCA6B + salt * 0xC2B2AE35) & 0xFFFFFFFF
