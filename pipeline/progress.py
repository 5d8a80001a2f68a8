"""How far a long job is: a bar on a terminal, a line every few seconds elsewhere and in the logs."""

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from typing import Protocol

from pipeline import log

HEARTBEAT_S = 5.0


class Bar(Protocol):
    """What `track` hands out."""

    def advance(self, count: int = 1) -> None:
        """Report that `count` more units are done."""


def say(stage: str, message: str) -> None:
    """Say one line about a stage."""
    log.emit(stage, "message", message)


def warn(stage: str, message: str) -> None:
    """Say one line that the run's report repeats: something is not as the user may think."""
    log.emit(stage, "warning", message)


@contextmanager
def track(stage: str, total: int, unit: str = "frame") -> Iterator[Bar]:
    """Show the progress of `total` units; the last line tells the time that they took."""
    start = time.monotonic()
    drawn = _terminal_bar(stage, total) if sys.stderr.isatty() else nullcontext()
    with drawn as bar:
        yield _Heartbeat(stage, total, unit, bar)
    seconds = time.monotonic() - start
    text = f"{total} {unit}{'' if total == 1 else 's'} in {_clock(seconds)}"
    log.emit(stage, "message", text, unit=unit, done=total, total=total, seconds=round(seconds, 3))


class _Heartbeat:
    def __init__(self, stage: str, total: int, unit: str, bar: Bar | None) -> None:
        self.stage, self.total, self.unit, self.bar = stage, total, unit, bar
        self.done = 0
        self.start = self.last = time.monotonic()

    def advance(self, count: int = 1) -> None:
        self.done += count
        if self.bar is not None:
            self.bar.advance(count)
        now = time.monotonic()
        if now - self.last < HEARTBEAT_S or self.done >= self.total:
            return
        self.last = now
        rate = self.done / (now - self.start)
        left = (self.total - self.done) / rate
        log.emit(
            self.stage,
            "progress",
            f"{self.unit} {self.done}/{self.total}, {rate:.3g} {self.unit}s/s, {_clock(left)} left",
            shown=self.bar is None,
            unit=self.unit,
            done=self.done,
            total=self.total,
            rate=rate,
            left_s=round(left, 1),
        )


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
