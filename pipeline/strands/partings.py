"""Partings: lines on the scalp that hair neither gathers nor blends across.

A parting is a polyline in the scalp's chart. Two roots lie on one side of all partings where the straight way between
them, in the chart, crosses none: of a line that ends on the crown, hair behind its end belongs together.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pipeline import kernels
from pipeline.strands.chart import Chart, Points

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

Vectors = NDArray[np.float64]
Indices = NDArray[np.int64]

NOBODY = -1  # where fewer roots than asked for lie on a root's side
_WIDER = 4  # how many times more roots are looked at where too few are on the side


@dataclass(frozen=True)
class Partings:
    """All partings of a groom, in the head's rest pose."""

    chart: Chart
    lines: tuple[Vectors, ...] = ()
    """Each (N, 2), N >= 2: chart points of a polyline."""

    def __bool__(self) -> bool:
        return bool(self.lines)

    def across(self, roots: Vectors, targets: Vectors, candidate: NDArray[np.integer]) -> NDArray[np.bool_]:
        """Whether the way from each root (N, 2) to its candidates (N, K), rows of targets (M, 2), crosses a parting.

        Roots and targets are chart points. Raises ValueError for shapes or indices that do not fit.
        """
        ways: Indices = np.ascontiguousarray(candidate, np.int64)
        return self._native.across(np.ascontiguousarray(roots), np.ascontiguousarray(targets), ways)

    @cached_property
    def segments(self) -> Vectors:
        """(L, 2, 2): the two ends of every segment of every line."""
        pairs = [np.stack([line[:-1], line[1:]], axis=1) for line in self.lines]
        return np.concatenate([np.zeros((0, 2, 2)), *pairs])

    @cached_property
    def _native(self) -> kernels.PartingLines:
        return kernels.PartingLines(np.ascontiguousarray(self.segments, np.float64))


@dataclass(frozen=True)
class Neighbours:
    """Roots that others look for the nearest of, on their own side of all partings."""

    points: Vectors
    """(M, 3) [m]."""
    partings: Partings

    @cached_property
    def uv(self) -> Vectors:
        """(M, 2): their chart points."""
        return self.partings.chart.uv(self.points)

    @cached_property
    def tree(self) -> "cKDTree":
        """Their places."""
        from scipy.spatial import cKDTree

        return cKDTree(self.points)

    def near(self, points: Points, count: int, enough: int = 1) -> Indices:
        """The nearest roots to each point (N, 3) [m] that no parting lies before, (N, count), nearest first.

        They are those among the `count` nearest; where fewer than `enough` of them are on the point's side, the
        search goes on until there are `enough`, or all have been looked at. `NOBODY` fills up the rows.
        """
        count = min(count, len(self.points))
        enough = min(enough, count)
        found = self._nearest(points, count)
        if not self.partings:
            return found
        uv = self.partings.chart.uv(points)
        own = np.where(self.partings.across(uv, self.uv, found), NOBODY, found)
        found = _first(own, count)
        looked, few = count, np.flatnonzero(found[:, enough - 1] == NOBODY)
        while len(few) and looked < len(self.points):
            looked = min(_WIDER * looked, len(self.points))
            wider = self._nearest(points[few], looked)
            own = np.where(self.partings.across(uv[few], self.uv, wider), NOBODY, wider)
            found[few] = _first(own, count)
            few = few[found[few, enough - 1] == NOBODY]
        return found

    def _nearest(self, points: Points, count: int) -> Indices:
        _, found = self.tree.query(points, count, workers=kernels.threads())
        return np.asarray(found, np.int64).reshape(len(points), count)


def _first(found: Indices, count: int) -> Indices:
    """The first `count` of each row (N, K) that are somebody, in order."""
    gaps = np.flatnonzero((found == NOBODY).any(axis=1))
    order = np.argsort(found[gaps] == NOBODY, axis=1, kind="stable")
    found[gaps] = np.take_along_axis(found[gaps], order, axis=1)
    return found[:, :count]
