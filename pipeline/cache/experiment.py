"""The folder of one experiment, outputs/<name>/: where its files are, and who is working on it."""

import fcntl
import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from pipeline.cache.atomic import remove_stale
from pipeline.progress import say


@dataclass(frozen=True)
class Experiment:
    """Paths of an experiment; nothing is created before something is written."""

    folder: Path

    @property
    def groom(self) -> Path:
        """All strands at rest, their guides and the head."""
        return self.folder / "groom.h5"

    @property
    def guides(self) -> Path:
        """The guides in motion."""
        return self.folder / "guides.h5"

    @property
    def strands(self) -> Path:
        """The full count of strands and the guides that they follow."""
        return self.folder / "strands.h5"

    @property
    def frames(self) -> Path:
        """The folder of the pictures."""
        return self.folder / "frames"

    @property
    def log(self) -> Path:
        """What its runs have said, as JSON lines (see pipeline/log.py)."""
        return self.folder / "log.jsonl"

    @contextmanager
    def working_on(self, stage: str) -> Iterator[None]:
        """Keep other processes away from a stage while it is made; waits, and says so, while one is at it.

        The lock dies with its process. Temporary files of dead processes are removed on the way.
        """
        locks = self.folder / "locks"
        locks.mkdir(parents=True, exist_ok=True)
        with (locks / stage).open("a+") as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                lock.seek(0)
                say(stage, f"waiting for {lock.read() or 'another process'}, which makes {self.folder}")
                fcntl.flock(lock, fcntl.LOCK_EX)
            lock.truncate(0)
            lock.write(f"process {os.getpid()} on {socket.gethostname()}")
            lock.flush()
            for folder in (self.folder, self.frames, self.guides.with_suffix(".segments")):
                remove_stale(folder)
            yield
