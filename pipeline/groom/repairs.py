"""What real groom files need before they can be simulated, each repair reported by strand index.

Strands with points that are not finite, of almost no length or of far too much are dropped; repeated points
are merged; a strand whose root lies much farther from the head than its tip is turned round; strands that
start inside the head are pushed out of it, so that contact does not throw them out.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from pipeline.groom.head_field import Field
from pipeline.strands.formats import Ragged
from pipeline.strands.resample import resampled

SHORTEST, LONGEST = 1e-3, 10.0  # [m] strands below have no shape, and those above are no hair
_REPEATED = 1e-6  # of a strand's length: points this near are one
_TURNED = 0.01  # [m] how much farther than its tip a root may be from the head
_CLEARANCE = 0.8e-3  # [m] between strands and skin
_ROUNDS = 16  # of pushing: at the sharp edge of a bust both sides push


@dataclass
class Repairs:
    """Indices, in the file, of the strands that were repaired."""

    not_finite: list[int] = field(default_factory=list)
    no_length: list[int] = field(default_factory=list)
    too_long: list[int] = field(default_factory=list)
    merged_points: list[int] = field(default_factory=list)
    turned_round: list[int] = field(default_factory=list)
    pushed_out: list[int] = field(default_factory=list)

    def lines(self) -> list[str]:
        """One line for each kind of repair that was made."""
        told = {
            "not_finite": "dropped, with points that are not finite",
            "no_length": "dropped, with almost no length, or too few points",
            "too_long": f"dropped, longer than {LONGEST:g} m",
            "merged_points": "had repeated points, merged",
            "turned_round": "had root and tip swapped, turned round",
            "pushed_out": "went through the skin, pushed out",
        }
        found = ((getattr(self, name), text) for name, text in told.items())
        return [
            f"{len(which)} strand{'s'[: len(which) - 1]} {text}: {_some(which)}"
            for which, text in found
            if which
        ]


def cleaned(strands: Ragged, repairs: Repairs) -> tuple[Ragged, NDArray[np.int64]]:
    """The strands [m] that have a shape, without repeated points, and which strands of the file they are (S,)."""
    count = len(strands)
    owner = np.repeat(np.arange(count), strands.counts)
    bad = np.zeros(count, bool)
    bad[owner[~_finite(strands.points)]] = True
    step = np.zeros(len(owner))
    step[1:] = _lengths(
        np.diff(strands.points if not bad.any() else _without(strands.points, bad[owner]), axis=0)
    )
    roots = strands.first[strands.counts > 0]
    step[roots] = 0
    length = np.bincount(owner, step, count)
    short, long = ~bad & (length < SHORTEST), length > LONGEST
    repeated = step <= _REPEATED * length[owner]
    repeated[roots] = False
    kept = ~(bad | short | long)
    if kept.all() and not repeated.any():
        return strands, np.arange(count)
    merged = kept & (np.bincount(owner, repeated, count) > 0)
    found = {"not_finite": bad, "no_length": short, "too_long": long, "merged_points": merged}
    for name, which in found.items():
        getattr(repairs, name).extend(np.flatnonzero(which).tolist())
    left = kept[owner] & ~repeated
    counts = np.bincount(owner[left], minlength=count)[kept]
    widths = None if strands.widths is None else strands.widths[left]
    return Ragged(strands.points[left], counts, strands.pins[kept], widths), np.flatnonzero(kept)


def _finite(points: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which points (N, 3) are; column by column, since rows of three are slow to reduce."""
    finite = np.isfinite(points)
    return np.asarray(finite[:, 0] & finite[:, 1] & finite[:, 2])


def _lengths(x: NDArray[np.float64]) -> NDArray[np.float64]:
    with np.errstate(over="ignore"):  # such strands are too long
        return np.asarray(np.sqrt(np.einsum("ni,ni->n", x, x)))


def _without(points: NDArray[np.float64], bad: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Points (N, 3), with those of bad strands at the origin."""
    return np.where(bad[:, None], 0, points)


def turned(root: NDArray[np.float64], tip: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which strands have their root at the wrong end, by the distances (S,) [m] of both ends from the head."""
    return np.asarray(np.abs(root) > np.abs(tip) + _TURNED)


def pushed_out(points: NDArray[np.float64], skin: Field) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Strands (S, P, 3) [m] at equal spacing outside of the skin, and which of them (S,) went through it.

    Roots stay, and the second points that hold their directions: groomers set them into the skin.
    """
    points = points.copy()
    through = np.zeros(len(points), bool)
    rows = np.arange(len(points))
    clearance = np.full(points.shape[1], _CLEARANCE)
    clearance[:2] = -np.inf
    for _ in range(_ROUNDS):  # equal spacing moves points back a little
        moved, depth = skin.outside(points[rows], clearance, rounds=1)
        through[rows] |= depth > _CLEARANCE
        rows, moved = rows[depth > 0], moved[depth > 0]
        if not len(rows):
            break
        points[rows] = resampled(moved, points.shape[1])
    return points, through


def _some(which: list[int], most: int = 10) -> str:
    more = f" and {len(which) - most} more" if len(which) > most else ""
    return ", ".join(map(str, which[:most])) + more
