"""What real groom files need before they can be simulated, each repair reported by strand index.

Strands with points that are not finite, or of almost no length, are dropped; repeated points are merged; a strand
whose root lies much farther from the head than its tip is turned round; strands of uneven spacing are resampled.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from pipeline.strands.formats import Ragged

_SHORTEST = 1e-3  # [m] strands below this have no shape
_TURNED = 0.01  # [m] how much farther than its tip a root may be from the head


@dataclass
class Repairs:
    """Indices, in the file, of the strands that were repaired."""

    not_finite: list[int] = field(default_factory=list)
    no_length: list[int] = field(default_factory=list)
    merged_points: list[int] = field(default_factory=list)
    turned_round: list[int] = field(default_factory=list)
    pushed_out: list[int] = field(default_factory=list)

    def lines(self) -> list[str]:
        """One line for each kind of repair that was made."""
        told = {
            "not_finite": "dropped, with points that are not finite",
            "no_length": "dropped, with almost no length",
            "merged_points": "had repeated points, merged",
            "turned_round": "had root and tip swapped, turned round",
            "pushed_out": "went through the skin, pushed out",
        }
        found = ((getattr(self, name), text) for name, text in told.items())
        return [f"{len(which)} strands {text}: {_some(which)}" for which, text in found if which]


def cleaned(strands: Ragged, repairs: Repairs) -> tuple[list[NDArray[np.float64]], NDArray[np.int64]]:
    """Polylines (n, 3) [m] that have a shape, and which strands of the file they are (S,)."""
    kept: list[NDArray[np.float64]] = []
    index: list[int] = []
    finite = np.isfinite(strands.points).all(axis=1)
    for i, (first, count) in enumerate(zip(strands.first, strands.counts, strict=True)):
        points = strands.points[first : first + count]
        if not finite[first : first + count].all():
            repairs.not_finite.append(i)
            continue
        steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
        if steps.sum() < _SHORTEST:
            repairs.no_length.append(i)
            continue
        distinct = np.r_[True, steps > 1e-6 * steps.sum()]
        if not distinct.all():
            repairs.merged_points.append(i)
            points = points[distinct]
        kept.append(points)
        index.append(i)
    return kept, np.array(index, np.int64)


def turned(root: NDArray[np.float64], tip: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which strands have their root at the wrong end, by the distances (S,) [m] of both ends from the head."""
    return np.asarray(root > tip + _TURNED)


def _some(which: list[int], most: int = 10) -> str:
    more = f" and {len(which) - most} more" if len(which) > most else ""
    return ", ".join(map(str, which[:most])) + more
