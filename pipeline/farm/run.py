"""Make experiments on workers: what is stale becomes tasks; whatever is lost on the way is found stale and made again."""

import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pipeline import log
from pipeline.batch.stages import Batch
from pipeline.cache import Experiment
from pipeline.config import NEEDS, STAGES
from pipeline.errors import InputError
from pipeline.farm import tasks
from pipeline.farm.cluster import ATTEMPTS, connected, local_cluster, need_distributed
from pipeline.progress import Bar, say, track, warn

if TYPE_CHECKING:
    from distributed import Client, Future

PATIENCE_S = 120.0  # how long a scheduler that is gone may take to come back
CHUNKS_PER_WORKER = 4
LARGEST_CHUNK = 16  # frames; a worker that dies loses at most these
_AGAIN_S = 1.0


class SchedulerGone(Exception):
    """The connection to the scheduler broke."""


@dataclass
class Report:
    """What a run on workers did."""

    made: int = 0
    """Frames that tasks have made."""
    seconds: float = 0.0
    """Time that workers have spent, in all."""
    hosts: Counter[str] = field(default_factory=Counter)
    """Tasks of each machine."""
    kernels: set[str] = field(default_factory=set)
    """Variants of the kernels; pictures of different ones may differ in last digits."""
    errors: dict[str, str] = field(default_factory=dict)
    """By experiment: what the user has to mend."""

    def add(self, name: str, outcome: tasks.Outcome) -> None:
        """Count the outcome of one task."""
        self.made += outcome.made
        self.seconds += outcome.seconds
        if outcome.fault:
            raise RuntimeError(f"on a worker:\n{outcome.fault}")
        if outcome.error:
            self.errors.setdefault(name, outcome.error)
        else:
            self.hosts[outcome.host] += 1
            self.kernels.add(outcome.kernels)


def make(
    batches: Sequence[Batch],
    workers: int | None,
    scheduler: str,
    until: str = "render",
    frames: range | None = None,
) -> Report:
    """Make experiments on `workers` processes of this machine, started if there is something to do, or on a scheduler's.

    As `make_on`; raises InputError also when both or nonsense are given.
    """
    if workers is not None and scheduler:
        raise InputError("--workers starts workers, --scheduler uses those that are there; give one of them")
    need_distributed()
    stages = STAGES[: STAGES.index(until) + 1]
    if all(
        batch.state(stage, frames if stage == "render" else None).fresh
        for batch in batches
        for stage in stages
    ):
        return Report()
    if scheduler:
        return make_on(scheduler, batches, until, frames)
    with local_cluster(1 if workers is None else workers) as address:
        return make_on(address, batches, until, frames)


def make_on(
    address: str, batches: Sequence[Batch], until: str = "render", frames: range | None = None
) -> Report:
    """Make every stage up to `until`, and these frames or all, of some experiments on the workers of a scheduler.

    Goes on where it was when the scheduler is restarted. An experiment that cannot be made does not stop the others;
    raises InputError of all such at the end, or when the scheduler stays away.
    """
    report, lost_at = Report(), None
    while True:
        try:
            with connected(address) as client:
                if lost_at is not None:
                    say("farm", "the scheduler is back; going on with what is missing")
                    lost_at = None
                _round(client, batches, until, frames, report)
            break
        except (SchedulerGone, OSError) as error:
            if isinstance(error, OSError) and error.filename is not None:
                raise
            now = time.monotonic()
            if lost_at is None:
                lost_at = now
                warn("farm", f"no scheduler at {address}; waiting {PATIENCE_S:.0f} s for it")
            if now - lost_at > PATIENCE_S:
                raise InputError(
                    f"--scheduler {address}: no answer for {PATIENCE_S:.0f} s; start it with `dask scheduler` and run "
                    "the same command again; what is finished stays"
                ) from None
            time.sleep(_AGAIN_S)
    _conclude(report, len(batches))
    return report


