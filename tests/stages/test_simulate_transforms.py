"""Files of transforms: read as they are meant, exact at the samples, the same in every frame, jumps without a whip."""

from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest
from numpy.typing import NDArray

from pipeline import cache
from pipeline.bench.simulate import round_head
from pipeline.cache.transforms import read_transforms
from pipeline.config.schema import Keyframe, Motion, Simulate
from pipeline.errors import InputError
from pipeline.simulate import stage
from pipeline.simulate.motion import head_motion
from pipeline.simulate.screws import curve_of_track, exp, inverse, log, place, rigid
from pipeline.simulate.stepper import Simulation

Poses = NDArray[np.float64]


def some_poses(count: int = 9, seed: int = 5) -> Poses:
    """Poses of a head that tumbles."""
    drift = np.array([0.3, 0.5, 0.0, 0.1, 0.0, 0.05])
    step = drift + np.random.default_rng(seed).normal(0, 0.4, (count, 6))
    poses = [np.eye(4)]
    for twist in exp(step):
        poses.append(poses[-1] @ twist)
    return np.array(poses[1:])


def uneven_times(count: int) -> Poses:
    return np.cumsum(np.random.default_rng(1).uniform(0.02, 0.08, count))


def write_csv(path: Path, poses: Poses, first: list[str] | None = None, header: str = "") -> Path:
    rows = [",".join(repr(float(value)) for value in pose.ravel()) for pose in poses]
    if first is not None:
        rows = [f"{label},{row}" for label, row in zip(first, rows, strict=True)]
    path.write_text("\n".join([header, *rows] if header else rows) + "\n")
    return path


def test_exp_undoes_log_for_every_angle() -> None:
    for angle in (0.0, 1e-9, 1e-4, 0.03, 0.0317, 1.0, 3.1):
        twist = np.array([0.0, angle * 0.6, angle * 0.8, 0.1, -0.2, 0.3])
        error = np.abs(log(exp(twist)) - twist).max()
        print(f"angle {angle:g}: log exp off by {error:.1e}")
        assert error < 1e-12


def test_a_track_is_exact_at_its_samples() -> None:
    poses, times = some_poses(), uneven_times(9)
    curve = curve_of_track(times, poses)
    inside = max(np.abs(curve(t - 1e-12) - pose).max() for t, pose in zip(times[1:], poses[1:], strict=True))
    exact = all(np.array_equal(curve(t), pose) for t, pose in zip(times, poses, strict=True))
    print(f"just before samples off by {inside:.1e}")
    assert exact
    assert inside < 1e-10
    assert np.array_equal(curve(times[-1] + 9), poses[-1])


def test_a_track_has_a_continuous_velocity() -> None:
    poses, times = some_poses(), uneven_times(9)
    curve, h = curve_of_track(times, poses), 1e-6
    jumps = [np.abs((curve(t + h) - curve(t)) / h - (curve(t) - curve(t - h)) / h).max() for t in times[1:-1]]
    fastest = max(np.abs(curve(t + h) - curve(t)).max() / h for t in np.linspace(times[0], times[-1], 50))
    print(f"velocity jumps by {max(jumps):.1e} of {fastest:.1f}")
    assert max(jumps) < 1e-4 * fastest


def test_a_track_does_not_depend_on_the_frame_it_is_written_in() -> None:
    """Another world, and another rest pose of the head: g -> A g B."""
    poses, times = some_poses(), uneven_times(9)
    world, body = some_poses(2, seed=8)
    one, other = curve_of_track(times, poses), curve_of_track(times, world @ poses @ body)
    errors = [np.abs(world @ one(t) @ body - other(t)).max() for t in np.linspace(0, times[-1], 101)]
    print(f"in another frame off by {max(errors):.1e}")
    assert max(errors) < 1e-13


