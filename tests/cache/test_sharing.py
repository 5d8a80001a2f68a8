"""Experiments share files of equal keys: made once, linked, and independent of one another afterwards."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from pipeline import cache


def make(experiment: cache.Experiment, key: str) -> None:
    with cache.create(experiment.groom, "groom", key) as writer:
        writer.write("strands/points", np.arange(6.0).reshape(2, 3))
    cache.Sharing(experiment).note(key)


@pytest.fixture
def pair(tmp_path: Path) -> tuple[cache.Experiment, cache.Experiment]:
    """Two experiments, of which the first has a groom of key "k"."""
    first, second = cache.Experiment(tmp_path / "first"), cache.Experiment(tmp_path / "second@a=1")
    make(first, "k")
    return first, second


def test_a_file_that_is_taken_is_the_same_file(pair: tuple[cache.Experiment, cache.Experiment]) -> None:
    first, second = pair
    sharing = cache.Sharing(second)
    assert [other.folder.name for other in sharing.others("k")] == ["first"]
    assert list(sharing.others("another")) == []
    sharing.take("groom", first)
    sharing.take("groom", first)
    assert second.groom.samefile(first.groom)
    assert [path.name for path in second.folder.iterdir()] == ["groom.h5"]


def test_deleting_or_remaking_one_experiment_leaves_the_others_whole(
    pair: tuple[cache.Experiment, cache.Experiment],
) -> None:
    first, second = pair
    cache.Sharing(second).take("groom", first)
    make(first, "k2")
    with cache.open(second.groom) as reader:
        assert reader.key == "k"
        reader.verify()
    shutil.rmtree(first.folder)
    with cache.open(second.groom) as reader:
        reader.verify()
    assert second.groom.stat().st_nlink == 1
    assert list(cache.Sharing(second).others("k")) == []
    assert not (second.folder.parent / ".shared/k/first").exists()


def test_without_hard_links_the_file_is_copied(
    pair: tuple[cache.Experiment, cache.Experiment], monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> None:
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "link", refuse)
    first, second = pair
    cache.Sharing(second).take("groom", first)
    assert second.groom.read_bytes() == first.groom.read_bytes()
    assert not second.groom.samefile(first.groom)


def test_two_experiments_do_not_make_the_same_at_once(tmp_path: Path) -> None:
    code = (
        "import sys; from pathlib import Path; from pipeline import cache\n"
        "with cache.Sharing(cache.Experiment(Path(sys.argv[1]) / 'b')).making('groom', 'k'): print('in', flush=True)"
    )
    with cache.Sharing(cache.Experiment(tmp_path / "a")).making("groom", "k"):
        process = subprocess.Popen(
            [sys.executable, "-c", code, str(tmp_path)],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        assert process.stderr is not None
        assert f"waiting for process {os.getpid()}" in process.stderr.readline()
        assert process.poll() is None
    assert process.communicate(timeout=30)[0] == "in\n"


def test_different_frames_are_made_at_once_and_the_same_ones_are_not(tmp_path: Path) -> None:
    code = (
        "import sys; from pathlib import Path; from pipeline import cache\n"
        "frames = range(int(sys.argv[2]), int(sys.argv[3]))\n"
        "with cache.Experiment(Path(sys.argv[1])).working_on('render', frames): print('in', flush=True)"
    )

    def start(first: int, end: int) -> subprocess.Popen[str]:
        command = [sys.executable, "-c", code, str(tmp_path), str(first), str(end)]
        return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    experiment = cache.Experiment(tmp_path)
    with experiment.working_on("render", range(1, 9)):
        assert start(9, 17).communicate(timeout=30)[0] == "in\n"
        overlapping = start(8, 10)
        assert overlapping.stderr is not None
        assert "waiting for" in overlapping.stderr.readline()
        probe = [sys.executable, "-c", "import sys; from pathlib import Path; from pipeline import cache\n"
                 "print(cache.Experiment(Path(sys.argv[1])).workers_on('render'))", str(tmp_path)]  # fmt: skip
        found = subprocess.run(probe, capture_output=True, text=True, check=True).stdout
        assert f"process {os.getpid()} on" in found
    assert overlapping.communicate(timeout=30)[0] == "in\n"
    assert experiment.workers_on("render") == []
