"""What ends a run early, and the exit code for it. Library code raises; only the command line prints and exits."""

import signal
from collections.abc import Iterable
from typing import Self

DONE, FAILED, WRONG_INPUT, FAULT = 0, 1, 2, 70


class InputError(Exception):
    """The user's input is wrong: `str()` is one or more complete lines, "file:line: key: what is wrong; remedy"."""

    @classmethod
    def joined(cls, messages: Iterable[str]) -> Self:
        """One error of many, a line for each: all that is wrong is told at once."""
        return cls("\n".join(messages))


class Stopped(KeyboardInterrupt):
    """A signal asked the process to end. Clean up in `finally` and `with`; never go on."""

    def __init__(self, number: int) -> None:
        name = signal.Signals(number).name
        super().__init__(f"ringlet: stopped by {name}; what is finished stays, the same command goes on")
        self.code = 128 + number
        """The exit code that shells use for it."""


def verdict(error: BaseException) -> tuple[int, str]:
    """Exit code and message for what ended a run; FAULT for what no user can help."""
    if isinstance(error, InputError):
        return WRONG_INPUT, str(error)
    if isinstance(error, KeyboardInterrupt):
        stopped = error if isinstance(error, Stopped) else Stopped(signal.SIGINT)
        return stopped.code, str(stopped)
    if isinstance(error, MemoryError):
        return (
            WRONG_INPUT,
            "ringlet: out of memory; what is finished stays; `ringlet plan` tells what is needed",
        )
    if isinstance(error, ImportError) and error.name == "pipeline.kernels":
        return WRONG_INPUT, f"ringlet: the C++ kernels are not built; run: make env   ({error})"
    if isinstance(error, OSError) and error.filename is not None:
        # A folder that may not be written, a path that is no folder.
        return WRONG_INPUT, f"{error.filename}: {error.strerror}"
    return FAULT, f"{type(error).__name__}: {error}"
