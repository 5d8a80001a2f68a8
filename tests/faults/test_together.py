"""Several runs of one config in one folder at once: all of them finish, and the output is that of one."""

from pathlib import Path

import tiny

from pipeline import cache


def test_two_runs_at_once_make_everything_once(undisturbed: cache.Experiment, tmp_path: Path) -> None:
    runs = [tiny.start(tmp_path) for _ in range(2)]
    said = [run.communicate(timeout=250)[1] for run in runs]
    assert [run.returncode for run in runs] == [0, 0], said
    found = cache.Experiment(tmp_path / tiny.NAME)
    for stage in ("groom", "simulate", "interpolate"):
        assert sum(text.count(f"{stage}: start") for text in said) == 1, said
    tiny.assert_same(found, undisturbed)


def test_frames_shared_out_to_runs_at_once_are_the_same(
    undisturbed: cache.Experiment, tmp_path: Path
) -> None:
    runs = [tiny.start(tmp_path, "--frames", frames) for frames in ("1-5", "4-10")]
    said = [run.communicate(timeout=250)[1] for run in runs]
    assert [run.returncode for run in runs] == [0, 0], said
    tiny.assert_same(cache.Experiment(tmp_path / tiny.NAME), undisturbed)
