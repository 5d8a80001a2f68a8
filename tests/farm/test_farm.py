"""A real scheduler with three worker processes on loopback: whoever is killed, the frames are those of a serial run."""

import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from pipeline import cache
from pipeline.batch.stages import Batch
from pipeline.config import load
from pipeline.errors import InputError

pytest.importorskip("distributed", reason='needs the extra "farm"')
from pipeline.farm.run import LARGEST_CHUNK, chunks, make

ROOT = Path(__file__).parents[2]
FRAMES = 15
CONFIG = f"""\
name = "farmed"
[groom]
strands = 120
guides = 12
points = 8
[simulate]
frames = {FRAMES}
settle = "0.1 s"
[render]
size = [64, 64]
samples = 1
grid = 16
"""


def end(process: subprocess.Popen[bytes]) -> None:
    """End a process and all that it has started."""
    with_children = process.pid
    for number in (signal.SIGTERM, signal.SIGKILL):
        try:
            os.killpg(with_children, number)
            process.wait(timeout=5)
        except (ProcessLookupError, subprocess.TimeoutExpired):
            pass


class Farm:
    """A scheduler and three workers, and what the workers' frames have told."""

    def __init__(self, folder: Path) -> None:
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            self.port = probe.getsockname()[1]
        self.address = f"tcp://127.0.0.1:{self.port}"
        self.log = folder / "frames.log"
        self.log.touch()
        self._said = (folder / "said").open("ab")
        self.scheduler = self.start_scheduler()
        work = ["-m", "pipeline", "worker", self.address, "--threads", "1", "--patience", "60"]
        self.workers = [self._start(*work) for _ in range(3)]

    def start_scheduler(self) -> subprocess.Popen[bytes]:
        local = ["--host", "127.0.0.1", "--port", str(self.port), "--no-dashboard", "--no-jupyter"]
        return self._start("-m", "distributed.cli.dask_scheduler", *local)

    def _start(self, *arguments: str) -> subprocess.Popen[bytes]:
        environment = os.environ | {
            "PYTHONPATH": str(ROOT),
            "RINGLET_TEST_LOG": str(self.log),
            "DASK_DISTRIBUTED__WORKER__PRELOAD": str(Path(__file__).parent / "slow_frames.py"),
            "OMP_WAIT_POLICY": "passive",
        }
        return subprocess.Popen(
            [sys.executable, *arguments],
            cwd=ROOT,
            env=environment,
            stdout=self._said,
            stderr=self._said,
            start_new_session=True,
        )

    def lines(self, what: str) -> list[tuple[str, int]]:
        """Frames that were begun, or have ended, and the processes."""
        rows = [line.split() for line in self.log.read_text().splitlines()]
        return [(Path(path).name, int(process)) for begun, path, process in rows if begun == what]

    def close(self) -> None:
        for process in (*self.workers, self.scheduler):
            end(process)
        self._said.close()


@pytest.fixture(scope="module")
def farm(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Farm]:
    found = Farm(tmp_path_factory.mktemp("farm"))
    try:
        yield found
    finally:
        found.close()
    assert all(process.poll() is not None for process in (*found.workers, found.scheduler))


@pytest.fixture
def begun(farm: Farm) -> Farm:
    """The farm before a run; its log is empty."""
    farm.log.write_text("")
    return farm


def batch(outputs: Path, *settings: str) -> Batch:
    path = outputs.parent / "farmed.toml"
    path.write_text(CONFIG)
    config = load(path, settings).config
    return Batch(config, cache.Experiment(outputs / config.name))


def pictures(experiment: cache.Experiment) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted(experiment.frames.glob("*.png"))}


@pytest.fixture(scope="module")
def serial(tmp_path_factory: pytest.TempPathFactory) -> cache.Experiment:
    """The same experiment by this process alone."""
    found = batch(tmp_path_factory.mktemp("serial") / "outputs")
    for stage in ("groom", "simulate", "interpolate", "render"):
        found.make(stage)
    return found.experiment


def assert_same(found: cache.Experiment, wanted: cache.Experiment) -> None:
    assert len(pictures(wanted)) == FRAMES
    assert pictures(found) == pictures(wanted)
    for name in ("groom", "guides", "strands"):
        with cache.open(getattr(found, name)) as one, cache.open(getattr(wanted, name)) as other:
            assert one.names == other.names
            for column in one.names:
                np.testing.assert_array_equal(one[column][:], other[column][:])
    assert list(found.folder.rglob("*.tmp.*")) == []


def during(farm: Farm, act: Callable[[], None]) -> threading.Thread:
    """Do something beside the run, once; it ends with its thread."""
    thread = threading.Thread(target=act, daemon=True)
    thread.start()
    return thread


def wait_for(condition: Callable[[], bool], seconds: float = 120) -> None:
    until = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > until:
            raise TimeoutError
        time.sleep(0.01)


