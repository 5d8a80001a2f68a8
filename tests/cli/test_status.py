"""`ringlet status`: what is there, what it takes, who is at work, and how the last run ended."""

import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import fake_ringlet
import numpy as np
import pytest
from small_configs import SWATCH

from pipeline import cache, log
from pipeline.batch.stages import Batch
from pipeline.cli.main import call
from pipeline.cli.status import examine, lines
from pipeline.config import load

CONFIG = SWATCH + "[simulate]\nframes = 9\n"

Status = Callable[..., dict[str, Any]]


@pytest.fixture
def status(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Status:
    fake_ringlet.fake(monkeypatch)
    config = tmp_path / "x.toml"
    config.write_text(CONFIG)

    def ask(*settings: str) -> dict[str, Any]:
        batch = Batch(load(config, settings).config, cache.Experiment(tmp_path / "outputs" / "x"))
        found = examine(batch)
        print(*lines(found), sep="\n")
        return found

    return ask


def run(tmp_path: Path, *options: str, code: int = 0) -> None:
    assert call(["run", str(tmp_path / "x.toml"), "--outputs", str(tmp_path / "outputs"), *options]) == code


def stages(found: dict[str, Any]) -> dict[str, Any]:
    return {stage["name"]: stage for stage in found["stages"]}


def test_nothing_is_made_and_nothing_is_touched(status: Status, tmp_path: Path) -> None:
    found = status()
    assert [stage["fresh"] for stage in found["stages"]] == [False] * 4
    assert stages(found)["render"]["frames"] == {"done": 0, "total": 9}
    assert (found["disk"], found["last_run"]) == ({"bytes": 0, "shared_bytes": 0, "leftovers": []}, None)
    assert not (tmp_path / "outputs").exists()


def test_what_is_there_and_what_it_takes(status: Status, tmp_path: Path) -> None:
    run(tmp_path, "--frames", "2-5")
    found = status()
    by_name = stages(found)
    assert [by_name[name]["fresh"] for name in by_name] == [True, True, True, False]
    assert by_name["render"]["frames"] == {"done": 4, "total": 9}
    assert by_name["groom"]["bytes"] == (tmp_path / "outputs/x/groom.h5").stat().st_size
    assert by_name["groom"]["seconds"] >= 0
    assert found["disk"]["bytes"] >= sum(stage["bytes"] for stage in found["stages"])
    assert (found["last_run"]["code"], found["last_run"]["process"]) == (0, os.getpid())
    stale = stages(status("simulate.theta=0.7"))["simulate"]
    assert stale["reason"] == "simulate.theta: 0.6 -> 0.7"


def test_files_shared_with_other_experiments_are_told(status: Status, tmp_path: Path) -> None:
    run(tmp_path)
    before = status()["disk"]
    run(tmp_path, "-s", "name=y")
    after = status()["disk"]
    assert before["shared_bytes"] == 0
    assert 0 < after["shared_bytes"] <= after["bytes"]


def test_frames_that_a_simulation_has_kept_count(status: Status, tmp_path: Path) -> None:
    run(tmp_path, "--until", "groom")
    batch = Batch(load(tmp_path / "x.toml").config, cache.Experiment(tmp_path / "outputs" / "x"))
    segments = cache.Segments(batch.file("simulate"), batch.keys["simulate"])
    segments.resume()
    frame = cache.Frame(np.zeros((1, 8, 3), np.float32), np.eye(4), {})
    for count in (3, 2):
        segments.append([frame] * count, {})
    assert stages(status())["simulate"]["frames"] == {"done": 5, "total": 9}
    assert stages(status("simulate.theta=0.7"))["simulate"]["frames"]["done"] == 0
    kept = sorted(segments.folder.iterdir())
    kept[1].write_bytes(kept[1].read_bytes()[:-1])
    assert stages(status())["simulate"]["frames"]["done"] == 3
    assert sorted(segments.folder.iterdir()) == kept


def test_who_is_at_work_and_how_far(status: Status, tmp_path: Path) -> None:
    folder = tmp_path / "outputs" / "x"
    code = (
        "import sys; from pathlib import Path; from pipeline import cache, log, progress\n"
        "experiment = cache.Experiment(Path(sys.argv[1])); progress.HEARTBEAT_S = 0\n"
        "with log.kept_in(experiment.log), experiment.working_on('simulate'):\n"
        "    log.emit('simulate', 'begin', 'start')\n"
        "    with progress.track('simulate', 9) as bar:\n"
        "        bar.advance(4); print('in', flush=True); sys.stdin.readline()\n"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", code, str(folder)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "in\n"
    found = status()
    working = stages(found)["simulate"]
    assert [worker.split(" on ")[0] for worker in working["workers"]] == [f"process {process.pid}"]
    assert (working["progress"]["done"], working["progress"]["total"]) == (4, 9)
    assert stages(found)["groom"]["workers"] == []
    assert found["last_run"]["code"] is None
    process.kill()
    process.communicate()
    found = status()
    assert stages(found)["simulate"]["workers"] == []
    assert any("was ended by force" in line for line in lines(found))


def test_leftovers_of_killed_processes_are_told_until_the_next_run(status: Status, tmp_path: Path) -> None:
    dead = subprocess.Popen(["true"])
    dead.wait()
    run(tmp_path)
    import socket

    left = tmp_path / "outputs/x/frames" / f"0003.png.tmp.{socket.gethostname()}.{dead.pid}"
    left.touch()
    assert status()["disk"]["leftovers"] == [str(left)]
    shutil.rmtree(tmp_path / "outputs/x/locks")
    (tmp_path / "outputs/x/frames/0001.png").unlink()
    run(tmp_path)
    assert status()["disk"]["leftovers"] == []


def test_a_refused_run_says_why(status: Status, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from pipeline.errors import InputError

    def refuse(*_: object) -> None:
        raise InputError("x.toml:3: no such head")

    monkeypatch.setattr(Batch, "execute", refuse)
    run(tmp_path, code=2)
    found = status()
    assert (found["last_run"]["code"], found["last_run"]["end"]) == (2, "x.toml:3: no such head")
    assert [record["event"] for record in log.records(tmp_path / "outputs/x/log.jsonl")] == [
        "run",
        "begin",
        "exit",
    ]