def test_a_constant_screw_is_reproduced_exactly() -> None:
    twist, times = np.array([2.0, -7.0, 1.0, 0.4, 0.1, -0.3]), uneven_times(7)
    curve = curve_of_track(times, exp(times[:, None] * twist))
    errors = [np.abs(curve(t) - exp(t * twist)).max() for t in np.linspace(times[0], times[-1], 101)]
    print(f"screw of {np.linalg.norm(twist[:3]):.1f} rad/s off by {max(errors):.1e}")
    assert max(errors) < 1e-13


def test_a_smooth_motion_is_met_to_third_order() -> None:
    def pose(t: float) -> Poses:
        return rigid(
            np.array([0.0, np.sin(3 * t), 0.4 * np.sin(2 * t)]), np.array([0.1 * np.cos(4 * t), 0, 0])
        )

    errors = []
    for count in (17, 33, 65):
        times = np.linspace(0, 2, count)
        curve = curve_of_track(times, np.array([pose(t) for t in times]))
        errors.append(max(np.abs(curve(t) - pose(t)).max() for t in np.linspace(0.5, 1.5, 200)))
    order = np.log2(errors[0] / errors[-1]) / 2
    print(f"errors {', '.join(f'{e:.1e}' for e in errors)}: order {order:.2f}")
    assert order > 2.7


def test_csv_with_frames_with_times_without_and_hdf5_agree(tmp_path: Path) -> None:
    poses, fps = some_poses(), 24.0
    frames = [str(k + 1) for k in range(len(poses))]
    times = [repr(k / fps) for k in range(len(poses))]
    files = [
        write_csv(tmp_path / "plain.csv", poses),
        write_csv(tmp_path / "rows.csv", poses[:, :3]),
        write_csv(tmp_path / "frames.csv", poses, frames, "frame,m00,m01"),
        write_csv(tmp_path / "counted.csv", poses, frames),
        write_csv(tmp_path / "times.csv", poses[:, :3], times, "# a note\n\nTime, m00, m01"),
    ]
    for name, extra in (("plain.h5", {}), ("times.h5", {"time": np.arange(len(poses)) / fps})):
        files.append(tmp_path / name)
        with h5py.File(files[-1], "w") as file:
            for key, values in {"transforms": poses, **extra}.items():
                file[key] = values
    for path in files:
        read_times, read = read_transforms(path, fps)
        error = np.abs(read - poses).max()
        print(f"{path.name}: off by {error:.1e}")
        assert error < 1e-14
        assert read_times == pytest.approx(np.arange(len(poses)) / fps, abs=1e-14)
    scaled = read_transforms(files[0], fps, unit_scale=0.01)[1]
    assert scaled[:, :3, 3] == pytest.approx(poses[:, :3, 3] / 100)


def test_slightly_rounded_rotations_are_made_exact(tmp_path: Path) -> None:
    poses = some_poses()
    read = read_transforms(write_csv(tmp_path / "x.csv", np.round(poses, 4)), 24)[1]
    rotation = read[:, :3, :3]
    assert np.abs(rotation @ rotation.swapaxes(1, 2) - np.eye(3)).max() < 1e-14
    assert np.abs(read - poses).max() < 2e-4


def spoilt(row: int, column: int, value: float) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        poses = some_poses()
        poses.reshape(-1, 16)[row, column] = value
        return write_csv(folder / "bad.csv", poses)

    return write


def text(content: str) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        (folder / "bad.csv").write_text(content)
        return folder / "bad.csv"

    return write


def mirrored(folder: Path) -> Path:
    poses = some_poses()
    poses[2, :3, 0] *= -1
    return write_csv(folder / "bad.csv", poses)


IDENTITY = "1,0,0,0,0,1,0,0,0,0,1,0"


