"""Poses over simulated time: presets of the head's motion, keyframes and files of transforms.

A pose is a rigid map (4, 4) float64 from the rest pose to world space. Time 0 is the first frame; before it the
head stands still while the hair settles. Presets and keyframes start and end at rest; a file moves as it does, and is
held after its last sample. Between samples of a file the head moves on a smooth curve of screws, between keyframes the
pivot on a smooth curve in space and the head about it on one of rotations (screws.py).

Where the head jumps (teleport) its motion is one of several pieces, each smooth in itself: the piece before the jump
goes on with its last velocity until then, and the strands are carried over rigidly.
"""

from bisect import bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pipeline.body.placement import Placement
from pipeline.cache.transforms import read_transforms
from pipeline.config.schema import Keyframe, Motion, Simulate
from pipeline.errors import InputError
from pipeline.simulate.screws import (
    Pose,
    Vector,
    curve_of_keys,
    curve_of_track,
    inverse,
    rigid,
    rotation_vector,
)

Signal = Callable[[float], float]
Poses = Callable[[float], Pose]

_AXES = {"nod": (1.0, 0.0, 0.0), "shake": (0.0, 1.0, 0.0), "turn": (0.0, 1.0, 0.0)}
_NECK = (0.0, -0.05, -0.015)  # [m] on the built-in head: what a head turns about unless it is told
_HALF_TURN = np.radians(170)  # from sample to sample: beyond it one cannot tell which way round
_SOON = 1e-6  # [s] times this near are one


@dataclass(frozen=True)
class HeadMotion:
    """The head's pose over time, in pieces between which it jumps."""

    starts: tuple[float, ...]
    """[s]: when each piece begins; the first at minus infinity."""
    pieces: tuple[Poses, ...]
    """Pose (4, 4) at a time [s]."""

    def piece(self, time: float) -> Poses:
        """The piece that holds from a time [s] on."""
        return self.pieces[bisect_right(self.starts, time + _SOON) - 1]

    def __call__(self, time: float) -> Pose:
        """The pose (4, 4) at a time [s]; where the head jumps, the one after it."""
        return self.piece(time)(time)


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


def head_motion(motion: Motion, fps: float = 24.0, head: Placement | None = None) -> HeadMotion:
    """The head's motion; `fps` counts the frames of a file and of jumps. Raises InputError for a file that fails."""
    pivot = np.array(motion.pivot) if motion.pivot is not None else (head or Placement()).world(_NECK)
    if motion.file is not None:
        return _track(motion, Path(motion.file), pivot, fps)
    if motion.keyframes:
        return _keyed(motion, pivot, fps)
    if motion.preset == "none":
        return HeadMotion((-np.inf,), (lambda _: np.eye(4),))
    axis, angle = np.array(_AXES[motion.preset]), preset_angle(motion)
    return HeadMotion((-np.inf,), (lambda time: rigid(axis * angle(time), np.zeros(3), pivot),))


def _keyed(motion: Motion, pivot: Vector, fps: float) -> HeadMotion:
    jumps = [(frame - 1) / fps for frame in sorted(motion.teleport)]
    groups = [
        [key for key in motion.keyframes if after - _SOON <= key.time < before - _SOON]
        for after, before in zip([-np.inf, *jumps], [*jumps, np.inf], strict=True)
    ]
    if not all(groups):
        raise InputError("simulate.motion.teleport: no keyframe between two jumps; each needs one after it")
    return HeadMotion((-np.inf, *jumps), tuple(keyed_path(keys, pivot) for keys in groups))


def keyed_path(keyframes: Sequence[Keyframe], pivot: Vector) -> Poses:
    """Pose (4, 4) at a time [s]: exact at the keyframes, smooth, never past them, held outside; first pose before 0."""
    times = np.array([key.time for key in keyframes])
    turns, ways = (np.array([getattr(key, name) for key in keyframes]) for name in ("rotation", "position"))
    turn, way = curve_of_keys(times, turns, 0 * ways), curve_of_keys(times, 0 * turns, ways)

    def pose(time: float) -> Pose:
        time = max(time, 0.0)
        return rigid(np.zeros(3), way(time)[:3, 3] + pivot) @ turn(time) @ rigid(np.zeros(3), -pivot)

    return pose


def _track(motion: Motion, path: Path, pivot: Vector, fps: float) -> HeadMotion:
    times, poses = read_transforms(path, fps, motion.unit_scale)
    jumps = [(frame - 1) / fps for frame in motion.teleport]
    if motion.teleport_beyond is not None:
        pivots = poses[:, :3, :3] @ pivot + poses[:, :3, 3]
        far = np.linalg.norm(np.diff(pivots, axis=0), axis=1) > motion.teleport_beyond
        jumps += times[1:][far].tolist()
    starts = [float(times[0]), *sorted({time for time in jumps if times[0] < time <= times[-1]})]
    firsts = np.searchsorted(times, np.array(starts) - _SOON)
    pieces = []
    for first, last, end in zip(firsts, [*firsts[1:], len(times)], [*starts[1:], times[-1]], strict=True):
        pieces.append(_one_piece(path, times[first:last], poses[first:last], end))
    return HeadMotion((-np.inf, *starts[1:]), tuple(pieces))


def _one_piece(path: Path, times: Vector, poses: Pose, until: float | None = None) -> Poses:
    """The smooth curve through samples of a file; what it is at time 0 before that."""
    _refuse_half_turns(path, times, poses)
    curve = curve_of_track(times, poses, until)
    return lambda time: curve(max(time, 0.0))


def _refuse_half_turns(path: Path, times: Vector, poses: Pose) -> None:
    angle = np.linalg.norm(rotation_vector((inverse(poses[:-1]) @ poses[1:])[:, :3, :3]), axis=1)
    wide = np.flatnonzero(angle > _HALF_TURN)
    if len(wide):
        raise InputError(
            f"{path}: it turns by {np.degrees(angle[wide[0]]):.0f} degrees up to the sample at "
            f"{times[wide[0] + 1]:g} s, and one cannot tell which way round; write more samples, or name the frame "
            "in simulate.motion.teleport"
        )


def hand_motion(simulate: Simulate, centre: Vector) -> Poses:
    """The pose (4, 4) of the hand that holds pinned tips at a time [s], in the head's frame.

    The tips move as one body that turns about `centre` (3,) [m]. In the second quarter of the settling they are brought
    from where they are at rest to their first pose. Raises InputError for a file that fails.
    """
    if simulate.tips_file is not None:
        path = _one_piece(Path(simulate.tips_file), *read_transforms(Path(simulate.tips_file), simulate.fps))
        first = rigid(np.zeros(3), -centre) @ path(0.0) @ rigid(np.zeros(3), centre)
        start = np.concatenate([rotation_vector(first[:3, :3]), first[:3, 3]])
    elif simulate.tips:
        path = keyed_path(simulate.tips, centre)
        start = np.array([*simulate.tips[0].rotation, *simulate.tips[0].position])
    else:
        return lambda _: np.eye(4)
    lead = simulate.settle / 2

    def pose(time: float) -> Pose:
        if time < 0 < lead:
            part = ease(2 + time / lead)
            return rigid(part * start[:3], part * start[3:], centre)
        return path(time)

    return pose
