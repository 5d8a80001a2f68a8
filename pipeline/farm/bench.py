"""What workers cost: the same frames by one process that has the processors for itself and by workers that share them.

A process told to use one thread uses more than one processor all the same, for it reads and lights the next frame and
writes the last one beside the drawing. So what is compared has the same processors: one process with all of them, and
one process that is held to a worker's share.
"""

import multiprocessing
import os
import shutil
import tempfile
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from pipeline import kernels, log
from pipeline.batch.stages import Batch
from pipeline.cache import Experiment
from pipeline.config.schema import Config, Groom, Render, Simulate
from pipeline.farm.cluster import connected, environment, local_cluster, share
from pipeline.farm.run import make_on
from pipeline.farm.tasks import Job


@dataclass(frozen=True)
class Spent:
    """Time that some frames took."""

    seconds: float
    processor: float
    """Seconds of processors, of all processes."""
    busy: float = 0.0
    """Seconds that workers had a task."""
    start: float = 0.0
    """Seconds before, until there were workers that had drawn."""


def bench(frames: int, workers: int, size: int, strands: int) -> dict[str, Any]:
    """Figures of `frames` square frames of `size` px by one process and by `workers` on the same processors.

    Clocks start when all have drawn some frames; cpu is the processor time of all processes: workers, scheduler, this one.
    `speed_up` is over one process on all processors, and both kinds of overhead are what a frame costs more than there.
    `efficiency` is 1 where n workers draw n times the frames of a process held to a worker's share of the processors;
    `idle_ms_per_frame` the time for which workers had nothing to do.
    """
    config = Config(
        name="farm",
        groom=Groom(strands=strands, guides=32),
        simulate=Simulate(frames=max(frames, len(_first(workers))), settle=0.1),
        render=Render(size=(size, size)),
    )
    folder = Path(tempfile.mkdtemp(prefix="ringlet-farm-"))
    try:
        with log.forwarded_to(lambda _record: None):
            batch = Batch(config, Experiment(folder / "farm"))
            for stage in ("groom", "simulate", "interpolate"):
                batch.make(stage)
            return _measured(batch, frames, workers)
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def _measured(batch: Batch, frames: int, workers: int) -> dict[str, Any]:
    here, threads = sorted(os.sched_getaffinity(0)), share(workers)
    part = -(-frames // workers)  # as many as a worker draws
    start = time.perf_counter()
    one = _alone(batch, here, frames, {})
    held = _alone(batch, here[:threads], part, environment(threads))
    together = _together(batch, workers, frames)
    return {
        "frames": frames,
        "workers": workers,
        "processors": len(here),
        "threads": threads,
        "seconds_one": round(one.seconds, 2),
        "seconds_workers": round(together.seconds, 2),
        "speed_up": round(one.seconds / together.seconds, 3),
        "efficiency": round(held.seconds / part * frames / (workers * together.seconds), 3),
        "cpu_ms_per_frame_one": round(1e3 * one.processor / frames, 2),
        "cpu_ms_per_frame_held": round(1e3 * held.processor / part, 2),
        "cpu_ms_per_frame_workers": round(1e3 * together.processor / frames, 2),
        "overhead_ms_per_frame": round(1e3 * (together.seconds - one.seconds) / frames, 2),
        "overhead_cpu_ms_per_frame": round(1e3 * (together.processor - one.processor) / frames, 2),
        "idle_ms_per_frame": round(1e3 * (workers * together.seconds - together.busy) / frames, 2),
        "seconds_to_start": round(together.start, 2),
        "seconds_in_all": round(time.perf_counter() - start, 1),
    }


def _first(workers: int) -> range:
    """Frames that are drawn before the clock starts."""
    return range(1, 2 * workers + 1)


def _together(batch: Batch, workers: int, frames: int) -> Spent:
    start = time.perf_counter()
    with local_cluster(workers) as address, connected(address) as client:

        def processor() -> float:
            workers: dict[str, float] = client.run(time.process_time)
            return time.process_time() + sum(workers.values())

        make_on(address, [batch], frames=_first(workers))
        shutil.rmtree(batch.experiment.frames)
        began, before = time.perf_counter(), processor()
        report = make_on(address, [batch], frames=range(1, frames + 1))
        spent = Spent(time.perf_counter() - began, processor() - before, report.seconds, began - start)
    shutil.rmtree(batch.experiment.frames)
    return spent


def _alone(batch: Batch, held_to: Sequence[int], frames: int, variables: dict[str, str]) -> Spent:
    """The first frames by a process of its own that may use these processors only, in this environment."""
    spawn = multiprocessing.get_context("spawn")
    hold = partial(os.sched_setaffinity, 0, tuple(held_to))
    with _surroundings(variables), ProcessPoolExecutor(1, spawn, hold) as pool:
        spent = pool.submit(_draw, Job.of(batch), len(held_to), frames).result()
    shutil.rmtree(batch.experiment.frames)
    return spent


def _draw(job: Job, threads: int, frames: int) -> Spent:
    """What the process does."""
    kernels.set_threads(threads)
    with log.forwarded_to(lambda _record: None):
        batch = job.batch()
        batch.make("render", _first(1))
        shutil.rmtree(batch.experiment.frames)
        start, before = time.perf_counter(), time.process_time()
        batch.make("render", range(1, frames + 1))
        return Spent(time.perf_counter() - start, time.process_time() - before)


@contextmanager
def _surroundings(variables: dict[str, str]) -> Iterator[None]:
    """Environment variables that processes started meanwhile see."""
    before = {name: os.environ.get(name) for name in variables}
    os.environ.update(variables)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