def twice(farm: Farm) -> int:
    """How many frames were begun more than once."""
    return sum(count > 1 for count in Counter(name for name, _ in farm.lines("begin")).values())


def test_a_worker_killed_in_the_middle_of_a_frame_costs_one_frame(
    begun: Farm, serial: cache.Experiment, tmp_path: Path
) -> None:
    killed: list[str] = []

    def kill() -> None:
        wait_for(lambda: len(begun.lines("begin")) > 3)
        name, process = begun.lines("begin")[-1]
        os.kill(process, signal.SIGKILL)
        killed.append(name)

    found = batch(tmp_path / "outputs")
    killer = during(begun, kill)
    report = make([found], None, begun.address)
    killer.join()
    most = max(last - first + 1 for first, last in chunks(range(1, FRAMES + 1), 3, FRAMES))
    print(f"killed in {killed}; {twice(begun)} frames begun twice, chunks of {most}; {report.hosts}")
    assert killed
    assert twice(begun) <= most
    assert_same(found.experiment, serial)


def test_workers_killed_again_and_again_lose_nothing(
    begun: Farm, serial: cache.Experiment, tmp_path: Path
) -> None:
    killed: set[int] = set()

    def kill() -> None:
        while len(killed) < 5:
            wait_for(lambda: any(process not in killed for _, process in begun.lines("begin")))
            fresh = [process for _, process in begun.lines("begin") if process not in killed]
            os.kill(fresh[-1], signal.SIGKILL)
            killed.add(fresh[-1])

    found = batch(tmp_path / "outputs")
    killer = during(begun, kill)
    make([found], None, begun.address)
    killer.join()
    print(f"killed {len(killed)} workers; {twice(begun)} frames begun twice")
    assert_same(found.experiment, serial)


def test_a_scheduler_that_is_restarted_goes_on_with_what_is_missing(
    begun: Farm, serial: cache.Experiment, tmp_path: Path
) -> None:
    def restart() -> None:
        wait_for(lambda: len(begun.lines("end")) > 3)
        os.killpg(begun.scheduler.pid, signal.SIGKILL)
        begun.scheduler.wait()
        begun.scheduler = begun.start_scheduler()

    found = batch(tmp_path / "outputs")
    thread = during(begun, restart)
    make([found], None, begun.address)
    thread.join()
    ended = Counter(name for name, _ in begun.lines("end"))
    print(f"{sum(count > 1 for count in ended.values())} of {FRAMES} frames made twice")
    assert_same(found.experiment, serial)


def test_experiments_are_tasks_and_share_what_they_have_in_common(
    begun: Farm, serial: cache.Experiment, tmp_path: Path
) -> None:
    first = batch(tmp_path / "outputs")
    second = batch(tmp_path / "outputs", "name=brighter", "render.exposure=2.0", f"simulate.frames={FRAMES}")
    report = make([first, second], None, begun.address, frames=range(1, 4))
    assert report.made == 6
    assert first.experiment.guides.samefile(second.experiment.guides)
    made, wanted = pictures(first.experiment), pictures(serial)
    assert made == {name: wanted[name] for name in made}
    assert len(made) == len(pictures(second.experiment)) == 3


def test_what_the_user_has_to_mend_is_told_as_such(begun: Farm, tmp_path: Path) -> None:
    found = batch(tmp_path / "outputs")
    found.experiment.folder.parent.mkdir()
    found.experiment.folder.write_text("a file where a folder belongs")
    with pytest.raises(InputError) as caught:
        make([found], None, begun.address)
    assert str(caught.value).startswith(str(found.experiment.folder))
    assert "Traceback" not in str(caught.value)


def test_nothing_to_do_starts_nothing(serial: cache.Experiment) -> None:
    fresh = batch(serial.folder.parent)
    assert make([fresh], 3, "").made == 0
    assert make([fresh], None, "tcp://127.0.0.1:9").made == 0


def test_chunks_cover_the_frames_and_are_small_enough_for_all_workers() -> None:
    frames = [1, 2, 3, 7, 8, 9, 10, 11]
    found = chunks(frames, 2, len(frames))
    assert found == [(1, 1), (2, 2), (3, 3), (7, 7), (8, 8), (9, 9), (10, 10), (11, 11)]
    many = chunks(range(1, 1001), 2, 1000)
    assert {last - first + 1 for first, last in many} <= {LARGEST_CHUNK, 1000 % LARGEST_CHUNK}
    covered = [frame for first, last in many for frame in range(first, last + 1)]
    assert covered == list(range(1, 1001))


@pytest.mark.parametrize(
    ("workers", "scheduler", "said"),
    [
        (2, "tcp://127.0.0.1:9", "give one of them"),
        (0, "", "--workers 0: expected a number above 0"),
        (None, "nonsense://x", "--scheduler nonsense://x: expected an address"),
    ],
)
def test_wrong_options_are_told(tmp_path: Path, workers: int | None, scheduler: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        make([batch(tmp_path / "outputs")], workers, scheduler)
