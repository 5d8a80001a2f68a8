"""Equal spacing along a strand: every segment of a strand has the same length."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Points = NDArray[np.floating[Any]]

_FINE = 1 << 40  # parts of a strand that are told apart


def arc_length(points: Points) -> NDArray[np.float64]:
    """Arc length (S, P) [m] from the root to each point of (S, P, 3) [m]."""
    lengths = np.zeros(points.shape[:2])
    lengths[:, 1:] = np.cumsum(np.linalg.norm(np.diff(points, axis=1), axis=2), axis=1)
    return lengths


def segments_at(lengths: NDArray[np.float64], wanted: NDArray[np.float64]) -> NDArray[np.int64]:
    """Segment (S, Q) of each strand that holds the wanted arc lengths (S, Q) [m], by `arc_length(points)`."""
    strands, count = lengths.shape
    row = np.arange(strands)[:, None]
    whole = np.maximum(lengths[:, -1:], 1e-300)
    # In a row, so that one search serves all; in whole numbers, so that a strand's place in it changes nothing.
    along, sought = ((at / whole * _FINE).astype(np.int64) + 2 * _FINE * row for at in (lengths, wanted))
    left = np.searchsorted(along.ravel(), sought.ravel(), "right").reshape(wanted.shape) - 1 - row * count
    return np.asarray(np.clip(left, 0, count - 2))


def at_arc_length(points: Points, lengths: NDArray[np.float64], wanted: NDArray[np.float64]) -> Points:
    """Points (S, Q, 3) on the polylines at arc lengths (S, Q) [m], clamped to their ends.

    `lengths` is `arc_length(points)`; root and tip stay where they are. Whatever else is given at the points, as
    (S, P, K), is interpolated in the same way.
    """
    wanted = np.clip(wanted, 0, lengths[:, -1:])
    left = segments_at(lengths, wanted) + np.arange(len(lengths))[:, None] * lengths.shape[1]
    flat = lengths.ravel()
    span = np.maximum(flat[left + 1] - flat[left], 1e-12)
    weight = np.clip((wanted - flat[left]) / span, 0, 1)[..., None]
    p = points.reshape(-1, points.shape[2])
    return np.asarray(p[left] * (1 - weight) + p[left + 1] * weight)
