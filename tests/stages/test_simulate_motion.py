"""The head's motion: exact at its keyframes, smooth, at rest at both ends."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from pipeline.config.schema import Keyframe, Motion, Simulate
from pipeline.simulate.motion import hand_motion, head_motion
from pipeline.simulate.screws import place, rotation_matrix

PRESETS = ("nod", "shake", "turn")
STEP = 1e-5  # of the difference quotients [s]


def speed(pose, time: float) -> float:
    """Largest velocity of a point 10 cm from the origin."""
    tip = np.array([0.1, 0.1, 0.1])
    return float(np.linalg.norm(place(pose(time + STEP), tip) - place(pose(time - STEP), tip)) / (2 * STEP))


@pytest.mark.parametrize("preset", PRESETS)
def test_presets_start_and_stop_with_zero_velocity(preset: str) -> None:
    motion = Motion(preset=preset, period=1.0, swings=2)
    pose = head_motion(motion)
    end = 2.0 if preset == "turn" else 2.5
    start, stop = speed(pose, 0.0), speed(pose, end)
    fastest = max(speed(pose, time) for time in np.linspace(0, end, 101))
    print(f"{preset}: {start:.1e} m/s at the start, {stop:.1e} at the stop, {fastest:.2f} between")
    assert max(start, stop) < 1e-6 < 0.1 < fastest
    assert np.array_equal(pose(-1.0), np.eye(4))
    assert np.allclose(pose(end), pose(end + 10), atol=1e-12)


@pytest.mark.parametrize("preset", PRESETS)
def test_presets_reach_their_amplitude_and_no_more(preset: str) -> None:
    pose = head_motion(Motion(preset=preset, amplitude=0.8, period=1.0, swings=3))
    traces = [np.trace(pose(time)[:3, :3]) for time in np.linspace(0, 4, 4001)]
    widest = float(np.arccos((min(traces) - 1) / 2))
    print(f"{preset}: widest angle {widest:.6f} rad of 0.8")
    assert widest == pytest.approx(0.8, abs=1e-5)


def test_pivot_stays_where_it_is() -> None:
    pivot = (0.01, -0.05, 0.02)
    pose = head_motion(Motion(preset="shake", pivot=pivot))
    drift = max(np.abs(place(pose(t), np.array(pivot)) - pivot).max() for t in np.linspace(0, 3, 31))
    print(f"pivot moves {drift:.1e} m")
    assert drift < 1e-15


KEYFRAMES = (
    Keyframe(time=0.5, position=(0.0, 0.0, 0.0), rotation=(0.0, 0.0, 0.0)),
    Keyframe(time=1.0, position=(0.1, 0.0, 0.02), rotation=(0.0, 2.0, 0.1)),
    Keyframe(time=1.2, position=(0.1, -0.1, 0.0), rotation=(0.0, 7.0, 0.0)),
    Keyframe(time=2.0, position=(0.0, 0.0, 0.0), rotation=(0.3, 0.0, 0.0)),
)


def test_keyframes_are_met_exactly_and_held_outside() -> None:
    pivot = np.array([0.0, -0.05, 0.0])
    pose = head_motion(Motion(keyframes=KEYFRAMES, pivot=tuple(pivot)))
    for frame in KEYFRAMES:
        error = np.abs(place(pose(frame.time), pivot) - pivot - frame.position).max()
        turn = np.abs(pose(frame.time)[:3, :3] - rotation_matrix(np.array(frame.rotation))).max()
        assert max(error, turn) < 1e-14
    assert np.array_equal(pose(0.0), pose(0.5))
    assert np.array_equal(pose(9.0), pose(2.0))


def test_keyframed_velocity_is_continuous() -> None:
    pose = head_motion(Motion(keyframes=KEYFRAMES))
    tip = np.array([0.1, 0.1, 0.1])

    def velocity(start: float, end: float) -> np.ndarray:
        return (place(pose(end), tip) - place(pose(start), tip)) / (end - start)

    jumps = [np.abs(velocity(t, t + STEP) - velocity(t - STEP, t)).max() for t in (0.5, 1.0, 1.2, 2.0)]
    print(f"largest jump of velocity {max(jumps):.1e} m/s")
    assert max(jumps) < 0.02  # of up to 5 m/s; what is left is acceleration times the step


def test_a_single_keyframe_is_a_pose() -> None:
    pose = head_motion(Motion(keyframes=(Keyframe(time=1.0, position=(0.1, 0.2, 0.3)),)))
    assert np.allclose(pose(0.0)[:3, 3], (0.1, 0.2, 0.3))
    assert np.array_equal(pose(0.0), pose(5.0))


def test_tips_turn_about_their_centre() -> None:
    centre = np.array([0.0, -0.2, 0.01])
    assert np.array_equal(hand_motion(Simulate(), centre)(1.0), np.eye(4))
    pose = hand_motion(Simulate(tips=KEYFRAMES), centre)
    moved = [place(pose(frame.time), centre) - centre for frame in KEYFRAMES]
    assert np.abs(np.array(moved) - [frame.position for frame in KEYFRAMES]).max() < 1e-15


def test_tips_are_brought_to_their_first_pose_before_the_first_frame() -> None:
    pose = hand_motion(
        Simulate(tips=(Keyframe(time=0.0, position=(0.1, 0.0, 0.0)),), settle=1.0), np.zeros(3)
    )
    ways = [float(pose(time)[0, 3]) for time in (-1.0, -0.75, -0.5, 0.0)]
    assert ways == pytest.approx([0.0, 0.05, 0.1, 0.1], abs=1e-15)


@given(st.tuples(*[st.floats(-7, 7)] * 3))
def test_rotations_are_orthogonal(vector: tuple[float, float, float]) -> None:
    matrix = rotation_matrix(np.array(vector))
    assert np.abs(matrix @ matrix.T - np.eye(3)).max() < 1e-14
    assert np.linalg.det(matrix) == pytest.approx(1, abs=1e-14)
    assert np.allclose(matrix @ vector, vector, atol=1e-13)
