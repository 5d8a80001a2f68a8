"""Smooth noise along strands: a few sines in random directions, which grow from the root on."""

import numpy as np
from numpy.typing import NDArray

from pipeline import kernels
from pipeline.groom.style.chance import Chance
from pipeline.groom.style.hair import Vectors

_USES = 8  # of chance for each sine


def rippled(
    points: Vectors, length: Vectors, period: Vectors, phase: Vectors, swing: Vectors, over: float
) -> Vectors:
    """Points (N, K, 3) [m] plus sum_q swing_q sin(2 pi (s / period_q + phase_q)), growing over `over` [m].

    `period` [m] and `phase` [turns] are (N, Q), `swing` (N, Q, 3) [m].
    """
    waves = np.concatenate([period[..., None], phase[..., None], swing], axis=2)
    return kernels.shaken(points, length, waves, np.full(len(points), over))


def sines(
    chance: Chance, index: NDArray[np.int64], use: int, periods: tuple[float, ...], shares: tuple[float, ...]
) -> tuple[Vectors, Vectors, Vectors]:
    """Periods, phases and swings of sines with these periods [m], give or take 30 %, and shares of the amplitude.

    The sum has a root mean square of 1 [m] over strands.
    """
    uses = [use + _USES * q for q in range(len(periods))]
    period = [p * (0.7 + 0.6 * chance.uniform(index, use)) for p, use in zip(periods, uses, strict=True)]
    phase = [chance.uniform(index, use + 1) for use in uses]
    own = 0.5 + chance.uniform(index, use + 2)  # some strands wriggle more than others: mean square 13 / 12
    scale = np.sqrt(2 / 3 / sum(share**2 for share in shares) * 12 / 13) * own[:, None]
    swing = [
        scale * share * chance.directions(index, use + 3) for share, use in zip(shares, uses, strict=True)
    ]
    return np.stack(period, axis=1), np.stack(phase, axis=1), np.stack(swing, axis=1)
