"""Expansion: every strand's own rest shape, moved by the guides that it is bound to.

Guides hand on rotations, never positions (tangent rotation): a strand keeps its length and its curls whatever
its guides do. Memory is that of the binding; points exist for one chunk of strands at a time.
Source: Hsu et al., "Real-time Physically Guided Hair Interpolation" (ACM TOG 43, 2024) for the problem; the
method is its discrete relative for inextensible strands, measured against a rod solver.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline import kernels

Points = NDArray[np.float32]

_SOME = 1000  # strands that tell a mean


@dataclass(frozen=True)
class Binding:
    """What the full count of strands needs beside the groom: whose shape, where, which guides, how varied.

    A strand whose parent is its own index is that groom strand, as groomed; every other is a varied copy.
    """

    parent: NDArray[np.uint32]
    """(N,): groom strand whose rest shape it takes."""
    root: NDArray[np.float32]
    """(N, 3) [m]: root in the head's rest pose."""
    guide: NDArray[np.uint32]
    """(N, k): the guides that it follows, greatest weight first."""
    weight: NDArray[np.float32]
    """(N, k): their weights; the sum is 1."""
    key: NDArray[np.uint32]
    """(N,): random key."""
    scale: NDArray[np.float32]
    """(N,): length as a fraction of the parent's."""
    phase: NDArray[np.float32]
    """(N,) [rad]: turn of the curl about the strand's smoothed direction."""

    def __len__(self) -> int:
        return len(self.parent)


@dataclass(frozen=True)
class Style:
    """How copies differ from their parents, and how near to the skin strands may come."""

    skin: float = 0.5e-3
    """Distance [m] that strands keep from the head; reached gently from the root on."""
    clump: float = 0.0
    """Part of the distance to its parent that a copy loses towards the tip."""
    frizz: float = 0.0
    """Amplitude [rad] of smooth noise on the directions of a copy's segments."""


@dataclass(frozen=True)
class MovedSkin:
    """A skin that has moved against the head's rest frame."""

    roots: Points
    """(N, 3) float32 [m]: where it has carried the root of every strand."""
    field: kernels.DistanceField
    """Distance to it."""


class Expansion:
    """All strands of one moment, chunk by chunk: `frame` sets the moment, `chunk` gives strands a to b.

    A strand's points depend neither on the chunk that it is asked in nor on the number of threads, to the bit.
    Before the first `frame` everything is at rest.
    """

    def __init__(
        self,
        rest: Points,
        guide_rest: Points,
        binding: Binding,
        field: kernels.DistanceField | None = None,
        style: Style | None = None,
    ) -> None:
        """Bind strands to guides.

        Args:
            rest: (S, P, 3) float32 [m], the groom in the head's rest pose; every parent is a row of it.
            guide_rest: (G, Q, 3) float32 [m], the guides at rest, in the order of `guides.h5`.
            binding: the full count of strands, N.
            field: distance to the head in its rest frame; None where there is no head.
            style: variation of copies and distance from the skin.

        Raises:
            ValueError: shapes that do not fit, or an index beyond the groom or the guides.

        """
        style = style or Style()
        self.count, self.points = len(binding), rest.shape[1]
        self._rest, self._guide_rest, self._field = rest, guide_rest, field
        self._strands = kernels.BoundStrands(
            binding.parent,
            binding.root,
            binding.guide,
            binding.weight,
            binding.key,
            binding.scale,
            binding.phase,
        )
        self._style = kernels.ExpandStyle(style.skin, style.clump, style.frizz)
        self.frame(guide_rest, np.eye(4))

    @property
    def length(self) -> float:
        """Mean length [m] of the groom's strands at rest, of some of them where they are many."""
        some = self._rest[:: max(len(self._rest) // _SOME, 1)]
        return float(np.linalg.norm(np.diff(some, axis=1), axis=-1).sum(axis=1, dtype=np.float64).mean())

    def frame(self, guide_points: Points, pose: NDArray[np.float64], skin: "MovedSkin | None" = None) -> None:
        """Go to a moment: guides (G, Q, 3) float32 [m] in the world, pose (4, 4) head's rest frame -> world.

        `skin` is the head's where it is not as at rest.
        """
        self._motion = kernels.GuideMotion(self._guide_rest, guide_points, pose, skin.roots if skin else None)
        self._moment_field = skin.field if skin else self._field

    def chunk(self, a: int, b: int, out: Points | None = None) -> Points:
        """Points of strands a to b, (b-a, P, 3) float32 [m] in the world; written to `out` when it is given.

        Raises IndexError when a to b is not within 0 to `count`, ValueError when `out` does not fit.
        """
        if not 0 <= a <= b <= self.count:
            raise IndexError(f"strands {a} to {b} of {self.count}")
        if out is None:
            out = np.empty((b - a, self.points, 3), np.float32)
        if out.shape != (b - a, self.points, 3):
            raise ValueError(f"out has shape {out.shape}, expected {(b - a, self.points, 3)}")
        kernels.expand(self._rest, self._strands, self._motion, self._moment_field, self._style, a, out)
        return out
