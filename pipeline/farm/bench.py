"""What workers cost: the same frames by one process and by several that share its processors."""

import shutil
import tempfile
import time
from pathlib import Path
from typing import Any

from pipeline import log
from pipeline.batch.stages import Batch
from pipeline.cache import Experiment
from pipeline.config.schema import Config, Groom, Render, Simulate
from pipeline.farm.cluster import local_cluster, processors
from pipeline.farm.run import Report, make_on


def bench(frames: int, workers: int, size: int, strands: int) -> dict[str, Any]:
    """Figures of `frames` square frames of `size` px by one worker and by `workers`, each with the same threads.

    Workers are started and have drawn a frame before the clock starts. Efficiency is 1 where n workers take an n-th of
    the time of one; overhead is what is missing to that, in worker time for each frame.
    """
    config = Config(
        name="farm",
        groom=Groom(strands=strands, guides=32),
        simulate=Simulate(frames=frames, settle=0.1),
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
    threads = max(1, processors() // workers)
    start = time.perf_counter()
    alone, _, _ = _drawn(batch, 1, threads)
    together, report, started = _drawn(batch, workers, threads)
    return {
        "frames": frames,
        "workers": workers,
        "threads": threads,
        "seconds_one": round(alone, 2),
        "seconds_workers": round(together, 2),
        "speed_up": round(alone / together, 3),
        "efficiency": round(alone / (workers * together), 3),
        "overhead_ms_per_frame": round(1e3 * (workers * together - alone) / frames, 2),
        "idle_ms_per_frame": round(1e3 * (workers * together - report.seconds) / frames, 2),
        "seconds_to_start": round(started, 2),
        "seconds_in_all": round(time.perf_counter() - start, 1),
    }


def _drawn(batch: Batch, workers: int, threads: int) -> tuple[float, Report, float]:
    """Seconds that all frames take, what the tasks tell, and seconds that it took to have workers that have drawn."""
    start = time.perf_counter()
    with local_cluster(workers, threads) as address:
        make_on(address, [batch], frames=range(1, 2 * workers + 1))
        shutil.rmtree(batch.experiment.frames)
        started = time.perf_counter()
        report = make_on(address, [batch])
        end = time.perf_counter()
    shutil.rmtree(batch.experiment.frames)
    return end - started, report, started - start
