"""A run on workers, and a worker, that are asked to end: whole files, the exit code of the signal, nobody left behind."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

import pytest

from pipeline import cache
from pipeline.cli.main import call

pytest.importorskip("distributed", reason='needs the extra "farm"')
ROOT = Path(__file__).parents[2]
FRAMES = 24
CONFIG = f"""\
name = "ended"
[scene]
head = "none"
[groom]
source = "swatch"
strands = 40
guides = 4
points = 8
[simulate]
frames = {FRAMES}
settle = "0 s"
[render]
size = [32, 32]
samples = 1
grid = 16
"""


@pytest.fixture
def experiment(tmp_path: Path) -> cache.Experiment:
    (tmp_path / "ended.toml").write_text(CONFIG)
    return cache.Experiment(tmp_path / "outputs/ended")


@pytest.fixture
def start(experiment: cache.Experiment, tmp_path: Path) -> Iterator[Callable[..., "subprocess.Popen[str]"]]:
    """Start ringlet as a shell does, in a group of its own; frames take a moment there."""
    started: list[subprocess.Popen[str]] = []
    slow = {
        "PYTHONPATH": str(ROOT),
        "RINGLET_TEST_LOG": str(tmp_path / "frames.log"),
        "DASK_DISTRIBUTED__WORKER__PRELOAD": str(Path(__file__).parent / "slow_frames.py"),
        "OMP_WAIT_POLICY": "passive",
    }

    def go(*arguments: str) -> "subprocess.Popen[str]":
        process = subprocess.Popen(
            [sys.executable, "-m", *arguments],
            cwd=ROOT,
            env=os.environ | slow,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )
        started.append(process)
        return process

    yield go
    for process in started:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        with process:  # its pipe is closed, and it is waited for
            pass


def members(group: int) -> list[int]:
    """Processes of a group that have not ended."""
    found = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):
            state, _, owner = path.read_text().rpartition(")")[2].split()[:3]
            if int(owner) == group and state != "Z":
                found.append(int(path.parent.name))
    return found


def wait_for_frames(experiment: cache.Experiment, count: int) -> None:
    until = time.monotonic() + 200
    while len(list(experiment.frames.glob("*.png"))) < count:
        assert time.monotonic() < until
        time.sleep(0.02)


@pytest.mark.parametrize(
    ("number", "to_all"), [(signal.SIGINT, True), (signal.SIGTERM, False)], ids=["Ctrl-C", "SIGTERM"]
)
def test_a_run_on_workers_ends_whole_and_leaves_nobody(
    start: Callable[..., "subprocess.Popen[str]"],
    experiment: cache.Experiment,
    tmp_path: Path,
    number: signal.Signals,
    to_all: bool,
) -> None:
    outputs = ["--outputs", str(tmp_path / "outputs")]
    run = start("pipeline", "run", str(tmp_path / "ended.toml"), *outputs, "--workers", "2")
    wait_for_frames(experiment, 3)
    assert len(members(run.pid)) > 2
    (os.killpg if to_all else os.kill)(run.pid, number)
    said = run.communicate(timeout=60)[1]
    print(said.splitlines()[-1])
    assert run.returncode == 128 + number
    assert f"stopped by {number.name}" in said
    assert "Traceback" not in said
    until = time.monotonic() + 10
    while members(run.pid) and time.monotonic() < until:
        time.sleep(0.05)
    assert members(run.pid) == []
    frames = sorted(experiment.frames.glob("*.png"))
    assert 3 <= len(frames) < FRAMES
    assert len({cache.picture_record(path)[0] for path in frames}) == 1
    assert list(experiment.folder.rglob("*.tmp.*")) == []
    kept = {path: path.stat().st_ino for path in frames}
    assert call(["run", str(tmp_path / "ended.toml"), *outputs]) == 0
    assert len(list(experiment.frames.glob("*.png"))) == FRAMES
    assert {path: path.stat().st_ino for path in frames} == kept


def test_a_worker_that_is_asked_to_end_does_and_the_other_goes_on(
    start: Callable[..., "subprocess.Popen[str]"], experiment: cache.Experiment, tmp_path: Path
) -> None:
    file = tmp_path / "scheduler"
    local = ["--host", "127.0.0.1", "--port", "0", "--scheduler-file", str(file), "--no-dashboard"]
    start("distributed.cli.dask_scheduler", *local, "--no-jupyter")
    until = time.monotonic() + 60
    while not file.exists() or not file.read_text().endswith("}"):
        assert time.monotonic() < until
        time.sleep(0.05)
    address = next(word for word in file.read_text().split('"') if word.startswith("tcp://"))
    first, _ = (start("pipeline", "worker", address, "--threads", "1") for _ in range(2))
    config, outputs = str(tmp_path / "ended.toml"), str(tmp_path / "outputs")
    run = start("pipeline", "run", config, "--outputs", outputs, "--scheduler", address)
    wait_for_frames(experiment, 3)
    os.killpg(first.pid, signal.SIGINT)
    said = first.communicate(timeout=60)[1]
    assert first.returncode == 130
    assert "Traceback" not in said
    assert members(first.pid) == []
    run.communicate(timeout=200)
    assert run.returncode == 0
    assert len(list(experiment.frames.glob("*.png"))) == FRAMES
    assert list(experiment.folder.rglob("*.tmp.*")) == []
