"""Commands for many machines: worker."""

from typing import Annotated

from cyclopts import Parameter

from pipeline.cli.base import STAGES_GROUP, app
from pipeline.errors import InputError


@app.command(group=STAGES_GROUP, sort_key=10)
def worker(
    scheduler: Annotated[str, Parameter(help="Address of a Dask scheduler, such as tcp://host:8786.")],
    *,
    threads: Annotated[
        int | None, Parameter(show_default=False, help="Threads to work with; all processors unless given.")
    ] = None,
    patience: Annotated[
        float, Parameter(help="Seconds without a scheduler after which the worker ends.")
    ] = 60.0,
) -> None:
    """Work for `ringlet run --scheduler` and the like, until the scheduler is gone."""
    from pipeline.farm.worker import serve

    if threads is not None and threads < 1:
        raise InputError(f"--threads {threads}: expected a number above 0")
    serve(scheduler, threads, patience)
