"""Loaded by every worker's process. Ctrl-C is for all processes of a terminal: those leave it to whoever has started them."""

import signal
from typing import Any


def dask_setup(worker: Any) -> None:  # noqa: ARG001, Dask calls it so
    """Do not hear SIGINT."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
