"""Axes of files: inside the pipeline y is up, z points out of the face and x to the head's left."""

import numpy as np
from numpy.typing import NDArray

_FACES = {"x": "z", "y": "z", "z": "-y"}  # where a face looks unless it is told; with z up as in Blender


def upright(points: NDArray[np.float64], up_axis: str, face_axis: str | None = None) -> NDArray[np.float64]:
    """Turn points (N, 3) so that y is up and the face looks along z."""
    turn = _turn(up_axis, face_axis)
    return points if np.array_equal(turn, np.eye(3)) else np.asarray(points @ turn)


def file_axis(direction: NDArray[np.float64], up_axis: str, face_axis: str | None = None) -> str:
    """Which axis of the file a direction (3,) along one of the pipeline's axes was."""
    was = _turn(up_axis, face_axis) @ direction
    index = int(np.abs(was).argmax())
    return ("-" if was[index] < 0 else "") + "xyz"[index]


def _turn(up_axis: str, face_axis: str | None) -> NDArray[np.float64]:
    """Columns: the head's left, up and the face's direction, in the file's axes."""
    up, face = _axis(up_axis), _axis(face_axis or _FACES[up_axis])
    return np.stack([np.cross(up, face), up, face], axis=1)


def _axis(name: str) -> NDArray[np.float64]:
    return np.asarray((-1.0 if name[0] == "-" else 1.0) * np.eye(3)["xyz".index(name[-1])])
