"""Numbered files: one a frame, named by a pattern such as "body.%04d.obj" or "body.####.obj", or by their folder."""

import re
from pathlib import Path

from pipeline.errors import InputError

_PLACE = re.compile(r"%0?\d*d|#+")
_LAST_NUMBER = re.compile(r"(\d+)(?=\D*$)")


def numbered_files(pattern: Path) -> tuple[Path, ...]:
    """The files of a sequence by their numbers; the first is frame 1, whatever its number.

    Raises InputError for a pattern without a place for the number, no files, and numbers that are missing between.
    """
    if pattern.is_dir():
        found = [
            (match, path) for path in sorted(pattern.iterdir()) if (match := _LAST_NUMBER.search(path.stem))
        ]
        numbers = {int(match[1]): path for match, path in found}
    else:
        place = _PLACE.search(pattern.name)
        if place is None:
            raise InputError(
                f'{pattern}: no place for the number of a frame; write "%04d" or "####" into the name, or give a folder'
            )
        before, after = pattern.name[: place.start()], pattern.name[place.end() :]
        name = re.compile(re.escape(before) + r"(\d+)" + re.escape(after))
        paths = sorted(pattern.parent.iterdir()) if pattern.parent.is_dir() else []
        numbers = {int(match[1]): path for path in paths if (match := name.fullmatch(path.name))}
    if not numbers:
        raise InputError(f"{pattern}: no such files; the first of them is frame 1")
    first, last = min(numbers), max(numbers)
    missing = [number for number in range(first, last + 1) if number not in numbers]
    if missing:
        raise InputError(f"{pattern}: number {missing[0]} of {first} to {last} is missing")
    return tuple(numbers[number] for number in range(first, last + 1))
