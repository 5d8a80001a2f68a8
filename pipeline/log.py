"""What a run says: plain or JSON lines on standard error, and JSON lines in its experiment's log.

A line of JSON has

    time                          UTC
    run                           which call of ringlet; several may write to one log at once
    stage, event, text            event: message, warning, error, begin, progress, end; of a whole call: run, exit
    memory_gb                     resident memory of the process [GB]

and what the event brings along: progress has unit, done, total, rate [1/s] and left_s [s]; end has seconds and peak_gb;
run has pid, host, arguments and version; exit has code, seconds and peak_gb. Saying something never fails: a log that
cannot be written is given up, and a closed terminal stops no batch.
"""

import importlib.metadata
import json
import os
import resource
import socket
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Literal

from pipeline.errors import DONE, verdict

Format = Literal["text", "json"]
Record = dict[str, Any]

_LARGEST = 4 << 20  # bytes of a log before it is put aside
_KEPT = 3  # logs put aside
_GB = 1e9
_QUIET_IN_TEXT = ("end", "run", "exit")

_run = f"{socket.gethostname()}-{os.getpid()}-{time.time_ns():x}"
_format: Format = "text"
_files: list[Path] = []
_sinks: list[Callable[[Record], None]] = []


def use(format: Format) -> None:  # noqa: A002, the word of the option
    """Choose how standard error is written from now on."""
    global _format
    _format = format


def emit(stage: str, event: str, text: str, *, shown: bool = True, **figures: Any) -> None:
    """Say something: one line on standard error, unless it is not to be `shown`, and one in every log."""
    record = {
        "time": datetime.now(UTC).isoformat(timespec="milliseconds"),
        "run": _run,
        "stage": stage,
        "event": event,
        "text": text,
        "memory_gb": round(_resident() / _GB, 3),
    }
    replay(record | figures, shown=shown)


def replay(record: Record, *, shown: bool = True, also: Path | None = None) -> None:
    """Say what was said in another process, with its own time, run and memory; and keep it `also` in a log."""
    if _sinks:
        _sinks[-1](record)
        return
    line = json.dumps(record, ensure_ascii=False, default=str)
    if _format == "json":
        _print(line)
    elif shown and record["event"] not in _QUIET_IN_TEXT:
        _print(record["text"] if record["event"] == "error" else f"{record['stage']}: {record['text']}")
    for path in {file.resolve(): file for file in (*_files, *([also] if also else []))}.values():
        _append(path, line)


@contextmanager
def forwarded_to(sink: Callable[[Record], None]) -> Iterator[None]:
    """Hand all that is said in this block to `sink`, and to nobody else: for workers without a voice of their own."""
    _sinks.append(sink)
    try:
        yield
    finally:
        _sinks.remove(sink)


def error(text: str) -> None:
    """Say what ended the call; in plain text as it is."""
    emit("ringlet", "error", text)


@contextmanager
def kept_in(path: Path) -> Iterator[None]:
    """Append all that is said in this block to a file of JSON lines, from its first line "run" to "exit"."""
    _put_aside(path)
    _files.append(path)
    start = time.monotonic()
    emit(
        "ringlet",
        "run",
        " ".join(sys.argv[1:]),
        pid=os.getpid(),
        host=socket.gethostname(),
        arguments=sys.argv[1:],
        version=importlib.metadata.version("ringlet"),
    )
    code, text = DONE, "done"
    try:
        yield
    except BaseException as error:
        code, text = verdict(error)
        raise
    finally:
        seconds = round(time.monotonic() - start, 3)
        emit("ringlet", "exit", text, code=code, seconds=seconds, peak_gb=round(peak_gb(), 3))
        with suppress(ValueError):  # given up
            _files.remove(path)


def records(path: Path) -> Iterator[Record]:
    """What a log and those put aside before it tell, oldest first; lines that are not whole are passed over."""
    for file in (*(_older(path, age) for age in range(_KEPT, 0, -1)), path):
        if not file.exists():
            continue
        for line in file.read_text(encoding="utf-8", errors="replace").splitlines():
            with suppress(ValueError):
                record = json.loads(line)
                if isinstance(record, dict):
                    yield record


def peak_gb() -> float:
    """Most memory that this process has used so far [GB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / _GB


def _print(line: str) -> None:
    with suppress(OSError, ValueError):
        print(line, file=sys.stderr, flush=True)


def _append(path: Path, line: str) -> None:
    """Write a line in one piece, so that lines of several processes do not mix."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handle = os.open(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o666)
        try:
            os.write(handle, f"{line}\n".encode(errors="replace"))
        finally:
            os.close(handle)
    except OSError:
        with suppress(ValueError):
            _files.remove(path)


def _put_aside(path: Path) -> None:
    """Rename a log that has grown large: log.jsonl becomes log.1.jsonl, and so on; the oldest goes."""
    with suppress(OSError):
        if path.stat().st_size < _LARGEST:
            return
        older = [path, *(_older(path, age) for age in range(1, _KEPT + 1))]
        for newer, name in zip(older[-2::-1], older[:0:-1], strict=True):
            if newer.exists():
                newer.replace(name)


def _older(path: Path, age: int) -> Path:
    return path.with_suffix(f".{age}{path.suffix}")


def _resident() -> int:
    try:
        return int(Path("/proc/self/statm").read_text().split()[1]) * resource.getpagesize()
    except OSError:
        return 0
