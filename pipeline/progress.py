"""How far a long job is, on standard error: a bar on a terminal, a plain line every few seconds elsewhere."""

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Protocol

HEARTBEAT_S = 5.0


class Bar(Protocol):
    """What `track` hands out."""

    def advance(self, count: int = 1) -> None:
        """Report that `count` more units are done."""


def say(stage: str, message: str) -> None:
    """Write one plain log line."""
    print(f"{stage}: {message}", file=sys.stderr, flush=True)


@contextmanager
def track(stage: str, total: int, unit: str = "frame") -> Iterator[Bar]:
    """Show the progress of `total` units; the last line tells the time that they took."""
    start = time.monotonic()
    with _terminal_bar(stage, total) if sys.stderr.isatty() else _heartbeat(stage, total, unit) as bar:
        yield bar
    say(stage, f"{total} {unit}{'' if total == 1 else 's'} in {_clock(time.monotonic() - start)}")


class _Heartbeat:
    def __init__(self, stage: str, total: int, unit: str) -> None:
        self.stage, self.total, self.unit = stage, total, unit
        self.done = 0
        self.start = self.last = time.monotonic()

    def advance(self, count: int = 1) -> None:
        self.done += count
        now = time.monotonic()
        if now - self.last < HEARTBEAT_S or self.done >= self.total:
            return
        self.last = now
        rate = self.done / (now - self.start)
        left = _clock((self.total - self.done) / rate)
        say(self.stage, f"{self.unit} {self.done}/{self.total}, {rate:.3g} {self.unit}s/s, {left} left")


@contextmanager
def _heartbeat(stage: str, total: int, unit: str) -> Iterator[Bar]:
    yield _Heartbeat(stage, total, unit)


@contextmanager
def _terminal_bar(stage: str, total: int) -> Iterator[Bar]:
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn(stage), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task(stage, total=total)

        class Advance:
            def advance(self, count: int = 1) -> None:
                progress.advance(task, count)

        yield Advance()


def _clock(seconds: float) -> str:
    if seconds < 60:
        return f"{seconds:.1f} s"
    return f"{int(seconds) // 60} min {int(seconds) % 60} s"
