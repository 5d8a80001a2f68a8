"""Strands: the one value that stages exchange."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import InputError


@dataclass(frozen=True)
class Strands:
    """Rest shapes of strands, root first, at equal spacing, in an order whose every prefix is a valid groom.

    Raises InputError when the arrays do not fit each other, are not finite, or a strand has no length.
    """

    points: NDArray[np.float32]
    """(S, P, 3) [m], in the head's rest pose."""
    held: NDArray[np.uint8]
    """(S, P): 0 free, 1 held by the head, 2 held by the hand; two held points at the root are a clamp."""
    normal: NDArray[np.float32]
    """(S, 3): unit normal of the scalp at the root."""
    key: NDArray[np.uint32]
    """(S,): random key, derived from seed and strand."""

    def __post_init__(self) -> None:
        count = len(self.points)
        shapes = {"held": self.points.shape[:2], "normal": (count, 3), "key": (count,)}
        for name, shape in shapes.items():
            if getattr(self, name).shape != shape:
                raise InputError(f"strands: {name} has shape {getattr(self, name).shape}, expected {shape}")
        if self.points.ndim != 3 or self.points.shape[2] != 3 or self.points.shape[1] < 2:
            raise InputError(f"strands: points have shape {self.points.shape}, expected (S, P, 3)")
        if not np.isfinite(self.points).all():
            bad = int(np.flatnonzero(~np.isfinite(self.points).all(axis=(1, 2)))[0])
            raise InputError(f"strands: strand {bad} has a point that is not finite")
        if count and self.length.min() <= 0:
            raise InputError(f"strands: strand {int(self.length.argmin())} has no length")

    def __len__(self) -> int:
        return len(self.points)

    def __getitem__(self, rows: slice) -> "Strands":
        """A part of the strands."""
        return Strands(self.points[rows], self.held[rows], self.normal[rows], self.key[rows])

    @property
    def length(self) -> NDArray[np.float32]:
        """(S,) float32 [m]: arc length."""
        segments = np.diff(self.points, axis=1)
        return np.asarray(np.sqrt(np.einsum("spk,spk->sp", segments, segments)).sum(axis=1))

    @property
    def spacing(self) -> NDArray[np.float32]:
        """(S,) float32 [m]: mean length of a segment."""
        return self.length / np.float32(self.points.shape[1] - 1)
