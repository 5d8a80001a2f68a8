"""`ringlet` and `python -m pipeline`."""

import os
import signal
from typing import NoReturn


def main() -> NoReturn:
    """Run the command line of this process and exit."""
    # Until the command line is loaded and has its own handler, there is nothing to clean up.
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, lambda number, _frame: os._exit(128 + number))
    # The processors are the kernels'; NumPy's products here are small, and BLAS would wait for them on all of them
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    from pipeline.cli.main import main

    main()


if __name__ == "__main__":
    main()
