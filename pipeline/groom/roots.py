"""Roots on the scalp, in an order whose every prefix is evenly spread.

The R2 sequence (Roberts, "The Unreasonable Effectiveness of Quasirandom Sequences", 2018) in the scalp's equal-area
chart, thinned by the wanted density times r^2 / cos (skin area per chart area) against the candidate's own hash.
So strand i depends on the seed and i alone, not on the count.
"""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline import kernels
from pipeline.groom.head import scalp
from pipeline.groom.head_field import Field
from pipeline.groom.region import Region
from pipeline.strands.random import uniform

Points = NDArray[np.floating[Any]]

_PLASTIC = 1.32471795724474602596  # the root of x^3 = x + 1
_BATCH = 1 << 17
_SALT = 1


def place_roots(
    count: int, seed: int, skin: Field, density: Callable[[Points], Points], region: Region
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The first `count` roots (S, 3) [m] on the skin and its unit normals there, in fitted coordinates.

    `density` is that of the region, or less, or somewhat more. Raises InputError when almost no candidate lands there.
    """
    found: list[NDArray[np.float64]] = []
    first = total = 0
    batch = min(_BATCH, 8 * count + 4096)
    with ThreadPoolExecutor(kernels.threads()) as pool:
        while total < count:
            begins = first + batch * np.arange(kernels.threads() if batch == _BATCH else 1)
            parts = [
                pool.submit(_candidates, k + np.arange(batch), seed, skin, density, region) for k in begins
            ]
            found.extend(part.result() for part in parts)
            first, total = int(begins[-1]) + batch, sum(len(p) for p in found)
            if first > 10_000 and total < first / 10_000:
                raise region.nothing()
    roots = np.concatenate(found)[:count]
    for _ in range(2):
        d, n = skin.sample(roots)
        roots = roots - d[:, None] * n
    return roots, skin.sample(roots)[1]


def _candidates(
    index: NDArray[np.int64], seed: int, skin: Field, density: Callable[[Points], Points], region: Region
) -> NDArray[np.float64]:
    uv = 2 * ((0.5 + index[:, None] * np.array([1 / _PLASTIC, 1 / _PLASTIC**2])) % 1) - 1
    inside = (uv**2).sum(1) < 1
    index, p = index[inside], scalp.on_skin(skin, region.disc * uv[inside])
    ray = p - scalp.chart().center
    squares = (ray**2).sum(1)
    cosine = np.maximum((skin.sample(p)[1] * ray).sum(1) / np.sqrt(squares), 0.43)
    kept = uniform(seed, index, _SALT) < density(p) * squares / cosine / region.highest
    return np.asarray(p[kept])
