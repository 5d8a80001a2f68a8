"""Entry point: runs a command and turns what went wrong into a message and an exit code."""

import os
import signal
import sys
from collections.abc import Sequence
from types import FrameType
from typing import NoReturn

from cyclopts import CycloptsError

from pipeline.cli import check_commands, exchange_commands, look_commands, run_commands  # noqa: F401, they add their commands
from pipeline.cli.base import app
from pipeline.errors import InputError

DONE, FAILED, WRONG_INPUT = 0, 1, 2
INTERRUPTED, TERMINATED = 130, 143


def main() -> NoReturn:
    """Run the command line of this process and exit."""
    signal.signal(signal.SIGTERM, _terminate)
    raise SystemExit(call(sys.argv[1:]))


def call(arguments: Sequence[str]) -> int:
    """Run one command and return its exit code; errors of the user are printed without a traceback."""
    try:
        code = app(list(arguments), exit_on_error=False, print_error=False, result_action="return_value")
        sys.stdout.flush()
    except CycloptsError as error:
        print(f"ringlet: {error}\nringlet --help lists the commands", file=sys.stderr)
        return WRONG_INPUT
    except InputError as error:
        print(error, file=sys.stderr)
        return WRONG_INPUT
    except ImportError as error:
        if error.name != "pipeline.kernels":
            raise
        print(f"ringlet: the C++ kernels are not built; run: make env   ({error})", file=sys.stderr)
        return WRONG_INPUT
    except BrokenPipeError:  # the reader, such as `head`, has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return DONE
    except OSError as error:  # a folder that may not be written, a path that is no folder
        if error.filename is None:
            raise
        print(f"{error.filename}: {error.strerror}", file=sys.stderr)
        return WRONG_INPUT
    except KeyboardInterrupt:
        print("ringlet: interrupted; what is finished stays", file=sys.stderr)
        return INTERRUPTED
    return code if isinstance(code, int) else DONE


def _terminate(_signal: int, _frame: FrameType | None) -> NoReturn:
    # An exception, so that temporary files are removed on the way out.
    raise SystemExit(TERMINATED)
