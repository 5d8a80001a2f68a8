"""Entry point: runs a command and turns what went wrong into a message and an exit code."""

import os
import signal
import sys
import traceback
from collections.abc import Sequence
from types import FrameType
from typing import NoReturn

from cyclopts import CycloptsError

from pipeline import log
from pipeline.cli import (  # noqa: F401, they add their commands
    check_commands,
    compare_commands,
    completion,
    exchange_commands,
    farm_commands,
    look_commands,
    run_commands,
    sweep_commands,
)
from pipeline.cli.base import app
from pipeline.errors import DONE, FAULT, WRONG_INPUT, Stopped, verdict

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_IGNORED_AGAIN_S = 0.05


def main() -> NoReturn:
    """Run the command line of this process and exit."""
    _listen()
    try:
        code = call(sys.argv[1:])
    except Exception:  # noqa: BLE001, whatever is left is a fault of ours
        log.error(
            f"{traceback.format_exc()}ringlet: this is a fault of ringlet; please report it with the lines above"
        )
        code = FAULT
    for number in _SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, signal.SIG_DFL)
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


def _listen() -> None:
    """Stop at a signal in an orderly way; one that the parent has switched off, as nohup does, stays so."""
    for number in _SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _stop)
    sys.unraisablehook = _unraisable


def _stop(number: int, _frame: FrameType | None) -> NoReturn:
    """Raise, so that temporary files are removed on the way out; at a second signal end at once, as whole."""
    for other in _SIGNALS:
        if signal.getsignal(other) is not signal.SIG_IGN:
            signal.signal(other, lambda again, _frame: os._exit(128 + again))
    raise Stopped(number)


def _unraisable(lost: "sys.UnraisableHookArgs") -> None:
    """Raise again, a moment later, what a signal raised where Python cannot: in a finaliser or a callback from C."""
    stopped = lost.exc_value
    if not isinstance(stopped, Stopped):
        sys.__unraisablehook__(lost)
        return
    number = stopped.code - 128
    signal.signal(signal.SIGALRM, lambda _number, frame: _stop(number, frame))
    signal.setitimer(signal.ITIMER_REAL, _IGNORED_AGAIN_S)
