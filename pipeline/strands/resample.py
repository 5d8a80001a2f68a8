"""Strands of any spacing as points at equal spacing along a smooth curve through them.

The curve is the natural cubic spline over chord lengths: twice differentiable, so that it has the curvature that
bending needs, and exactly straight through two points or a straight strand.
"""

import numpy as np
from numpy.typing import NDArray

from pipeline import kernels

Vectors = NDArray[np.float64]


def resampled(points: Vectors, count: int) -> Vectors:
    """Points (S, P, 3) [m] as (S, count, 3) at equal spacing along the smooth curve; root and tip stay.

    Segments of a strand agree to 1e-6 of their length, unless it turns back within one segment.
    """
    return kernels.resampled(np.ascontiguousarray(points, np.float64), count)
