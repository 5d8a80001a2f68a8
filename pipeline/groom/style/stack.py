"""The stack: operators one after the other, from bristles to a style."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from pipeline.config.schema import (
    Bend,
    Clump,
    Curl,
    Direction,
    Flyaway,
    Fringe,
    Frizz,
    Gather,
    Lengths,
    Operator,
    Trim,
    Wave,
)
from pipeline.groom.style.bend import bent
from pipeline.groom.style.chance import Chance
from pipeline.groom.style.clump import clumped
from pipeline.groom.style.curl import curled
from pipeline.groom.style.direction import directed
from pipeline.groom.style.flyaway import flown
from pipeline.groom.style.fringe import fringed
from pipeline.groom.style.frizz import frizzed
from pipeline.groom.style.gather import gathered
from pipeline.groom.style.ground import Ground
from pipeline.groom.style.hair import Hair, Index, Middles, divided
from pipeline.groom.style.lengths import lengthened
from pipeline.groom.style.locks import Locks, all_locks
from pipeline.groom.style.trim import trimmed
from pipeline.groom.style.wave import waved
from pipeline.strands.partings import Neighbours

CHUNK = 8192  # strands that are carried at once

OPERATORS: dict[type[Operator], Callable[[Hair, Any, Ground, Chance], Hair]] = {
    Direction: directed,
    Lengths: lengthened,
    Trim: trimmed,
    Clump: clumped,
    Curl: curled,
    Wave: waved,
    Frizz: frizzed,
    Flyaway: flown,
    Bend: bent,
    Gather: gathered,
    Fringe: fringed,
}


GROW_ANEW = (Direction, Lengths)  # operators that take no notice of points between root and tip


class Stack:
    """A style on its ground. `start(index)` gives any strands as they are before the first operator."""

    def __init__(
        self,
        style: Mapping[str, Operator],
        ground: Ground,
        start: Callable[[Index], Hair],
        roots: Neighbours,
    ) -> None:
        """Carry the middles of every clump operator, to it; `roots` are those of all strands, in world coordinates.

        A clump operator that is switched off still tells which strands belong together.
        """
        self._steps = [(name, op) for name, op in style.items() if op.enabled]
        self._start = start
        self._locks: dict[str, Locks] = {}
        for name, op in style.items():
            if isinstance(op, Clump):
                parent = self._locks[op.within] if op.within else None
                self._locks[name] = Locks(op.count, roots, parent)
        self._middles: dict[str, Middles] = {}
        self._ground = replace(ground, middles=self._middles)
        for k, (name, op) in enumerate(self._steps):
            if isinstance(op, Clump):
                self._middles[name] = self._carried(np.arange(self._locks[name].count), k)

    def strands(self, index: Index) -> Hair:
        """Strands of these indices (N,), styled."""
        return self._through(index, len(self._steps))

    def _carried(self, index: Index, steps: int) -> Middles:
        """Middles, carried in chunks through the first so many operators."""
        parts = np.array_split(index, -(-len(index) // CHUNK))
        hair = [self._through(part, steps) for part in parts]
        names = ("points", "length", "free_from", "sections")
        return Middles(*(np.concatenate([getattr(part, name) for part in hair]) for name in names))

    def _through(self, index: Index, steps: int) -> Hair:
        hair = self._start(index)
        hair = replace(hair, locks=all_locks(self._locks, index))
        for name, op in self._steps[:steps]:
            if not isinstance(op, GROW_ANEW):
                hair = divided(hair)
            hair = OPERATORS[type(op)](hair, op, self._ground, Chance(self._ground.seed, name))
        return divided(hair)
