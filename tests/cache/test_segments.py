from pathlib import Path

import numpy as np
import pytest

from pipeline import cache
from pipeline.cache import Frame, Segments


def frames(first: int, count: int) -> list[Frame]:
    rng = np.random.default_rng(first)
    return [
        Frame(rng.normal(size=(4, 6, 3)).astype(np.float32), np.eye(4), {"energy": float(first + index)})
        for index in range(count)
    ]


def fill(segments: Segments, upto: int) -> None:
    """A simulation that stores three frames at a time and goes on from where it was."""
    done, checkpoint = segments.resume()
    assert done == (0 if checkpoint is None else int(checkpoint["step"]))
    while done < upto:
        done += 3
        segments.append(frames(done - 3, 3), {"step": np.array(done), "state": np.full((2, 3), done)})


def merged(tmp_path: Path, segments: Segments) -> np.ndarray:
    segments.merge({}, 24.0)
    with cache.open_guides(segments.guides_file) as guides:
        assert guides.key == segments.key
        return np.stack([guides.frame(index) for index in range(guides.frames)])


def test_a_resumed_simulation_is_the_uninterrupted_one(tmp_path: Path) -> None:
    whole = Segments(tmp_path / "a" / "guides.h5", "k")
    fill(whole, 12)
    parts = Segments(tmp_path / "b" / "guides.h5", "k")
    for upto in (3, 6, 12):
        fill(parts, upto)
    np.testing.assert_array_equal(merged(tmp_path, whole), merged(tmp_path, parts))
    assert not parts.folder.exists()


@pytest.mark.parametrize("victim", [0, 3, 9])
def test_a_damaged_segment_and_all_later_ones_are_computed_again(tmp_path: Path, victim: int) -> None:
    segments = Segments(tmp_path / "guides.h5", "k")
    fill(segments, 12)
    path = segments.folder / f"{victim:08d}.h5"
    data = path.read_bytes()
    half = len(data) // 2
    path.write_bytes(data[:half] + bytes(byte ^ 1 for byte in data[half:]))
    assert segments.resume()[0] == victim
    fill(segments, 12)
    assert merged(tmp_path, segments).shape == (12, 4, 6, 3)


def test_segments_of_other_inputs_are_not_used(tmp_path: Path) -> None:
    fill(Segments(tmp_path / "guides.h5", "old"), 6)
    assert Segments(tmp_path / "guides.h5", "new").resume() == (0, None)


def test_checkpoint_arrays_keep_shape_and_type(tmp_path: Path) -> None:
    segments = Segments(tmp_path / "guides.h5", "k")
    state = {
        "x": np.zeros((3, 2, 3), np.float64),
        "step": np.array(7, np.int64),
        "seed": np.arange(2, dtype=np.uint32),
    }
    segments.append(frames(0, 2), state)
    done, checkpoint = segments.resume()
    assert done == 2
    assert checkpoint is not None
    for name, array in state.items():
        np.testing.assert_array_equal(checkpoint[name], array)
        assert (checkpoint[name].shape, checkpoint[name].dtype) == (array.shape, array.dtype)
