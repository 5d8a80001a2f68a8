"""One worker of a scheduler, for as long as there is one: what a machine of a farm runs."""

import asyncio
import time

from pipeline.errors import InputError
from pipeline.farm.cluster import SILENT, need_distributed, processors, quiet, settings
from pipeline.progress import say

_AGAIN_S = 1.0
_CONNECT_S = 10


def serve(address: str, threads: int | None, patience: float) -> None:
    """Work for a scheduler with so many threads (all processors of this process, unless given).

    The work is done by a process of its own, which is started again when it dies. Returns when there has been no
    scheduler for `patience` seconds; raises InputError if there never was one, or for what is no address.
    """
    need_distributed()
    import dask

    threads = threads or processors()
    quiet()
    served, last = False, time.monotonic()
    with dask.config.set(settings(threads) | {"distributed.comm.timeouts.connect": f"{_CONNECT_S}s"}):
        while time.monotonic() - last < patience:
            try:
                asyncio.run(_serve(address, threads))
                served, last = True, time.monotonic()
                say("worker", f"the scheduler at {address} has gone; waiting {patience:.0f} s for it")
            except ValueError as error:
                raise InputError(
                    f'{address}: expected an address such as "tcp://host:8786" ({error})'
                ) from None
            except (OSError, RuntimeError):  # not there, or gone while the worker started
                pass
            time.sleep(_AGAIN_S)
    if not served:
        raise InputError(f"{address}: no scheduler there for {patience:.0f} s; start it with: dask scheduler")


async def _serve(address: str, threads: int) -> None:
    from distributed import Nanny

    async with Nanny(address, nthreads=1, memory_limit=0, dashboard=False, silence_logs=SILENT) as nanny:
        say("worker", f"working for {address} with {threads} thread{'' if threads == 1 else 's'}")
        await nanny.finished()
