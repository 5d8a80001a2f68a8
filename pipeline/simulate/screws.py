"""Rigid motions and smooth curves through them.

A pose is a rigid map (4, 4), x -> R x + t. A twist (6,) = (omega, v) is what moves with a body: exp of it turns by
|omega| about omega's axis and goes along it, a screw. The curve between two poses g_i, g_j with velocities V_i, V_j
(twists [1/s] in the frame of the body), h apart, is a Bezier curve of the group in cumulative form:

    g(u) = g_i exp(b_1 V_i h/3) exp(b_2 w) exp(b_3 V_j h/3),   b_1 = 1 - (1-u)^3,  b_2 = 3 u^2 - 2 u^3,  b_3 = u^3,

where w makes it end at g_j. It has these poses and velocities at its ends, so that the whole curve has a continuous
velocity; it turns with the frame that poses are written in, world's or body's; where all twists are one screw, it is
that screw. Source: Kim, Kim & Shin, "A General Construction Scheme for Unit Quaternion Curves with Simple High Order
Derivatives" (1995), on rigid motions instead of rotations.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.body.keyed import harmonic

Vector = NDArray[np.float64]
Pose = NDArray[np.float64]

_SMALL = 1e-3  # angles squared below this take a series
_EYE = np.eye(3)


def cross_matrix(vector: Vector) -> Vector:
    """(..., 3, 3) of vectors (..., 3), so that its product with x is vector x x."""
    x, y, z = vector[..., 0], vector[..., 1], vector[..., 2]
    matrix = np.zeros((*vector.shape, 3))
    matrix[..., 0, 1], matrix[..., 0, 2], matrix[..., 1, 2] = -z, y, -x
    matrix[..., 1, 0], matrix[..., 2, 0], matrix[..., 2, 1] = z, -y, x
    return matrix


def rotation_matrix(vector: Vector) -> Vector:
    """The rotation about an axis by an angle, `vector` = axis times angle (..., 3) [rad], (..., 3, 3) (Rodrigues, 1840)."""
    angle = np.sqrt((vector * vector).sum(axis=-1))[..., None, None] + 1e-150  # 0 / 0 is 1 here
    cross = cross_matrix(vector)
    sine = np.sin(angle) / angle
    versine = (np.sin(angle / 2) / angle) ** 2 * 2
    return np.asarray(_EYE + sine * cross + versine * cross @ cross)


def rotation_vector(rotation: Vector) -> Vector:
    """Axis times angle (..., 3) [rad] of rotations (..., 3, 3); the angle is at most pi."""
    from scipy.spatial.transform import Rotation

    flat = Rotation.from_matrix(rotation.reshape(-1, 3, 3)).as_rotvec()
    return np.asarray(flat, np.float64).reshape(rotation.shape[:-1])


def rigid(rotation: Vector, translation: Vector, pivot: Vector | None = None) -> Pose:
    """A turn by the rotation vector `rotation` about `pivot`, then a translation: poses (..., 4, 4)."""
    turn = rotation_matrix(rotation)
    if pivot is not None:
        translation = translation + pivot - _turned(turn, pivot)
    return assembled(turn, translation)


def assembled(rotation: Vector, translation: Vector) -> Pose:
    """Poses (..., 4, 4) of rotations (..., 3, 3) and translations (..., 3)."""
    pose = np.zeros((*rotation.shape[:-2], 4, 4))
    pose[..., :3, :3], pose[..., :3, 3], pose[..., 3, 3] = rotation, translation, 1
    return pose


def inverse(pose: Pose) -> Pose:
    """What takes a rigid motion (..., 4, 4) back."""
    back = np.swapaxes(pose[..., :3, :3], -1, -2)
    return assembled(back, -_turned(back, pose[..., :3, 3]))


def place(pose: Pose, points: NDArray[np.floating]) -> NDArray[np.float64]:
    """Points (..., 3) [m] carried by a pose (4, 4); float64."""
    return np.asarray(points @ pose[:3, :3].T + pose[:3, 3], dtype=np.float64)


def exp(twist: Vector) -> Pose:
    """The rigid motion (..., 4, 4) that a twist (..., 6) makes in one unit of time."""
    omega, v = twist[..., :3], twist[..., 3:]
    square = (omega**2).sum(axis=-1)[..., None, None]
    cross = cross_matrix(omega)
    along = (
        np.eye(3) + np.sinc(np.sqrt(square) / (2 * np.pi)) ** 2 / 2 * cross + _cubic(square) * cross @ cross
    )
    return assembled(rotation_matrix(omega), _turned(along, v))


def log(pose: Pose) -> Vector:
    """The twist (..., 6) of the shortest screw that makes a rigid motion (..., 4, 4)."""
    omega = rotation_vector(pose[..., :3, :3])
    square = (omega**2).sum(axis=-1)[..., None, None]
    cross = cross_matrix(omega)
    back = np.eye(3) - cross / 2 + _quadratic(square) * cross @ cross
    return np.concatenate([omega, _turned(back, pose[..., :3, 3])], axis=-1)


def wound(vector: Vector, near: Vector) -> Vector:
    """The rotation vector (3,) that turns as `vector` does, with so many whole turns that it is next to `near` (3,)."""
    angle, turn = float(np.linalg.norm(vector)), 2 * np.pi
    axis = vector / angle if angle > 1e-9 else near / max(float(np.linalg.norm(near)), 1e-9)
    return np.asarray(vector + turn * np.round((near @ axis - angle) / turn) * axis)


@dataclass(frozen=True)
class Curve:
    """A smooth curve through poses at times; it stands still before the first and after `until`."""

    times: Vector
    """(K,) [s], ascending."""
    poses: Pose
    """(K, ..., 4, 4)"""
    twists: Vector
    """(K-1, 3, ..., 6): V_i h/3, w, V_j h/3 of each piece."""
    velocity: Vector
    """(..., 6) [1/s]: the body's twist at the last pose, with which it goes on."""
    until: float
    """[s]: when it ends, not before the last time."""

    def __call__(self, time: float) -> Pose:
        """The pose (..., 4, 4) at a time [s]; exact at `times`."""
        time = min(max(time, float(self.times[0])), self.until)
        i = int(np.searchsorted(self.times, time, side="right")) - 1
        since = time - float(self.times[i])
        if i == len(self.times) - 1:
            return np.asarray(self.poses[i] @ exp(since * self.velocity) if since > 0 else self.poses[i])
        u = since / float(self.times[i + 1] - self.times[i])
        first, middle, last = self.twists[i]
        begin, end = exp((1 - (1 - u) ** 3) * first), exp(u**3 * last)
        return np.asarray(self.poses[i] @ begin @ exp(u * u * (3 - 2 * u) * middle) @ end)


