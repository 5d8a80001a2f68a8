"""Wind over simulated time: a mean and gusts, a sum of sines whose phases come from the seed.

A function of time alone: no state to save, and the same whatever the order in which it is asked.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from pipeline.config.schema import Air
from pipeline.strands import random

_SALT = 0x57494E44
_WAVES = 12
_OCTAVES = 4.0


def wind(air: Air, seed: int) -> Callable[[float], NDArray[np.float64]]:
    """The wind (3,) [m/s] at a time [s].

    Gusts are isotropic with the root mean square `air.gusts` (of the vector, over long times). Periods run from
    `air.gust_period` down four octaves, in bands of equal ratio; power falls with frequency as f^(-5/3)
    (Kolmogorov 1941), so a band's variance falls as f^(-2/3).
    """
    mean = np.array(air.wind)
    if air.gusts == 0:
        return lambda _: mean
    wave = np.arange(3 * _WAVES, dtype=np.uint32)
    band = np.arange(_WAVES)[None] + random.uniform(seed, wave, _SALT).reshape(3, _WAVES)
    frequency = 2 ** (_OCTAVES * band / _WAVES) / air.gust_period
    phase = 2 * np.pi * random.uniform(seed, wave, _SALT + 1).reshape(3, _WAVES)
    variance = frequency ** (-2 / 3)
    variance *= air.gusts**2 / 3 / variance.sum(axis=1, keepdims=True)
    amplitude = np.sqrt(2 * variance)

    def at(time: float) -> NDArray[np.float64]:
        gust = np.sum(amplitude * np.sin(2 * np.pi * frequency * time + phase), axis=1)
        return np.asarray(mean + gust)

    return at
