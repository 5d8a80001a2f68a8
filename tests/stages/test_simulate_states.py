"""States that a simulation keeps on the way to a frame: those of its steps, whatever is kept."""

from pathlib import Path

import numpy as np
import pytest
from guided_runs import simulated

from pipeline import cache
from pipeline.bench.simulate import round_head
from pipeline.config.schema import HairContact, Keyframe, Motion, Simulate
from pipeline.simulate.stepper import Guides

SHAKE = Motion(preset="shake", period=0.4, amplitude=0.6, pivot=(0.0, -0.05, 0.0))
SHORT = Simulate(
    frames=4,
    substeps=10,
    settle=0.1,
    motion=SHAKE,
    air={"gusts": 1.0},
    hair_contact=HairContact(method="none"),
)


@pytest.fixture
def guides() -> Guides:
    return round_head(21, 16)


def written(frames: list[cache.Frame], folder: Path) -> cache.Experiment:
    experiment = cache.Experiment(folder)
    segments = cache.Segments(experiment.guides, "key")
    segments.resume()
    for frame in frames:
        segments.append([frame], {"step": np.zeros(1)})
    segments.merge({}, SHORT.fps)
    return experiment


def test_frames_do_not_depend_on_how_many_states_are_kept(guides: Guides) -> None:
    alone = simulated(SHORT, guides)
    for states in (2, 5):
        frames = simulated(SHORT.model_copy(update={"states": states}), guides)
        assert [len(frame.before) for frame in frames] == [states - 1] * SHORT.frames
        for one, other in zip(alone, frames, strict=True):
            assert np.array_equal(one.points, other.points)
            assert np.array_equal(one.pose, other.pose)


def test_states_are_the_frames_of_a_finer_simulation(guides: Guides) -> None:
    kept = simulated(SHORT.model_copy(update={"states": 2, "settle": 0.0}), guides)
    finer = SHORT.model_copy(update={"fps": 48.0, "substeps": 5, "frames": 7, "settle": 0.0})
    frames = simulated(finer, guides)
    for index, frame in enumerate(kept[1:], start=1):
        points, pose = frame.before[0]
        assert np.array_equal(points, frames[2 * index - 1].points)
        assert np.array_equal(pose, frames[2 * index - 1].pose)
    assert np.abs(kept[1].before[0][0] - kept[1].points).max() > 1e-4


def test_states_are_read_as_they_were_written(guides: Guides, tmp_path: Path) -> None:
    frames = simulated(SHORT.model_copy(update={"states": 5}), guides)
    with cache.open_guides(written(frames, tmp_path).guides) as reader:
        assert reader.states == 5
        for index, frame in enumerate(frames):
            states = [*frame.before, (frame.points, frame.pose)]
            for back in range(5):
                points, pose = reader.state(index, back)
                assert np.array_equal(points, states[4 - back][0])
                assert np.array_equal(pose, states[4 - back][1])
        with pytest.raises(IndexError):
            reader.state(0, 5)


def test_a_file_of_one_state_a_frame_has_nothing_more(guides: Guides, tmp_path: Path) -> None:
    experiment = written(simulated(SHORT, guides), tmp_path)
    with cache.open(experiment.guides) as reader:
        assert not [name for name in reader.names if name.startswith("before")]
        assert "states" not in reader.meta
    with cache.open_guides(experiment.guides) as reader:
        assert reader.states == 1
        assert np.array_equal(reader.state(2, 0)[0], reader.frame(2))


def test_states_before_a_jump_are_carried_with_the_hair(guides: Guides) -> None:
    """An open shutter sees the head move as it does, never across the jump."""
    keys = (Keyframe(time=0.0), Keyframe(time=1 / 24, position=(0.3, 0.0, 0.0)))
    jumping = Motion(keyframes=keys, teleport=(2,))
    frames = simulated(SHORT.model_copy(update={"states": 5, "motion": jumping, "frames": 2}), guides)
    _, last = frames[1].before[-1]
    moved = np.abs(frames[1].before[-1][0] - frames[1].points).max()
    print(f"the hair jumps by 0.3 m, and moves by {1e3 * moved:.2f} mm in the fifth of a frame before")
    assert np.allclose(last[:3, 3], frames[1].pose[:3, 3])
    assert moved < 0.01
