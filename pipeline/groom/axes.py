"""Axes of files: inside the pipeline y is up and z points out of the face."""

import numpy as np
from numpy.typing import NDArray


def upright(points: NDArray[np.float64], up_axis: str) -> NDArray[np.float64]:
    """Turn points (N, 3) so that y is up; a file with z up looks along -y, as in Blender."""
    if up_axis == "z":
        return np.asarray(points[:, [0, 2, 1]] * [1.0, 1.0, -1.0])
    if up_axis == "x":
        return np.asarray(points[:, [1, 0, 2]] * [-1.0, 1.0, 1.0])
    return points
