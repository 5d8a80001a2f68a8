"""Procedural hair: roots, bristles, the style's operators, equal spacing; chunk by chunk.

A strand depends on the seed, its index and the middles of its clumps alone; the middles are the first strands of
the progressive order and are made first. So any chunking gives the same strands, and memory does not grow.
"""

from collections import deque
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from pipeline.config.schema import Config
from pipeline.groom.combing import MOST_CROWDED, comb, tangential
from pipeline.groom.heads import Head
from pipeline.groom.partings import partings_of
from pipeline.groom.repairs import pushed_out
from pipeline.groom.roots import Factor, place_roots
from pipeline.groom.style.gather import held_in_rings
from pipeline.groom.style.ground import Ground, Terrain
from pipeline.groom.style.hair import LONGEST, Hair, bristles, unit
from pipeline.groom.style.stack import CHUNK, Stack
from pipeline.strands.held import HEAD, held_ends
from pipeline.strands.partings import Neighbours
from pipeline.strands.random import hashed
from pipeline.strands.resample import resampled
from pipeline.strands.strands import Strands

Vectors = NDArray[np.float64]

_WORKERS = 2
_CLEARANCE = 0.8e-3  # [m] between strands and skin
_KEY = 7  # salt
_STRIPS = 20  # across half the chart


class Style:
    """The strands of a config on a head; `strands(first, count)` makes any of them."""

    def __init__(self, config: Config, head: Head) -> None:
        self.groom, self.seed, self.head = config.groom, config.seed, head
        skin = head.fitted_field
        self.partings = partings_of(config, head)
        with ThreadPoolExecutor(1) as beside:
            wall = beside.submit(skin.guarded)
            combing = comb(head, self.partings)
            self.terrain = Terrain(skin, wall.result(), combing)
        density = (Factor(combing.crowding, MOST_CROWDED), Factor(head.density, 1.0))
        self.roots, self.normals = place_roots(self.groom.strands, self.seed, head, density)
        placed = head.to_world(self.roots).astype(np.float32).astype(np.float64)  # as stages will see them
        ground = Ground(self.seed, self.groom.points, self.terrain, head)
        self.stack = Stack(self.groom.style, ground, self._bristles, Neighbours(placed, self.partings))

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
        beside = index[
            self._by_place(index)
        ]  # strands beside each other read the same parts of skin and combing
        hair = self.stack.strands(beside)
        points = hair.points
        points[:, 0] = self.roots[beside]
        points = self._evened(points)
        held = held_ends(np.tile([2, 0], (len(index), 1)), self.groom.points)
        if hair.ties is not None:
            held[held_in_rings(points, hair.ties)] = HEAD
        order = np.argsort(beside)
        return Strands(
            points=self.head.to_world(points).astype(np.float32)[order],
            held=held[order],
            normal=self.normals[index].astype(np.float32),
            key=hashed(self.seed, index, _KEY),
        )

    def _by_place(self, index: NDArray[np.int64]) -> NDArray[np.int64]:
        """An order (N,) of some strands in which neighbours are near each other: strip by strip of the chart."""
        uv = self.head.fitted_chart.uv(self.roots[index])
        return np.argsort(np.round(uv[:, 0] * _STRIPS) * 4 + uv[:, 1], kind="stable")

    def _bristles(self, index: NDArray[np.int64]) -> Hair:
        root, normal = self.roots[index], self.normals[index]
        return Hair(
            index=index,
            root=root,
            normal=normal,
            points=bristles(root, normal),
            length=np.full(len(index), LONGEST),
            comb=unit(tangential(np.broadcast_to([0.0, -1.0, 0.0], root.shape), normal)),
        )

    def _evened(self, points: Vectors) -> Vectors:
        """Points at equal spacing, none of them below the skin."""
        skin = self.terrain.skin
        points, through = pushed_out(resampled(self._outside(points), self.groom.points), skin)
        # Over the sharp edge of a bust both sides push: what cannot leave the skin ends where it enters
        for row in np.flatnonzero(through):
            inside = skin.distance(points[row, 2:]) < 0
            if inside.any():
                left = max(2 + int(inside.argmax()), 3)
                points[row] = resampled(points[row : row + 1, :left], self.groom.points)[0]
        return points

    def _outside(self, points: Vectors) -> Vectors:
        """Points below the skin pushed out of it; roots stay on it."""
        clearance = np.full(points.shape[1], _CLEARANCE)
        clearance[:2] = -np.inf, 0.5 * _CLEARANCE
        return self.terrain.skin.outside(points, clearance, rounds=2)[0]
