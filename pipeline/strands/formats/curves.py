"""Cubic curves as files hold them (USD BasisCurves, Alembic ICurves), evaluated to points on them.

A segment is x(u) = (1, u, u^2, u^3) B (c_0, c_1, c_2, c_3) with u from 0 to 1 and B the matrix of its basis. Bezier
segments share one control point, those of a B-spline and of Catmull and Rom's curve three. Wrap: a periodic curve
comes back to its first point; a pinned one begins and ends at its outermost control points, by phantom points
2 c_0 - c_1. Source: the documentation of UsdGeomBasisCurves; Catmull & Rom, "A class of local interpolating splines"
(1974).
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import InputError

Kind = Literal["linear", "bezier", "bspline", "catmullRom"]
Wrap = Literal["nonperiodic", "periodic", "pinned"]
Floats = NDArray[np.float64]
Counts = NDArray[np.int64]

_MATRIX = {
    "bezier": np.array([[1, 0, 0, 0], [-3, 3, 0, 0], [3, -6, 3, 0], [-1, 3, -3, 1.0]]),
    "bspline": np.array([[1, 4, 1, 0], [-3, 0, 3, 0], [3, -6, 3, 0], [-1, 3, -3, 1.0]]) / 6,
    "catmullRom": np.array([[0, 2, 0, 0], [-1, 0, 1, 0], [2, -5, 4, -1], [-1, 3, -3, 1.0]]) / 2,
}
_FLAT = 3e-4  # of a curve's length: what chords between its points may miss of it
_MOST = 32  # points for each segment
_BLOCK = 1 << 14  # segments at a time


@dataclass(frozen=True)
class Curves:
    """Curves of one kind, one after the other; `where` names them in errors."""

    where: str
    points: Floats
    """(N, 3): control points."""
    counts: Counts
    """(S,): control points of each curve; their sum is N."""
    kind: Kind
    wrap: Wrap
    widths: Floats | None = None
    """Diameters: one, one a curve, one a segment's end ("varying") or one a control point ("vertex")."""
    interpolation: str = "vertex"
    """What the widths belong to: "constant", "uniform", "varying" or "vertex"."""

    def __post_init__(self) -> None:
        if (self.counts < 0).any():
            raise InputError(
                f"{self.where}: curve {int(np.argmax(self.counts < 0))} has a negative number of points"
            )
        if int(self.counts.sum()) != len(self.points):
            raise InputError(
                f"{self.where}: its curves have {int(self.counts.sum())} points, but there are {len(self.points)} positions"
            )


def polylines(curves: Curves) -> tuple[Floats, Counts, NDArray[np.float32] | None]:
    """Points (M, 3) on the curves, how many each has (S,), and widths (M,) if there are any.

    Points lie on the curve, ends of segments among them, so near that chords miss it by 3e-4 of its length. A curve
    with too few control points for its basis, or with a number that does not fit it, has none. Raises InputError for
    widths whose number fits nothing.
    """
    widths, vertex = _widths(curves)
    values = np.concatenate([curves.points, vertex[:, None]], axis=1)
    rows, counts, parameter = _linear(curves, values) if curves.kind == "linear" else _cubic(curves, values)
    if curves.widths is None:
        return rows[:, :3], counts, None
    if widths is not None:  # of the ends of segments
        before = parameter.astype(np.int64)
        after = np.minimum(before + 1, len(widths) - 1)
        found = widths[before] + (parameter - before) * (widths[after] - widths[before])
    else:
        found = rows[:, 3]
    return rows[:, :3], counts, np.maximum(found, 0).astype(np.float32)


