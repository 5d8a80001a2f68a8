"""What a user can get wrong. Library code raises these; only the command line prints them and exits."""

from collections.abc import Iterable
from typing import Self


class InputError(Exception):
    """The user's input is wrong: `str()` is one or more complete lines, "file:line: key: what is wrong; remedy"."""

    @classmethod
    def joined(cls, messages: Iterable[str]) -> Self:
        """One error of many, a line for each: all that is wrong is told at once."""
        return cls("\n".join(messages))
