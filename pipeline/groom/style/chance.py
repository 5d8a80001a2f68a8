"""The random numbers of one operator: they depend on its name, so that others can come and go without changing them."""

from dataclasses import dataclass
from typing import Any
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from pipeline.strands import random

LAYER = 40  # salt of what all operators agree on


@dataclass(frozen=True)
class Chance:
    """Numbers for strands or clumps (N,); `use` tells the uses of one operator apart."""

    seed: int
    name: str
    """Of the operator."""

    @property
    def salt(self) -> int:
        """What tells operators apart in `strands.random`."""
        return crc32(self.name.encode())

    def uniform(self, index: NDArray[Any], use: int) -> NDArray[np.float64]:
        """Uniform in [0, 1)."""
        return random.uniform(self.seed, index, self.salt + use)

    def normal(self, index: NDArray[Any], use: int) -> NDArray[np.float64]:
        """Normal of mean 0 and standard deviation 1."""
        return random.normal(self.seed, index, self.salt + use)

    def directions(self, index: NDArray[Any], use: int) -> NDArray[np.float64]:
        """Three normal numbers (N, 3) for each, from three uses."""
        return np.stack([self.normal(index, use + k) for k in range(3)], axis=1)

    def layer(self, index: NDArray[Any]) -> NDArray[np.float64]:
        """How far out strands lie, the same for every operator: 0 the lowest layer to 1 the outermost."""
        return random.uniform(self.seed, index, LAYER)
