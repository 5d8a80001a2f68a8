"""Locks between processes, also on several machines that share a folder: they die with their process."""

import fcntl
import os
import socket
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from pipeline.progress import say

_FLOCK = "hhqqi"  # struct flock of fcntl(2): type, whence, start, length, process
_EVERYTHING = 1 << 40


@contextmanager
def locked(path: Path, stage: str, what: str, rows: range | None = None) -> Iterator[None]:
    """Keep other processes away from `rows` (all, unless given) of what a file stands for.

    Waits while one of them is held, and says who `what` waits for. Threads of one process do not exclude each other.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    length, start = (len(rows), rows.start) if rows else (0, 0)
    with path.open("a+") as lock:
        try:
            fcntl.lockf(lock, fcntl.LOCK_EX | fcntl.LOCK_NB, length, start)
        except BlockingIOError:
            others = ", ".join(_holders(lock.fileno(), start, length)) or "another process"
            say(stage, f"waiting for {others}, which makes {what}")
            fcntl.lockf(lock, fcntl.LOCK_EX, length, start)
        yield


def holders(path: Path) -> list[str]:
    """The processes that hold a part of a file, as "process 12 on host"; of other machines maybe under another number."""
    if not path.exists():
        return []
    with path.open("rb") as lock:
        return _holders(lock.fileno(), 0, 0)


def _holders(lock: int, start: int, length: int) -> list[str]:
    """Ask for one holder after the other."""
    end = start + length if length else _EVERYTHING
    found: dict[str, None] = {}
    while start < end:
        asked = struct.pack(_FLOCK, fcntl.F_WRLCK, os.SEEK_SET, start, end - start, 0)
        kind, _, at, count, process = struct.unpack(_FLOCK, fcntl.fcntl(lock, fcntl.F_GETLK, asked))
        if kind == fcntl.F_UNLCK:
            break
        found[f"process {process} on {socket.gethostname()}"] = None
        start = at + count if count else end
    return list(found)
