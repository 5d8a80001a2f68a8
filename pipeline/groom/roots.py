"""Roots on the scalp, in an order whose every prefix is evenly spread.

The R2 sequence (Roberts, "The Unreasonable Effectiveness of Quasirandom Sequences", 2018) in the scalp's equal-area
chart, thinned by the wanted density times r^2 / cos (skin area per chart area) against the candidate's own hash.
So strand i depends on the seed and i alone, not on the count.
"""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline import kernels
from pipeline.groom.head import scalp
from pipeline.groom.heads import Head
from pipeline.strands.random import uniform

Points = NDArray[np.floating[Any]]
Vectors = NDArray[np.float64]

_PLASTIC = 1.32471795724474602596  # the root of x^3 = x + 1
_BATCH = 1 << 17
_SALT = 1


@dataclass(frozen=True)
class Factor:
    """What the density of roots is multiplied by."""

    at: Callable[[Points], Points]
    """Its values (N,) at fitted points (N, 3) on the skin."""
    most: float
    """No value is larger."""


def place_roots(count: int, seed: int, head: Head, density: Sequence[Factor]) -> tuple[Vectors, Vectors]:
    """The first `count` roots (S, 3) [m] on the skin of a head and its unit normals there, in fitted coordinates.

    The density is the product of its factors, of which those that are quick to find come first: candidates that lose by
    them are not asked about the others. It is that of the region, or less, or somewhat more. Raises InputError when
    almost no candidate lands there.
    """
    found: list[tuple[Vectors, Vectors]] = []
    first = total = 0
    batch = min(_BATCH, 8 * count + 4096)
    with ThreadPoolExecutor(kernels.threads()) as pool:
        while total < count:
            begins = first + batch * np.arange(kernels.threads() if batch == _BATCH else 1)
            parts = [pool.submit(_landed, k + np.arange(batch), seed, head, density) for k in begins]
            found.extend(part.result() for part in parts)
            first, total = int(begins[-1]) + batch, sum(len(roots) for roots, _ in found)
            if first > 10_000 and total < first / 10_000:
                raise head.region.nothing()
    roots, normals = (np.concatenate(parts)[:count] for parts in zip(*found, strict=True))
    return roots, normals


def _landed(
    index: NDArray[np.int64], seed: int, head: Head, density: Sequence[Factor]
) -> tuple[Vectors, Vectors]:
    """Those of the candidates that become roots, on the skin, and the normals there."""
    roots = _candidates(index, seed, head, density)
    for _ in range(2):
        d, n = head.fitted_field.sample(roots)
        roots = roots - d[:, None] * n
    on_skin, normals = head.project(roots)
    return np.asarray(on_skin, np.float64), np.asarray(normals, np.float64)


def _candidates(index: NDArray[np.int64], seed: int, head: Head, density: Sequence[Factor]) -> Vectors:
    uv = 2 * ((0.5 + index[:, None] * np.array([1 / _PLASTIC, 1 / _PLASTIC**2])) % 1) - 1
    inside = (uv**2).sum(1) < 1
    index, p = index[inside], scalp.on_skin(head.fitted_field, head.region.disc * uv[inside])
    ray = p - scalp.chart().center
    squares = (ray**2).sum(1)
    cosine = np.maximum((head.fitted_field.sample(p)[1] * ray).sum(1) / np.sqrt(squares), 0.43)
    needed = uniform(seed, index, _SALT) * head.region.highest * cosine / squares
    most = float(np.prod([factor.most for factor in density]))
    for factor in density:
        left = needed < most
        p, most = p[left], most / factor.most
        with np.errstate(divide="ignore", invalid="ignore"):  # no hair where a factor is 0
            needed = needed[left] / factor.at(p)
    return np.asarray(p[needed < 1])
