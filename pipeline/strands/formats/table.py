"""Tables of numbers as text: one row a line, with a header or without.

Commas, semicolons and blanks separate; empty lines and lines that begin with # are skipped.
"""

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import InputError


@dataclass(frozen=True)
class Table:
    """Rows of numbers and where they stand."""

    path: Path
    header: tuple[str, ...]
    """Names of columns in lower case; empty without a header."""
    values: NDArray[np.float64]
    """(N, C)"""
    lines: tuple[int, ...]
    """(N,): line of each row, from 1."""

    def where(self, row: int) -> str:
        """Return "file:line" of a row."""
        return f"{self.path}:{self.lines[row]}"


def read_table(path: Path, widths: tuple[int, ...], expected: str) -> Table:
    """Read a table whose rows all have one of these numbers of columns.

    Raises InputError, with file and line, for text that is no number and for another width, saying what is `expected`.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read as text ({error})") from None
    header: tuple[str, ...] = ()
    rows: list[list[float]] = []
    lines: list[int] = []
    for number, line in enumerate(text.splitlines(), start=1):
        words = re.split(r"[,;\s]+", line.strip().strip(",;"))
        if words[0] == "" or words[0].startswith("#"):
            continue
        try:
            rows.append([float(word) for word in words])
            lines.append(number)
        except ValueError:
            if rows or header:
                raise InputError(
                    f"{path}:{number}: not a line of numbers: {line.strip()[:40]}; {expected}"
                ) from None
            header = tuple(word.strip("\"'").lower() for word in words)
        if rows and (len(rows[-1]) != len(rows[0]) or len(rows[0]) not in widths):
            raise InputError(f"{path}:{number}: {len(rows[-1])} numbers; {expected}")
    values = np.array(rows, np.float64).reshape(len(rows), -1) if rows else np.zeros((0, widths[0]))
    return Table(path, header, values, tuple(lines))
