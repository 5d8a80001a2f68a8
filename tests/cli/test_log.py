"""What a run says: text for people, JSON lines for programs, and a log that never stands in the way."""

import json
import multiprocessing
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from pipeline import log, progress
from pipeline.errors import InputError, Stopped
from pipeline.progress import say, track, warn

ROOT = Path(__file__).parents[2]
COMMON = {"time", "run", "stage", "event", "text", "memory_gb"}


@pytest.fixture(autouse=True)
def _text() -> Iterator[None]:
    yield
    log.use("text")


def records(path: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in path.read_text().splitlines()]


def test_every_line_is_json_with_stage_frame_rate_memory_and_time_left(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(progress, "HEARTBEAT_S", 0.0)
    path = tmp_path / "x" / "log.jsonl"
    log.use("json")
    with log.kept_in(path):
        say("groom", "a head")
        warn("groom", 'ears "are" open\n\x1b[31m')
        with track("simulate", total=3) as bar:
            for _ in range(3):
                bar.advance()
    kept = records(path)
    assert [json.loads(line) for line in capsys.readouterr().err.splitlines()] == kept
    assert all(set(record) >= COMMON for record in kept)
    assert [record["event"] for record in kept] == [
        "run", "message", "warning", "progress", "progress", "message", "exit",
    ]  # fmt: skip
    assert {"pid", "host", "arguments", "version"} <= set(kept[0])
    assert kept[2]["text"] == 'ears "are" open\n\x1b[31m'
    heard = kept[3]
    assert (heard["stage"], heard["unit"], heard["done"], heard["total"]) == ("simulate", "frame", 1, 3)
    assert heard["rate"] > 0
    assert heard["left_s"] >= 0
    assert 0.005 < heard["memory_gb"] < 50
    assert (kept[-1]["code"], kept[-1]["text"]) == (0, "done")
    assert len({record["run"] for record in kept}) == 1


def test_text_says_what_people_need_and_the_log_keeps_the_rest(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with log.kept_in(tmp_path / "log.jsonl"):
        log.emit("groom", "begin", "start (not made yet)")
        log.emit("groom", "end", "made in 1 s", seconds=1.0)
    assert capsys.readouterr().err == "groom: start (not made yet)\n"
    assert [record["event"] for record in records(tmp_path / "log.jsonl")] == ["run", "begin", "end", "exit"]


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (InputError("x.toml:3: wrong"), 2),
        (Stopped(15), 143),
        (MemoryError(), 2),
        (ZeroDivisionError("0"), 70),
    ],
)
def test_the_last_line_tells_what_ended_the_run(tmp_path: Path, error: BaseException, code: int) -> None:
    with pytest.raises(type(error)), log.kept_in(tmp_path / "log.jsonl"):
        raise error
    last = records(tmp_path / "log.jsonl")[-1]
    assert (last["event"], last["code"]) == ("exit", code)
    assert str(error) in last["text"]


def test_a_log_that_cannot_be_written_stops_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "x").write_text("a file, no folder")
    with log.kept_in(tmp_path / "x" / "log.jsonl"):
        say("groom", "still here")
    assert capsys.readouterr().err == "groom: still here\n"


def test_a_closed_standard_error_stops_nothing(tmp_path: Path) -> None:
    code = (
        "import sys; from pathlib import Path; from pipeline import log; from pipeline.progress import say\n"
        "with log.kept_in(Path(sys.argv[1])):\n    for n in range(9): say('groom', str(n))"
    )
    read, write = os.pipe()
    os.close(read)
    path = tmp_path / "log.jsonl"
    done = subprocess.run([sys.executable, "-c", code, str(path)], cwd=ROOT, stderr=write)
    os.close(write)
    assert len(records(path)) == 11
    print(f"11 lines kept, exit code {done.returncode}")


def test_a_large_log_is_put_aside_and_the_oldest_goes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(log, "_LARGEST", 1000)
    path = tmp_path / "log.jsonl"
    for number in range(6):
        with log.kept_in(path):
            say("groom", f"run {number} " + "x" * 1000)
    assert sorted(file.name for file in tmp_path.iterdir()) == [
        "log.1.jsonl", "log.2.jsonl", "log.3.jsonl", "log.jsonl",
    ]  # fmt: skip
    said = {file.name: records(file)[1]["text"].split()[1] for file in tmp_path.iterdir()}
    assert said == {"log.jsonl": "5", "log.1.jsonl": "4", "log.2.jsonl": "3", "log.3.jsonl": "2"}


def test_what_a_worker_says_is_said_by_its_client(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    heard: list[dict[str, Any]] = []
    with log.forwarded_to(heard.append), track("render", total=2, unit="frame") as bar:
        say("render", "from afar")
        bar.advance(2)
    assert capsys.readouterr().err == ""
    with log.kept_in(tmp_path / "log.jsonl"):
        for record in heard:
            log.replay(record)
    assert records(tmp_path / "log.jsonl")[1:-1] == heard
    assert capsys.readouterr().err.splitlines()[0] == "render: from afar"


def _talk(path: Path, number: int) -> None:
    with log.kept_in(path):
        for line in range(200):
            say("render", f"{number} {line} " + "y" * 500)


def test_lines_of_two_processes_do_not_mix(tmp_path: Path) -> None:
    path = tmp_path / "log.jsonl"
    context = multiprocessing.get_context("spawn")
    talkers = [context.Process(target=_talk, args=(path, number)) for number in range(2)]
    for talker in talkers:
        talker.start()
    for talker in talkers:
        talker.join()
    kept = records(path)
    assert len(kept) == 2 * 202
    for number in range(2):
        said = [record["text"] for record in kept if record["text"].startswith(f"{number} ")]
        assert [int(text.split()[1]) for text in said] == list(range(200))
