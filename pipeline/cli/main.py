"""Entry point: runs a command and turns what went wrong into a message and an exit code."""

import os
import sys
import traceback
from collections.abc import Sequence
from typing import NoReturn

from cyclopts import CycloptsError

from pipeline import log
from pipeline.cli import (  # noqa: F401, they add their commands
    bench_commands,
    check_commands,
    compare_commands,
    completion,
    exchange_commands,
    farm_commands,
    look_commands,
    run_commands,
    signals,
    sweep_commands,
)
from pipeline.cli.base import app
from pipeline.errors import DONE, FAULT, WRONG_INPUT, verdict


def main() -> NoReturn:
    """Run the command line of this process and exit."""
    signals.listen()
    try:
        code = call(sys.argv[1:])
    except Exception:  # noqa: BLE001, whatever is left is a fault of ours
        log.error(
            f"{traceback.format_exc()}ringlet: this is a fault of ringlet; please report it with the lines above"
        )
        code = FAULT
    signals.finish()
    raise SystemExit(code)


def call(arguments: Sequence[str]) -> int:
    """Run one command and return its exit code; errors of the user are printed without a traceback."""
    try:
        code = app(list(arguments), exit_on_error=False, print_error=False, result_action="return_value")
        sys.stdout.flush()
    except CycloptsError as error:
        log.error(f"ringlet: {error}\nringlet --help lists the commands")
        return WRONG_INPUT
    except BrokenPipeError:  # the reader, such as `head`, has seen enough
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return DONE
    except (Exception, KeyboardInterrupt) as error:
        code, text = verdict(error)
        if code == FAULT:
            raise
        log.error(text)
        return code
    return code if isinstance(code, int) else DONE
