"""Where tasks run: worker processes of this machine, or those of a scheduler that is there already."""

import logging
import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from pipeline.errors import InputError
from pipeline.farm.tasks import THREADS

if TYPE_CHECKING:
    from distributed import Client

ATTEMPTS = 10  # workers that may die over one task before it is given up
SILENT = logging.CRITICAL + 1  # Dask calls a line critical that tells of a client that went
_CONNECT_S = 10
_PRELOAD = "pipeline.farm.interrupts"


def need_distributed() -> None:
    """Raise InputError when Dask distributed is not installed."""
    try:
        import distributed  # noqa: F401
    except ImportError:
        raise InputError(
            'several workers need Dask distributed; install it with: pip install "ringlet[farm]"'
        ) from None


def processors() -> int:
    """How many processors this process may use."""
    return len(os.sched_getaffinity(0))


def share(workers: int) -> int:
    """How many of this process's processors each of so many workers has; one where there are more workers."""
    return max(1, processors() // workers)


def quiet() -> None:
    """What Dask and what is below it tell, we tell in one line."""
    for name in ("distributed", "tornado", "asyncio"):
        logging.getLogger(name).setLevel(SILENT)


def settings(threads: int) -> dict[str, Any]:
    """Of Dask, for workers of so many threads and what is around them: the processors are left to the tasks.

    Its watching of itself many times a second took 10 % of a processor where frames are drawn by two workers (measured).
    """
    import dask.config
    import distributed.config  # noqa: F401, which knows what is not set here

    already = dask.config.get("distributed.worker.preload")
    return {
        "distributed.worker.preload": [*([already] if isinstance(already, str) else already), _PRELOAD],
        "distributed.nanny.pre-spawn-environ": environment(threads),
        "distributed.worker.memory.target": False,
        "distributed.worker.memory.spill": False,
        "distributed.worker.profile.enabled": False,
        "distributed.admin.tick.interval": "1s",
        "distributed.admin.system-monitor.interval": "10s",
        "distributed.admin.system-monitor.gil.enabled": False,
        "distributed.scheduler.active-memory-manager.start": False,
    }


def environment(threads: int) -> dict[str, str]:
    """What a worker's process needs in order to leave the other processors to others."""
    return {
        THREADS: str(threads),
        "OMP_NUM_THREADS": str(threads),
        "LP_NUM_THREADS": str(threads),
        "OPENBLAS_NUM_THREADS": "1",
        "OMP_WAIT_POLICY": "passive",
    }


@contextmanager
def local_cluster(workers: int) -> Iterator[str]:
    """Start a scheduler and workers that share the processors of this machine; lends the scheduler's address."""
    need_distributed()
    import dask
    from distributed import LocalCluster

    if workers < 1:
        raise InputError(f"--workers {workers}: expected a number above 0")
    quiet()
    attempts = {"distributed.scheduler.allowed-failures": ATTEMPTS}
    with (
        dask.config.set(settings(share(workers)) | attempts),
        LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            memory_limit=0,  # the planner has refused what does not fit
            host="127.0.0.1",
            scheduler_kwargs={"dashboard": False},
            dashboard_address="127.0.0.1:0",  # of its pages for machines, any port that is free
            silence_logs=SILENT,
        ) as cluster,
    ):
        yield cluster.scheduler_address


@contextmanager
def connected(address: str) -> Iterator["Client"]:
    """A client of a scheduler; raises OSError when there is none at this address, InputError for what is no address."""
    need_distributed()
    from distributed import Client

    quiet()
    try:
        client = Client(address, timeout=_CONNECT_S, set_as_default=False)
    except ValueError as error:
        raise InputError(
            f'--scheduler {address}: expected an address such as "tcp://host:8786" ({error})'
        ) from None
    with client:
        client.run_on_scheduler(_patient(ATTEMPTS))
        yield client


def _patient(attempts: int) -> Any:
    """A function of the scheduler's that need not know ringlet: it travels whole."""

    def set_attempts(dask_scheduler: Any) -> None:
        dask_scheduler.allowed_failures = max(dask_scheduler.allowed_failures, attempts)

    return set_attempts