@pytest.mark.parametrize(
    ("write", "message"),
    [
        (spoilt(3, 5, np.nan), r"bad\.csv:4: a number is not finite; export it again"),
        (spoilt(1, 0, 2.0), r"bad\.csv:2: the rotation is not orthonormal to 1e-3; remove scale"),
        (spoilt(4, 12, 0.5), r"bad\.csv:5: the last row is not 0 0 0 1; write matrices row by row"),
        (mirrored, r"bad\.csv:3: the matrix mirrors; remove the negative scale"),
        (text(f"frame,m\n1,{IDENTITY}\n1,{IDENTITY}\n"), r"bad\.csv:3: not later than the sample before it"),
        (text(f"{IDENTITY}\n1,2,3\n"), r"bad\.csv:2: 3 numbers; a line has 12 or 16"),
        (text(f"{IDENTITY}\nhello\n"), r"bad\.csv:2: not a line of numbers: hello"),
        (text(f"pose,m\n1,{IDENTITY}\n"), r'the first column is called pose; expected "frame" or "time"'),
        (text("# nothing\n"), r"bad\.csv: no transforms; a line of 12 or 16 numbers is needed"),
        (lambda folder: folder / "no.csv", r"no\.csv: no such file of transforms"),
    ],
)
def test_what_is_wrong_with_a_file_is_told_with_its_line(
    tmp_path: Path, write: Callable[[Path], Path], message: str
) -> None:
    with pytest.raises(InputError, match=message):
        read_transforms(write(tmp_path), 24)


def test_hdf5_files_that_do_not_fit_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "bad.h5"
    path.write_text("no")
    with pytest.raises(InputError, match='no dataset "transforms"'):
        read_transforms(path, 24)
    with h5py.File(path, "w") as file:
        file["transforms"] = np.zeros((3, 4))
    with pytest.raises(InputError, match=r"expected \(F, 4, 4\)"):
        read_transforms(path, 24)


def test_half_a_turn_between_samples_is_refused_unless_it_is_a_jump(tmp_path: Path) -> None:
    poses = rigid(np.array([[0, 0.1, 0], [0, 0.2, 0], [0, 3.3, 0], [0, 3.4, 0]]), np.zeros((4, 3)))
    path = str(write_csv(tmp_path / "x.csv", poses))
    with pytest.raises(InputError, match=r"it turns by 178 degrees up to the sample at 0\.0833333 s"):
        head_motion(Motion(file=path))
    pose = head_motion(Motion(file=path, teleport=(3,)))
    assert np.abs(pose(2 / 24) - poses[2]).max() < 1e-15


# --- jumps -----------------------------------------------------------------------------------------

FRAMES, JUMP_AT = 9, 6


def smooth_track() -> Poses:
    """A screw: the head that jumps goes on as before until then, and a screw that goes on is the same screw."""
    return exp(np.arange(FRAMES)[:, None] / 24 * np.array([0.4, 2.0, 0.1, 0.4, 0.0, 0.1]))


def simulated(motion: Motion) -> list[cache.Frame]:
    simulation = Simulation(Simulate(frames=FRAMES, settle=0.3, motion=motion), 3, round_head(19, 16))
    simulation.settle()
    return list(stage.run(simulation))


@pytest.mark.parametrize("told", [{"teleport": (JUMP_AT,)}, {"teleport_beyond": 1.0}])
def test_hair_is_carried_over_a_jump_as_it_is(tmp_path: Path, told: dict[str, object]) -> None:
    """About the vertical, a jump is a change of frame: the hair moves as if there were none."""
    jump = rigid(np.array([0.0, 2.0, 0.0]), np.array([5.0, 1.0, -3.0]))
    poses = smooth_track()
    smooth = simulated(Motion(file=str(write_csv(tmp_path / "smooth.csv", poses))))
    poses[JUMP_AT - 1 :] = jump @ poses[JUMP_AT - 1 :]
    jumping = simulated(Motion(file=str(write_csv(tmp_path / "jump.csv", poses)), **told))
    before = smooth[JUMP_AT - 2].points
    errors = [np.abs(place(jump, a.points) - b.points).max() for a, b in zip(smooth, jumping, strict=True)]
    swing = max(np.abs(frame.points - before).max() for frame in smooth[JUMP_AT:])
    print(f"after the jump off by {max(errors[JUMP_AT - 1 :]):.1e} m; hair moves by {swing:.2f} m")
    assert max(errors[JUMP_AT - 1 :]) < 2e-6
    assert swing > 0.02
    assert all(
        np.array_equal(a.points, b.points) for a, b in zip(smooth[: JUMP_AT - 2], jumping, strict=False)
    )


