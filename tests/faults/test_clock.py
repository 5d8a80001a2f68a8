"""Clocks that go back: times of files decide nothing but what make asks for, and make is told the truth."""

import os
import shutil
from pathlib import Path

import pytest
import tiny

from pipeline import cache
from pipeline.batch import stages
from pipeline.config import load
from pipeline.config.keys import file_digest

DAY = 86400


@pytest.mark.parametrize("shift", [-400 * DAY, 400 * DAY], ids=["past", "future"])
def test_what_is_whole_is_fresh_whatever_its_time(
    undisturbed: cache.Experiment, tmp_path: Path, shift: int
) -> None:
    shutil.copytree(undisturbed.folder, tmp_path / tiny.NAME)
    for path in tmp_path.rglob("*"):
        os.utime(path, (path.stat().st_mtime + shift,) * 2)
    batch = stages.Batch(load(tiny.CONFIG, tiny.SETTINGS).config, cache.Experiment(tmp_path / tiny.NAME))
    assert [state.reason for state in batch.states()] == ["fresh"] * 4
    changed = load(tiny.CONFIG, (*tiny.SETTINGS, "render.width=90 um")).config
    states = stages.Batch(changed, batch.experiment).states()
    assert [state.fresh for state in states] == [True, True, True, False]


def test_a_file_that_is_edited_within_one_tick_of_the_clock_has_another_digest(tmp_path: Path) -> None:
    """Same size, same time: what a long-lived worker remembers of the old content does not count."""
    path = tmp_path / "pins.csv"
    path.write_text("1,0\n")
    os.utime(path, (1e9, 1e9))
    before = file_digest(path)
    path.write_text("2,0\n")
    os.utime(path, (1e9, 1e9))
    assert file_digest(path) != before
