"""Equal spacing along a strand: every segment of a strand has the same length."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

Points = NDArray[np.floating[Any]]


def arc_length(points: Points) -> NDArray[np.float64]:
    """Arc length (S, P) [m] from the root to each point of (S, P, 3) [m]."""
    lengths = np.zeros(points.shape[:2])
    lengths[:, 1:] = np.cumsum(np.linalg.norm(np.diff(points, axis=1), axis=2), axis=1)
    return lengths
