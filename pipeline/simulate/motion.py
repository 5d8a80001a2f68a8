"""Poses over simulated time: presets of the head's motion and keyframes.

A pose is a rigid map (4, 4) float64 from the rest pose to world space. Time 0 is the first frame; before it the
head stands still while the hair settles. Every motion is a smooth function of time that starts and ends at rest.
"""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from pipeline.config.schema import Keyframe, Motion

Vector = NDArray[np.float64]
Pose = NDArray[np.float64]
Signal = Callable[[float], float]

_AXES = {"nod": (1.0, 0.0, 0.0), "shake": (0.0, 1.0, 0.0), "turn": (0.0, 1.0, 0.0)}


def rotation_matrix(vector: Vector) -> Vector:
    """The rotation about an axis by an angle, `vector` = axis times angle (3,) [rad], as (3, 3) (Rodrigues, 1840)."""
    angle = float(np.linalg.norm(vector))
    x, y, z = vector
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    sine = np.sinc(angle / np.pi)
    versine = np.sinc(angle / (2 * np.pi)) ** 2 / 2
    return np.asarray(np.eye(3) + sine * cross + versine * cross @ cross)


def rigid(rotation: Vector, translation: Vector, pivot: Vector) -> Pose:
    """A turn by the rotation vector `rotation` about `pivot`, then a translation, as a pose (4, 4)."""
    pose = np.eye(4)
    pose[:3, :3] = rotation_matrix(rotation)
    pose[:3, 3] = pivot + translation - pose[:3, :3] @ pivot
    return pose


def place(pose: Pose, points: NDArray[np.floating]) -> NDArray[np.float64]:
    """Points (..., 3) [m] carried by a pose (4, 4); float64."""
    return np.asarray(points @ pose[:3, :3].T + pose[:3, 3], dtype=np.float64)


def ease(u: float) -> float:
    """From 0 to 1 with zero velocity and acceleration at both ends; clamped outside [0, 1]."""
    u = min(max(u, 0.0), 1.0)
    return u**3 * (10 + u * (6 * u - 15))


def eased_phase(time: float, length: float, ramp: float) -> float:
    """A clock that runs from 0 to `length`: it speeds up over `ramp`, runs true, and slows down over `ramp` [s]."""

    def started(t: float) -> float:
        u = min(max(t / ramp, 0.0), 1.0)
        return ramp * u**4 * (2.5 + u * (u - 3)) + max(t - ramp, 0.0)  # the integral of `ease`

    return started(time) - started(time - length)


def preset_angle(motion: Motion) -> Signal:
    """The angle [rad] of a preset over time [s].

    "nod" and "shake" swing to and fro: the swings are eased in and out by half a swing, so they take
    (swings + 1/2) periods. "turn" turns to one side in one period and stays; a second swing turns back.
    """
    amplitude, period, swings = motion.amplitude, motion.period, motion.swings

    def swing(time: float) -> float:
        return amplitude * float(np.sin(2 * np.pi * eased_phase(time, swings * period, period / 2) / period))

    def turn(time: float) -> float:
        return amplitude * sum((-1.0) ** i * ease(time / period - i) for i in range(swings))

    return turn if motion.preset == "turn" else swing


def keyframe_spline(keyframes: Sequence[Keyframe]) -> Callable[[float], Vector]:
    """Position and rotation vector (6,) over time [s]: exact at the keyframes, smooth, and never past them.

    Monotone cubic pieces (Fritsch & Butland 1984), at rest at both ends and held outside. Rotation vectors are
    interpolated by component: for turns about one axis that is the angle itself, and several turns may be written.
    """
    from scipy.interpolate import PchipInterpolator

    times = [frame.time for frame in keyframes]
    values = [(*frame.position, *frame.rotation) for frame in keyframes]
    spline = PchipInterpolator(  # a held keyframe on either side makes the end velocities zero
        [times[0] - 1, *times, times[-1] + 1], [values[0], *values, values[-1]]
    )
    return lambda time: np.asarray(spline(np.clip(time, times[0], times[-1])), dtype=np.float64)


def head_motion(motion: Motion) -> Callable[[float], Pose]:
    """The head's pose (4, 4) at a time [s]; the first pose before time 0."""
    pivot = np.array(motion.pivot)
    if motion.preset == "none" and not motion.keyframes:
        return lambda _: np.eye(4)
    if not motion.keyframes:
        axis, angle = np.array(_AXES[motion.preset]), preset_angle(motion)
        return lambda time: rigid(axis * angle(time), np.zeros(3), pivot)
    spline = keyframe_spline(motion.keyframes)

    def pose(time: float) -> Pose:
        value = spline(max(time, 0.0))
        return rigid(value[3:], value[:3], pivot)

    return pose


def tip_motion(keyframes: Sequence[Keyframe], centre: Vector, lead: float) -> Callable[[float], Pose]:
    """The pose (4, 4) of the hand that holds pinned tips at a time [s], in the head's frame.

    The tips move as one body that turns about `centre` (3,) [m]. Before time 0 they are brought from where they
    are at rest to their first pose, which they reach `lead` [s] early.
    """
    if not keyframes:
        return lambda _: np.eye(4)
    spline = keyframe_spline(keyframes)

    def pose(time: float) -> Pose:
        value = spline(max(time, 0.0))
        if time < 0 < lead:
            value = value * ease(2 + time / lead)
        return rigid(value[3:], value[:3], centre)

    return pose
