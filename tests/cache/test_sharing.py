"""Experiments share files of equal keys: made once, linked, and independent of one another afterwards."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from second_process import first_words, wants

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
    with cache.Sharing(cache.Experiment(tmp_path / "a")).making("groom", "k"):
        process = wants("cache.Sharing(cache.Experiment(folder / 'b')).making('groom', 'k')", tmp_path)
        assert f"waiting for process {os.getpid()}" in first_words(process)
    assert process.communicate(timeout=30)[0] == "in\n"


def test_different_frames_are_made_at_once_and_the_same_ones_are_not(tmp_path: Path) -> None:
    def start(first: int, end: int) -> subprocess.Popen[str]:
        return wants(f"cache.Experiment(folder).working_on('render', range({first}, {end}))", tmp_path)

    experiment = cache.Experiment(tmp_path)
    with experiment.working_on("render", range(1, 9)):
        assert start(9, 17).communicate(timeout=30)[0] == "in\n"
        overlapping = start(8, 10)
        assert "waiting for" in first_words(overlapping)
        probe = [sys.executable, "-c", "import sys; from pathlib import Path; from pipeline import cache\n"
                 "print(cache.Experiment(Path(sys.argv[1])).workers_on('render'))", str(tmp_path)]  # fmt: skip
        found = subprocess.run(probe, capture_output=True, text=True, check=True).stdout
        assert f"process {os.getpid()} on" in found
    assert overlapping.communicate(timeout=30)[0] == "in\n"
    assert experiment.workers_on("render") == []