def segment_counts(curves: Curves) -> Counts:
    """Segments of each curve (S,); 0 where its number of control points does not fit the basis."""
    n, closed = curves.counts, curves.wrap == "periodic"
    if curves.kind == "linear":
        return np.where(n < 2, 0, n if closed else n - 1)
    if curves.kind == "bezier":
        return np.where((n % 3 == 0) & (n >= 3), n // 3, 0) if closed else np.where(n % 3 == 1, n // 3, 0)
    if closed:
        return np.where(n >= 3, n, 0)
    return np.where(n >= 2, n - 1, 0) if curves.wrap == "pinned" else np.maximum(n - 3, 0)


def _widths(curves: Curves) -> tuple[Floats | None, Floats]:
    """Widths of all ends of segments, if the file has such, and those of all control points."""
    widths, nothing = curves.widths, np.zeros(len(curves.points))
    if widths is None or not len(widths):
        return None, nothing
    segments = segment_counts(curves)
    ends = segments + (curves.wrap != "periodic") * (segments > 0)
    if len(widths) == 1:  # also where the file says otherwise, as many files do
        return None, np.full(len(curves.points), widths[0])
    if curves.interpolation == "uniform" and len(widths) == len(curves.counts):
        return None, np.repeat(widths, curves.counts)
    if curves.interpolation == "varying" and len(widths) == ends.sum():
        if curves.wrap != "periodic":
            return widths, nothing
        first = (np.cumsum(ends) - ends)[ends > 0]
        return np.insert(widths, np.cumsum(ends)[ends > 0], widths[first]), nothing  # close the rings
    if curves.interpolation == "vertex" and len(widths) == len(curves.points):
        return None, widths
    wanted = {"constant": 1, "uniform": len(curves.counts), "varying": int(ends.sum())}
    raise InputError(
        f"{curves.where}: {len(widths)} widths with interpolation {curves.interpolation!r}; "
        f"expected {wanted.get(curves.interpolation, len(curves.points))}"
    )


def _linear(curves: Curves, values: Floats) -> tuple[Floats, Counts, Floats]:
    """The points themselves, the first again at the end of a closed curve."""
    n, segments = curves.counts, segment_counts(curves)
    counts = np.where(segments > 0, segments + 1, 0)
    owner, step = _enumerated(counts)
    rows = values[(np.cumsum(n) - n)[owner] + step % np.maximum(n[owner], 1)]
    return rows, counts, np.arange(len(rows), dtype=np.float64)


def _cubic(curves: Curves, values: Floats) -> tuple[Floats, Counts, Floats]:
    segments = segment_counts(curves)
    owner, index = _enumerated(segments)
    blocks = [slice(a, a + _BLOCK) for a in range(0, len(owner), _BLOCK)]
    pieces = _pieces(curves, owner, index, blocks)
    last = index == segments[owner] - 1
    ends = np.cumsum(segments == 0)  # curves without segments have no ends either
    rows, counts, places = [np.empty((0, 4))], pieces + last, [np.empty(0)]
    for block in blocks:
        c = _coefficients(curves, values, owner[block], index[block])
        which, step = _enumerated(counts[block])
        u = (step / pieces[block][which])[:, None]
        rows.append(c[which, 0] + u * (c[which, 1] + u * (c[which, 2] + u * c[which, 3])))
        # The ends of segments of all curves before, of which a curve has one more than segments.
        of = owner[block][which]
        places.append(block.start + which + of - ends[of] + u[:, 0])
    found = np.bincount(owner, counts, len(segments)).astype(np.int64)
    return np.concatenate(rows), found, np.concatenate(places)


def _pieces(curves: Curves, owner: Counts, index: Counts, blocks: list[slice]) -> Counts:
    """Into how many pieces (T,) segments are cut: a chord of n misses |x''| / (8 n^2) at most."""
    second, length = np.zeros(len(owner)), np.zeros(len(owner))
    with np.errstate(all="ignore"):
        for block in blocks:
            c = _coefficients(curves, curves.points, owner[block], index[block])
            bends = np.linalg.norm([c[:, 2], c[:, 2] + 3 * c[:, 3]], axis=2)
            second[block] = 2 * bends.max(axis=0)
            halves = [
                (c[:, 1] + c[:, 2] / 2 + c[:, 3] / 4) / 2,
                (c[:, 1] + 3 / 2 * c[:, 2] + 7 / 4 * c[:, 3]) / 2,
            ]
            length[block] = np.linalg.norm(halves, axis=2).sum(axis=0)
        of_curve = np.bincount(owner, length, len(curves.counts))
        wanted = np.sqrt(second / (8 * _FLAT * of_curve[owner]))
    pieces = np.clip(np.ceil(np.nan_to_num(wanted, nan=1, posinf=1)), 1, _MOST)
    return np.asarray(pieces, np.int64)


def _coefficients(curves: Curves, values: Floats, owner: Counts, index: Counts) -> Floats:
    """Coefficients (T, 4, C) of 1, u, u^2, u^3 of segments, by the curve that they belong to and their place on it."""
    return np.asarray(_MATRIX[curves.kind] @ _controls(curves, values, owner, index))


def _controls(curves: Curves, values: Floats, owner: Counts, index: Counts) -> Floats:
    """Control points (T, 4, C) of segments."""
    n = curves.counts[owner][:, None]
    bezier, pinned = curves.kind == "bezier", curves.wrap == "pinned"
    # A closed curve begins at its first control point, as an open Catmull-Rom curve does at its second.
    before = 0 if bezier or curves.wrap == "nonperiodic" else 1
    place = (3 if bezier else 1) * index[:, None] - before + np.arange(4)
    place = place % n if curves.wrap == "periodic" else np.clip(place, 0, n - 1)
    found = values[(np.cumsum(curves.counts) - curves.counts)[owner][:, None] + place]
    if pinned and not bezier:
        begins, ends = index == 0, index == curves.counts[owner] - 2
        found[begins, 0] = 2 * found[begins, 1] - found[begins, 2]
        found[ends, 3] = 2 * found[ends, 2] - found[ends, 1]
    return found


def _enumerated(counts: Counts) -> tuple[Counts, Counts]:
    """For rows in groups of these sizes: the group of each, and its number in the group."""
    owner = np.repeat(np.arange(len(counts)), counts)
    return owner, np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts)