def test_without_being_told_the_same_jump_whips(tmp_path: Path) -> None:
    poses = smooth_track()
    poses[JUMP_AT - 1 :] = rigid(np.array([0.0, 2.0, 0.0]), np.array([5.0, 1.0, -3.0])) @ poses[JUMP_AT - 1 :]
    path = str(write_csv(tmp_path / "jump.csv", poses))
    kinetic = [
        max(frame.diagnostics["kinetic"] for frame in simulated(Motion(file=path, **told)))
        for told in ({}, {"teleport": (JUMP_AT,)})
    ]
    print(f"kinetic energy {kinetic[0]:.1e} J without teleport, {kinetic[1]:.1e} J with it")
    assert kinetic[0] > 100 * kinetic[1]


def test_a_resumed_run_goes_on_over_a_jump_bit_by_bit() -> None:
    keys = (
        Keyframe(time=0.0),
        Keyframe(time=0.1, rotation=(0, 1.0, 0)),
        Keyframe(time=0.2, position=(3, 0, 0)),
    )
    simulate = Simulate(frames=8, settle=0.1, motion=Motion(keyframes=keys, teleport=(4,)))
    guides = round_head(19, 16)
    for stop in (3, 4, 5):
        whole = Simulation(simulate, 3, guides)
        whole.settle()
        frames = list(stage.run(whole, 0))[stop:]
        first = Simulation(simulate, 3, guides)
        first.settle()
        for frame, _ in enumerate(stage.run(first), start=1):
            if frame == stop:
                break
        resumed = Simulation(simulate, 3, guides)
        resumed.restore({name: array.copy() for name, array in first.save().items()})
        again = list(stage.run(resumed, start=stop))
        assert [a.points.tobytes() for a in again] == [b.points.tobytes() for b in frames]
        assert [a.pose.tobytes() for a in again] == [b.pose.tobytes() for b in frames]


def test_jumps_need_something_that_jumps() -> None:
    with pytest.raises(ValueError, match="only keyframes and files jump"):
        Motion(preset="nod", teleport=(3,))
    with pytest.raises(ValueError, match="from keyframes or from a file"):
        Motion(file="x.csv", keyframes=(Keyframe(time=0.0),))
    with pytest.raises(InputError, match="no keyframe between two jumps"):
        head_motion(Motion(keyframes=(Keyframe(time=0.0),), teleport=(3,)))


def test_keyframes_do_not_depend_on_the_frame_they_are_written_in() -> None:
    """Rotations about several axes: turned as a whole, the motion is the same one."""
    turn = rigid(np.array([0.4, -1.0, 0.7]), np.zeros(3))
    keys = [(0.0, (0, 0, 0), (0, 0, 0)), (0.3, (0.1, 0, 0), (0.5, 0.8, 0)), (0.5, (0.1, 0.1, 0), (0, 1, 0.9))]

    def motion(by: Poses) -> Callable[[float], Poses]:
        turned = [Keyframe(time=t, position=tuple(by @ p), rotation=tuple(by @ r)) for t, p, r in keys]
        return head_motion(Motion(keyframes=tuple(turned), pivot=(0, 0, 0)))

    one, other = motion(np.eye(3)), motion(turn[:3, :3])
    errors = [np.abs(turn @ one(t) @ inverse(turn) - other(t)).max() for t in np.linspace(0, 0.5, 51)]
    print(f"in another frame off by {max(errors):.1e}")
    assert max(errors) < 1e-13
