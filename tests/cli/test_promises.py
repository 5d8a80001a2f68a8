"""The product's promises on whole runs of a small experiment: same bytes, nothing lost."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from pipeline import cache

ROOT = Path(__file__).parents[2]
SMALL = (
    "groom.strands=600",
    "groom.guides=40",
    "simulate.frames=3",
    "render.size=[80, 80]",
    "render.samples=1",
)


def command(outputs: Path, *options: str) -> list[str]:
    settings = [word for setting in SMALL for word in ("-s", setting)]
    config = str(ROOT / "configs" / "ci" / "wavy.toml")
    return [sys.executable, "-m", "pipeline", "run", config, "--outputs", str(outputs), *settings, *options]


def run(outputs: Path, *options: str, processors: set[int] | None = None) -> cache.Experiment:
    def restrict() -> None:
        if processors:
            os.sched_setaffinity(0, processors)

    result = subprocess.run(
        command(outputs, *options), cwd=ROOT, preexec_fn=restrict, capture_output=True, text=True
    )
    assert result.returncode == 0, result.stderr
    return cache.Experiment(outputs / "ci-wavy")


def pixels(experiment: cache.Experiment) -> list[bytes]:
    return [Image.open(path).tobytes() for path in sorted(experiment.frames.glob("*.png"))]


def columns(path: Path) -> dict[str, bytes]:
    """Everything that a file of the cache holds, but for the record of when and where it was made."""
    with cache.open(path) as reader:
        return {name: np.ascontiguousarray(reader[name][:]).tobytes() for name in reader.names}


def assert_same(found: cache.Experiment, wanted: cache.Experiment) -> None:
    for name in ("groom", "guides", "strands"):
        assert columns(getattr(found, name)) == columns(getattr(wanted, name)), name
    assert pixels(found) == pixels(wanted)
    assert len(pixels(wanted)) == 3


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> cache.Experiment:
    return run(tmp_path_factory.mktemp("undisturbed"))


def test_one_processor_gives_the_same_bytes(undisturbed: cache.Experiment, tmp_path: Path) -> None:
    assert_same(run(tmp_path, processors={min(os.sched_getaffinity(0))}), undisturbed)


def test_frames_made_one_by_one_have_the_same_bytes(undisturbed: cache.Experiment, tmp_path: Path) -> None:
    run(tmp_path, "--frames", "3")
    run(tmp_path, "--frames", "1")
    assert_same(run(tmp_path), undisturbed)


def test_a_run_that_is_killed_again_and_again_ends_the_same(
    undisturbed: cache.Experiment, tmp_path: Path
) -> None:
    kills = 0
    for wait in (1.0, 2.0, 2.7, 3.3, 4.0, 4.6):
        process = subprocess.Popen(command(tmp_path), cwd=ROOT, stderr=subprocess.DEVNULL)
        time.sleep(wait)
        kills += process.poll() is None
        process.send_signal(signal.SIGKILL)
        process.wait()
        found = cache.Experiment(tmp_path / "ci-wavy")
        for path in (found.groom, found.guides, found.strands):
            if path.exists():
                columns(path)  # raises Damaged for half a file
    print(f"killed {kills} times")
    assert kills > 0
    assert_same(run(tmp_path), undisturbed)
    assert [path.name for path in (tmp_path / "ci-wavy").rglob("*.tmp.*")] == []
