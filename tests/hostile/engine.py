"""Reads damaged files by the thousand, each under the limits of its size, in processes that may die of it.

Address space that is in use already, 64 MB and 64 bytes for each byte of the file; 5 s of processor time. A library that
crashes on a file is contained when production, which reads such files in a process of their own, makes a message of it.
"""

import faulthandler
import os
import resource
import signal
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO

import numpy as np

from pipeline.errors import InputError
from tests.hostile.damage import damaged

SECONDS = 5  # of processor time
PATIENCE = 12  # elapsed seconds for each: other processes need theirs
BATCH = 200  # files that one process reads
MEMORY, MEMORY_PER_BYTE = 64 << 20, 64
READ, REFUSED = "read", "refused"

Rng = np.random.Generator


@dataclass(frozen=True)
class Target:
    """A reader and files that it can read."""

    name: str
    ending: str
    whole: list[bytes]
    read: Callable[[Path], object]
    """Reads a file, or raises InputError that names it."""
    fits: Callable[[object], bool] = lambda _: True
    """Whether what was read fits together."""
    contained: Callable[[Path], object] | None = None
    """How production reads a file where `read` may crash."""
    damage: Callable[[bytes, Rng], bytes] = damaged

    def make(self, path: Path, seed: int, number: int) -> int:
        """Write the file of a number; returns its size."""
        rng = np.random.default_rng([seed, number, *self.name.encode()])
        data = self.damage(self.whole[rng.integers(len(self.whole))], rng)
        path.write_bytes(data)
        return len(data)


@dataclass
class Tally:
    """What came of files: how many of each outcome, and the most that one of them took."""

    outcomes: dict[str, int] = field(default_factory=dict)
    seconds: float = 0.0
    """Processor time."""
    kilobytes: int = 0
    """That a process of many files grew by, its largest one and those before it together."""

    @property
    def files(self) -> int:
        return sum(self.outcomes.values())

    def add(self, outcome: str, seconds: float, kilobytes: int) -> None:
        self.outcomes[outcome] = self.outcomes.get(outcome, 0) + 1
        self.seconds, self.kilobytes = max(self.seconds, seconds), max(self.kilobytes, kilobytes)


def fuzz(
    target: Target,
    numbers: range,
    seed: int,
    folder: Path,
    keep: Path | None = None,
    total: Tally | None = None,
) -> Tally:
    """Damage and read files of these numbers; `total` with what came out. Those that broke something are kept in a folder."""
    path, total = folder / f"damaged{target.ending}", total or Tally()
    for number, (outcome, *cost) in zip(numbers, watched(target, path, seed, numbers), strict=True):
        total.add(outcome, *cost)
        if keep and not held(outcome):
            keep.mkdir(exist_ok=True, parents=True)
            target.make(keep / f"{target.name}-{number}{target.ending}", seed, number)
    path.unlink(missing_ok=True)
    return total


def held(outcome: str) -> bool:
    """Whether an outcome is one of those that are promised."""
    return outcome in (READ, REFUSED) or outcome.startswith("contained")


def judged(target: Target, read: Callable[[Path], object], path: Path) -> str:
    """What comes of reading a file: READ, REFUSED or what is wrong with that."""
    try:
        found = read(path)
    except InputError as error:
        return REFUSED if path.name in str(error) else f"nameless message: {error}"
    except Exception as error:  # noqa: BLE001, any other is what is looked for
        return type(error).__name__
    return READ if target.fits(found) else "what was read does not fit together"


def watched(target: Target, path: Path, seed: int, numbers: range) -> Iterator[tuple[str, float, int]]:
    """What comes of files of these numbers and what that costs, as a `Tally` takes it; only those of libraries ought to end the process that reads them."""
    while numbers:
        batch = numbers[:BATCH]
        reading, writing = os.pipe()
        child = os.fork()
        if child == 0:
            os.close(reading)
            try:
                with os.fdopen(writing, "w") as outcomes:
                    _work(target, path, seed, batch, outcomes)
                os._exit(0)
            finally:
                os._exit(1)
        os.close(writing)
        with os.fdopen(reading) as outcomes:
            told = outcomes.read().splitlines()
        _, status = os.waitpid(child, 0)
        for number, line in zip(batch, told, strict=False):
            outcome, seconds, kilobytes = line.split("\t")
            if not held(outcome):
                target.make(path, seed, number)
                outcome = _told(target, path, outcome)
            yield outcome, float(seconds), int(kilobytes)
        code = os.waitstatus_to_exitcode(status)
        if code:
            target.make(path, seed, batch[len(told)])
            yield _told(target, path, signal.Signals(-code).name if code < 0 else f"exit code {code}"), 0.0, 0
        numbers = numbers[len(told) + bool(code) :]


def _work(target: Target, path: Path, seed: int, numbers: range, outcomes: IO[str]) -> None:
    """Damage and read files one after the other under limits, and say what comes of each; may die of it."""
    silence = os.open(os.devnull, os.O_WRONLY)
    os.dup2(silence, 1)
    os.dup2(silence, 2)
    faulthandler.disable()
    signal.signal(signal.SIGPROF, signal.SIG_DFL)
    signal.signal(signal.SIGALRM, signal.SIG_DFL)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    begin = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize() + MEMORY
    resident = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for number in numbers:
        size = target.make(path, seed, number)
        resource.setrlimit(resource.RLIMIT_AS, (begin + MEMORY_PER_BYTE * size, resource.RLIM_INFINITY))
        signal.setitimer(signal.ITIMER_PROF, SECONDS)
        signal.setitimer(signal.ITIMER_REAL, PATIENCE * SECONDS)
        start = time.process_time()
        outcome = " ".join(judged(target, target.read, path).split())
        grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - resident
        outcomes.write(f"{outcome}\t{time.process_time() - start:.3f}\t{grown}\n")
        outcomes.flush()


def _told(target: Target, path: Path, what: str) -> str:
    """What production makes of a file that broke its reader."""
    if target.contained is None:
        return what
    outcome = judged(target, target.contained, path)
    return f"contained: {what}" if outcome in (READ, REFUSED) else f"{what}: {outcome}"
