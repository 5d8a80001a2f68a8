"""Procedural hair: roots -> paths -> cut -> clumps -> curls -> frizz -> equal spacing, chunk by chunk.

A strand depends on the seed, its index and the middles of its clumps alone; the middles are the first strands of
the progressive order and are made first. So any chunking gives the same strands, and memory does not grow.
"""

from collections import deque
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from pipeline.config.schema import Config
from pipeline.groom.curls import curled, frizzed
from pipeline.groom.heads import Head
from pipeline.groom.locks import Bundle, Locks
from pipeline.groom.partings import PartingLine
from pipeline.groom.paths import STEP, Terrain, cut_lengths, grow, traits
from pipeline.groom.repairs import pushed_out
from pipeline.groom.roots import place_roots
from pipeline.strands.held import held_ends
from pipeline.strands.random import hashed, uniform
from pipeline.strands.resample import resampled
from pipeline.strands.strands import Strands

Vectors = NDArray[np.float64]

CHUNK = 8192
_WORKERS = 2
_CLEARANCE = 0.8e-3  # [m] between strands and skin
_FLYAWAY_CLUMPING = 0.15
_KEY, _UNEVEN = 7, 63  # salts


class Style:
    """The strands of a config on a head; `strands(first, count)` makes any of them."""

    def __init__(self, config: Config, head: Head) -> None:
        self.groom, self.seed, self.head = config.groom, config.seed, head
        skin = head.fitted_field
        parting = PartingLine(self.groom.parting, skin) if self.groom.parting.enabled else None
        self.terrain = Terrain(skin, skin.guarded(), parting)
        density = partial(_density, head, parting)
        found, _ = place_roots(self.groom.strands, self.seed, skin, density)
        self.roots, self.normals = (np.asarray(a, np.float64) for a in head.project(found))
        self.side = self.terrain.side(self.roots)
        self.big = Locks(self.groom.big_clumps, self.roots, self.side, salt=70)
        self.small = Locks(self.groom.small_clumps, self.roots, self.side, salt=71)
        self._big_middles = self._smooth(np.arange(self.big.count))
        self._small_middles = self._in_locks(np.arange(self.small.count))

    def chunks(self) -> Iterator[Strands]:
        """All strands, in order; a few chunks are made at once, and no more are kept."""
        starts = iter(range(0, len(self.roots), CHUNK))
        with ThreadPoolExecutor(_WORKERS) as pool:
            made = deque(pool.submit(self.strands, i) for i in islice(starts, _WORKERS))
            while made:
                strands = made.popleft().result()
                made.extend(pool.submit(self.strands, i) for i in islice(starts, 1))
                yield strands

    def strands(self, first: int, count: int = CHUNK) -> Strands:
        """Up to `count` strands from `first` on, in world coordinates."""
        index = np.arange(first, min(first + count, len(self.roots)))
        roots, side = self.roots[index], self.side[index]
        own = traits(self.groom, self.seed, index)
        keep = np.where(own.flyaway, _FLYAWAY_CLUMPING, 1.0)
        bundle, comb = self._combed(index)
        small = self.small.of(roots, side)
        points = self.small.gather(bundle, self._small_middles, small, keep, self.seed, index)
        along = np.linspace(0, 1, self.groom.points) * bundle.length[:, None]
        lock = small if self.groom.curl.shared_by == "small" else self.big.of(roots, side)
        points = curled(self.groom.curl, self.seed, index, lock, points, along, comb)
        points = frizzed(self.groom.frizz, self.seed, index, own.flyaway, points, along)
        points[:, 0] = roots
        points = self._evened(points)
        return Strands(
            points=self.head.to_world(points).astype(np.float32),
            held=held_ends(np.tile([2, 0], (len(index), 1)), self.groom.points),
            normal=self.normals[index].astype(np.float32),
            side=side,
            key=hashed(self.seed, index, _KEY),
        )

    def _smooth(self, index: NDArray[np.int64]) -> Bundle:
        return self._grown(index)[0]

    def _in_locks(self, index: NDArray[np.int64]) -> Bundle:
        parts = [self._combed(part)[0] for part in np.array_split(index, max(len(index) // CHUNK, 1))]
        return Bundle(
            np.concatenate([part.points for part in parts]), np.concatenate([part.length for part in parts])
        )

    def _combed(self, index: NDArray[np.int64]) -> tuple[Bundle, Vectors]:
        """Strands gathered in the big clumps, and their comb directions."""
        bundle, comb = self._grown(index)
        own = traits(self.groom, self.seed, index)
        keep = np.where(own.flyaway, _FLYAWAY_CLUMPING, 1.0)
        lock = self.big.of(self.roots[index], self.side[index])
        points = self.big.gather(bundle, self._big_middles, lock, keep, self.seed, index)
        return Bundle(points, bundle.length), comb

    def _grown(self, index: NDArray[np.int64]) -> tuple[Bundle, Vectors]:
        if len(index) == 0:
            return Bundle(np.zeros((0, self.groom.points, 3)), np.zeros(0)), np.zeros((0, 3))
        paths = grow(self.groom, self.seed, index, self.roots[index], self.normals[index], self.terrain)
        lock = self.big.of(self.roots[index], self.side[index])
        uneven = self.groom.cut.uneven * (2 * uniform(self.seed, lock, _UNEVEN) - 1)
        length = cut_lengths(self.groom, self.seed, index, paths, uneven)
        place = np.linspace(0, 1, self.groom.points) * length[:, None] / STEP
        i = np.minimum(place.astype(np.int64), paths.points.shape[1] - 2)
        u = (place - i)[..., None]
        row = np.arange(len(index))[:, None]
        return Bundle(paths.points[row, i] * (1 - u) + paths.points[row, i + 1] * u, length), paths.comb

    def _evened(self, points: Vectors) -> Vectors:
        """Points at equal spacing, none of them below the skin."""
        points = resampled(self._outside(points), self.groom.points)
        return pushed_out(points, self.terrain.skin)[0]

    def _outside(self, points: Vectors) -> Vectors:
        """Points below the skin pushed out of it; roots stay on it."""
        lowest = np.full(points[:, 1:].shape[:2], _CLEARANCE)
        lowest[:, 0] *= 0.5
        for _ in range(2):
            p = points[:, 1:].reshape(-1, 3)
            d, n = self.terrain.skin.sample(p)
            depth = np.maximum(lowest.ravel() - d, 0)
            points[:, 1:] = (p + depth[:, None] * n).reshape(points[:, 1:].shape)
        return points


def _density(head: Head, parting: PartingLine | None, p: Vectors) -> Vectors:
    """Relative density of roots at points on the skin."""
    crowding = parting.crowding(p) if parting else 1.0
    return np.asarray(head.density(p) * crowding, np.float64)