def curve_of_track(times: Vector, poses: Pose, until: float | None = None) -> Curve:
    """The curve through samples of a motion (K, ..., 4, 4) at ascending times (K,) [s].

    Velocities at samples are those of the parabola through three of them, at the ends those of one piece. It goes on
    with the last velocity up to `until`.
    """
    if len(times) == 1:
        still = np.zeros((*poses.shape[1:-2], 6))
        return Curve(times, poses, np.zeros((0, 3, *still.shape)), still, float(times[0]))
    rate = log(inverse(poses[:-1]) @ poses[1:]) / _each(np.diff(times), poses)
    before, after = (_each(h, poses) for h in (np.diff(times)[:-1], np.diff(times)[1:]))
    inner = (after * rate[:-1] + before * rate[1:]) / (before + after)
    velocity = np.concatenate([rate[:1], inner, rate[-1:]])
    first, last = (_each(np.diff(times) / 3, poses) * V for V in (velocity[:-1], velocity[1:]))
    middle = log(exp(-first) @ inverse(poses[:-1]) @ poses[1:] @ exp(-last))
    end = max(float(times[-1]), until or 0.0)
    return Curve(times, poses, np.stack([first, middle, last], axis=1), velocity[-1], end)


def curve_of_keys(times: Vector, turns: Vector, ways: Vector) -> Curve:
    """The curve through keyframes at times (K,) [s]: rotation vectors (K, 3) [rad] and translations (K, 3) [m].

    It rests at both ends, and never goes past a keyframe: velocities are the harmonic means of Fritsch & Butland
    ("A Method for Constructing Local Monotone Piecewise Cubic Interpolants", 1984), for vectors. Either the rotations
    or the translations must be 0; between two rotations it makes the number of turns that brings it nearest to the
    difference of their vectors: about one axis several turns may be written.
    """
    poses = rigid(turns, ways)
    if len(times) == 1:
        return curve_of_track(times, poses)
    relative = inverse(poses[:-1]) @ poses[1:]
    step = log(relative)
    step[:, :3] = [wound(*pair) for pair in zip(step[:, :3], np.diff(turns, axis=0), strict=True)]
    length = np.diff(times)[:, None]
    velocity = np.zeros((len(times), 6))
    velocity[1:-1] = harmonic(step / length, length)
    first, last = length / 3 * velocity[:-1], length / 3 * velocity[1:]
    middle = log(exp(-first) @ relative @ exp(-last))
    left = (step - first - last)[:, :3]
    middle[:, :3] = [wound(*pair) for pair in zip(middle[:, :3], left, strict=True)]
    return Curve(times, poses, np.stack([first, middle, last], axis=1), velocity[-1], float(times[-1]))


def _cubic(square: Vector) -> Vector:
    """(x - sin x) / x^3 of x^2; by its series where that would cancel."""
    x = np.sqrt(np.maximum(square, _SMALL))
    series = 1 / 6 - square / 120 + square**2 / 5040
    return np.where(square < _SMALL, series, (x - np.sin(x)) / x**3)


def _quadratic(square: Vector) -> Vector:
    """(1 - x/2 cot x/2) / x^2 of x^2; by its series where that would cancel."""
    x = np.sqrt(np.maximum(square, _SMALL))
    series = 1 / 12 + square / 720 + square**2 / 30240
    return np.where(square < _SMALL, series, (1 - x / 2 / np.tan(x / 2)) / x**2)


def _turned(rotation: Vector, vector: Vector) -> Vector:
    return np.asarray((rotation @ vector[..., None])[..., 0])


def _each(values: Vector, poses: Pose) -> Vector:
    """Values (n,) shaped to multiply twists (n, ..., 6)."""
    return values.reshape(-1, *(1,) * (poses.ndim - 2))