def chunks(frames: Sequence[int], workers: int, in_all: int) -> list[tuple[int, int]]:
    """First and last of the pieces in which frames (ascending) are made; `in_all` frames are shared by the workers."""
    size = min(max(1, -(-in_all // (CHUNKS_PER_WORKER * max(workers, 1)))), LARGEST_CHUNK)
    pieces = [frames[at : at + size] for at in range(0, len(frames), size)]
    return [(piece[0], piece[-1]) for piece in pieces]


def _round(
    client: "Client", batches: Sequence[Batch], until: str, frames: range | None, report: Report
) -> None:
    """Submit what is stale and wait for it. Raises SchedulerGone."""
    plan = _Plan(client, batches, STAGES[: STAGES.index(until) + 1])
    if until == "render":
        plan.add_frames(frames)
    client.subscribe_topic(tasks.TOPIC, _replay)
    with track("farm", plan.frames or len(plan.futures), "frame" if plan.frames else "stage") as bar:
        _collect(client, plan, bar, report)


class _Plan:
    """The tasks of one round: equal keys of several experiments are one task."""

    def __init__(self, client: "Client", batches: Sequence[Batch], stages: Sequence[str]) -> None:
        self.client, self.batches = client, list(batches)
        self.futures: dict[Future, tuple[str, int]] = {}
        """The experiment, and how many frames."""
        self.frames = 0
        self._made: dict[str, Future] = {}
        self._round = f"{time.time_ns():x}"
        for batch in self.batches:
            for stage in stages:
                if stage != "render":
                    self._add_stage(batch, stage)

    def add_frames(self, frames: range | None) -> None:
        """Submit the frames that are stale, of one experiment after the other."""
        stale = [batch.state("render", frames).frames for batch in self.batches]
        self.frames, count = sum(map(len, stale)), len(self.client.scheduler_info(n_workers=-1)["workers"])
        for batch, missing in zip(self.batches, stale, strict=True):
            job, after = tasks.Job.of(batch), self._before(batch, "render")
            for first, last in chunks(missing, count, self.frames):
                number = sum(first <= frame <= last for frame in missing)
                name = f"{batch.experiment.folder.name}-frames-{first}-{last}-{self._round}"
                future = self.client.submit(tasks.render, job, first, last, after, key=name, pure=False)
                self.futures[future] = (batch.experiment.folder.name, number)

    def _add_stage(self, batch: Batch, stage: str) -> None:
        key = batch.keys[stage]
        if key in self._made or batch.state(stage).fresh:
            return
        job, after = tasks.Job.of(batch), self._before(batch, stage)
        name = f"{stage}-{key}-{self._round}"
        future = self.client.submit(tasks.make_stage, job, stage, after, key=name, pure=False)
        self._made[key] = future
        self.futures[future] = (batch.experiment.folder.name, 0)

    def _before(self, batch: Batch, stage: str) -> list["Future"]:
        keys = [batch.keys[name] for name in NEEDS[stage]]
        return [self._made[key] for key in keys if key in self._made]


def _collect(client: "Client", plan: _Plan, bar: Bar, report: Report) -> None:
    from distributed import as_completed
    from distributed.client import FutureCancelledError
    from distributed.scheduler import KilledWorker

    for future in as_completed(list(plan.futures), loop=client.loop):
        name, frames = plan.futures[future]
        try:
            report.add(name, future.result())
        except KilledWorker as error:
            raise InputError(
                f"{error.task.partition('-')[0]}: {ATTEMPTS} workers died over this task, the last on "
                f"{error.last_worker.address}; maybe their memory does not suffice: `ringlet plan` tells what is needed"
            ) from None
        except (FutureCancelledError, TimeoutError, OSError) as error:
            if client.status == "running" and not isinstance(error, FutureCancelledError):
                raise
            raise SchedulerGone from error
        if frames or not plan.frames:
            bar.advance(frames or 1)


def _replay(event: tuple[float, dict[str, Any]]) -> None:
    """Say here what a worker says, and keep it in its experiment's log; of frames only warnings, for there is a bar."""
    record = event[1]
    shown = record["stage"] != "render" or record["event"] == "warning"
    log.replay(record, shown=shown, also=Experiment(Path(record["folder"])).log)


def _conclude(report: Report, experiments: int) -> None:
    if len(report.kernels) > 1:
        warn(
            "farm",
            f"workers have different kernels ({', '.join(sorted(report.kernels))}): their pictures differ in last "
            "digits; set RINGLET_KERNELS to the same on all of them",
        )
    if report.errors:
        alone = experiments == 1
        raise InputError.joined(
            error if alone else f"{name}: {error}" for name, error in report.errors.items()
        )
