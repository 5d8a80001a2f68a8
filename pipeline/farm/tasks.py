"""What a worker does: make one stage, or some frames, of an experiment."""

import os
import socket
import threading
import time
import traceback
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline import kernels, log
from pipeline.batch.stages import Batch, identity
from pipeline.cache import Experiment
from pipeline.config import NEEDS, Config
from pipeline.errors import FAULT, InputError, verdict

if TYPE_CHECKING:
    from pipeline.render.stage import Frames

TOPIC = "ringlet"
THREADS = "RINGLET_THREADS"  # environment variable: how many threads the kernels of a worker have

_SAID = ("begin", "end", "message", "warning")
_one_at_a_time = (
    threading.Lock()
)  # a worker with several threads would make things side by side in one process


@dataclass(frozen=True)
class Job:
    """One experiment, as it travels to the workers."""

    config: str
    """JSON of its validated values; names of files are absolute."""
    folder: str
    """Its folder, on a file system that all machines share."""
    keys: tuple[tuple[str, str], ...]
    """The key of every stage, as whoever submits it has found them."""

    @classmethod
    def of(cls, batch: Batch) -> "Job":
        """The job of an experiment."""
        folder = str(batch.experiment.folder.resolve())
        return cls(batch.config.model_dump_json(), folder, tuple(batch.keys.items()))

    def batch(self) -> Batch:
        """Its stages, as this process sees them; raises InputError when it sees other files or another program."""
        batch = _WorkersBatch(Config.model_validate_json(self.config), Experiment(Path(self.folder)))
        if tuple(batch.keys.items()) != self.keys:
            raise InputError(
                f"worker on {socket.gethostname()}: its ringlet, or a file that the config names, is not the same "
                "as where the run was started; install the same version everywhere and share the files"
            )
        return batch


@dataclass(frozen=True)
class Outcome:
    """What became of a task; small, for it passes through the scheduler."""

    seconds: float = 0.0
    host: str = ""
    kernels: str = ""
    made: int = 0
    """Frames that were not fresh."""
    error: str = ""
    """What went wrong, mostly for the user to mend; later tasks pass it on."""
    fault: str = ""
    """Where, if it is a fault of ringlet."""


class _WorkersBatch(Batch):
    """Keeps the last experiment whose frames it has rendered open, for the next chunk of them."""

    def execute(self, stage: str, frames: tuple[int, ...]) -> None:
        """Run the code of a stage."""
        if stage != "render":
            _kept.close()
            super().execute(stage, frames)
            return
        _kept.frames_of(self).render(frames)


class _Kept(threading.local):
    """An open renderer, of the thread that draws by it."""

    def __init__(self) -> None:
        self._what: tuple[Any, ...] = ()
        self._open = ExitStack()
        self._frames: Frames | None = None

    def frames_of(self, batch: Batch) -> "Frames":
        """The frames of an experiment; opens them where its files are others than the last ones."""
        from pipeline.render.stage import open_frames

        files = [identity(batch.file(stage)) for stage in NEEDS["render"]]
        what = (batch.keys["render"], batch.experiment.folder, *files)
        if self._frames is None or self._what != what:
            self.close()
            opened = open_frames(batch.config, batch.experiment, batch.keys["render"])
            self._frames, self._what = self._open.enter_context(opened), what
        return self._frames

    def close(self) -> None:
        """Give the memory back."""
        self._frames = None
        self._open.close()


_kept = _Kept()


def make_stage(job: Job, stage: str, after: Sequence[Outcome]) -> Outcome:
    """Make a stage before the render unless it is fresh."""
    return _guarded(job, after, lambda: _make_stage(job, stage))


def render(job: Job, first: int, last: int, after: Sequence[Outcome]) -> Outcome:
    """Make frames, numbered from 1, unless they are fresh."""
    return _guarded(job, after, lambda: _render(job, range(first, last + 1)))


def _make_stage(job: Job, stage: str) -> int:
    job.batch().make(stage, touch=False)
    return 0


def _render(job: Job, frames: range) -> int:
    batch = job.batch()
    stale = len(batch.state("render", frames).frames)
    if stale:
        for stage in NEEDS["render"]:
            batch.make(stage, touch=False)
        batch.make("render", frames, touch=False)
    return stale


def _guarded(job: Job, after: Sequence[Outcome], work: Callable[[], int]) -> Outcome:
    """Do the work, unless something before it failed; errors come back as text, which every process can read."""
    failed = next((outcome for outcome in after if outcome.error), None)
    if failed is not None:
        return Outcome(error=failed.error, fault=failed.fault)
    start, made, error, fault = time.monotonic(), 0, "", ""
    with _one_at_a_time, log.forwarded_to(partial(_tell, job.folder)):
        kernels.set_threads(_threads())
        try:
            made = work()
        except Exception as wrong:  # noqa: BLE001, told where the run was started
            _kept.close()
            code, error = verdict(wrong)
            fault = traceback.format_exc() if code == FAULT else ""
    return Outcome(time.monotonic() - start, socket.gethostname(), kernels.VARIANT, made, error, fault)


def _threads() -> int:
    from distributed import get_worker

    return int(os.environ.get(THREADS) or get_worker().state.nthreads)


def _tell(folder: str, record: dict[str, Any]) -> None:
    """Send what is said to whoever started the run; its own bar counts the frames."""
    from distributed import get_worker

    if record["event"] in _SAID:
        get_worker().log_event(TOPIC, record | {"folder": folder})
