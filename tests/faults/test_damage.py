"""Caches and frames that are cut or have a wrong bit: found, wherever it is, made again, and the same as before."""

import random
import shutil
from pathlib import Path

import pytest
import tiny
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from pipeline import cache
from pipeline.batch import stages
from pipeline.config import load

FILES = {
    "groom": "groom.h5",
    "simulate": "guides.h5",
    "interpolate": "strands.h5",
    "render": "frames/0002.png",
}


@pytest.fixture(scope="module")
def copy(undisturbed: cache.Experiment, tmp_path_factory: pytest.TempPathFactory) -> cache.Experiment:
    folder = tmp_path_factory.mktemp("damage") / tiny.NAME
    shutil.copytree(undisturbed.folder, folder)
    return cache.Experiment(folder)


def broken(data: bytes, where: float, bit: int) -> bytes:
    """Data with one wrong bit, or cut there when `bit` is 8."""
    at = int(where * len(data))
    return data[:at] if bit == 8 else data[:at] + bytes([data[at] ^ 1 << bit]) + data[at + 1 :]


@pytest.mark.parametrize("stage", FILES)
@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(where=st.floats(0, 1, exclude_max=True), bit=st.integers(0, 8))
def test_any_damage_to_any_file_is_found(copy: cache.Experiment, stage: str, where: float, bit: int) -> None:
    batch = stages.Batch(load(tiny.CONFIG, tiny.SETTINGS).config, copy)
    path = copy.folder / FILES[stage]
    whole = path.read_bytes()
    try:
        path.write_bytes(broken(whole, where, bit))
        state = batch.state(stage, range(2, 3))
        assert not state.fresh
        assert "the file is damaged and has to be made again" in state.reason
    finally:
        path.write_bytes(whole)
    stages._verified.clear()
    assert batch.state(stage, range(2, 3)).fresh


@pytest.mark.parametrize("seed", [1, 2])
def test_what_is_damaged_is_made_again_with_the_same_bytes(
    undisturbed: cache.Experiment, tmp_path: Path, seed: int
) -> None:
    rng = random.Random(seed)
    shutil.copytree(undisturbed.folder, tmp_path / tiny.NAME)
    for name in FILES.values():
        path = tmp_path / tiny.NAME / name
        path.write_bytes(broken(path.read_bytes(), rng.random(), rng.randrange(9)))
    found = tiny.run(tmp_path)
    assert sorted(tiny.stage_seconds(found)) == sorted(FILES)  # each of them was made again
    tiny.assert_same(found, undisturbed)
