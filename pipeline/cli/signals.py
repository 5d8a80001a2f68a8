"""How a run ends when it is asked to: at the next line of Python, with `Stopped`, so that nothing is left half-made.

Not within an import: VTK does not survive an exception there (2 of 60 ended in a segmentation fault, measured by
tests/faults/kill.py). Not in a finaliser or a callback from C either, where Python drops exceptions. There the signal
is asked for again a moment later. A second signal ends the process at once; files are whole even so.
"""

import os
import signal
import sys
from types import FrameType

from pipeline.errors import Stopped

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_AGAIN_S = 0.02


def listen() -> None:
    """Raise Stopped in the main thread at SIGINT, SIGTERM and SIGHUP; what the parent ignores, as nohup does, stays so."""
    _handle_by(_stop)
    sys.unraisablehook = _dropped


def finish() -> None:
    """Let nothing change the exit code any more: the work is done or its end has been told."""
    signal.setitimer(signal.ITIMER_REAL, 0)
    _handle_by(signal.SIG_IGN)


def _handle_by(handler: object) -> None:
    for number in _SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, handler)  # type: ignore[arg-type]


def _stop(number: int, frame: FrameType | None) -> None:
    _handle_by(lambda again, _frame: os._exit(128 + again))
    if _importing(frame):
        _ask_again(number)
    else:
        raise Stopped(number)


def _importing(frame: FrameType | None) -> bool:
    while frame is not None:
        if frame.f_code.co_filename.startswith("<frozen importlib"):
            return True
        frame = frame.f_back
    return False


def _ask_again(number: int) -> None:
    signal.signal(signal.SIGALRM, lambda _number, frame: _stop(number, frame))
    signal.setitimer(signal.ITIMER_REAL, _AGAIN_S)


def _dropped(lost: "sys.UnraisableHookArgs") -> None:
    if isinstance(lost.exc_value, Stopped):
        _ask_again(lost.exc_value.code - 128)
    else:
        sys.__unraisablehook__(lost)
