"""Which reader for which file."""

import importlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from pipeline.errors import InputError
from pipeline.strands.formats.apart import read_apart
from pipeline.strands.formats.hair import read_hair
from pipeline.strands.formats.ragged import Ragged
from pipeline.strands.formats.tfx import read_tfx
from pipeline.strands.formats.usc_data import read_data


@dataclass(frozen=True)
class Library:
    """A reader that needs a library, which is only imported where the file is read."""

    module: str
    function: str
    extra: str = ""
    """The extra of ringlet that brings the library; none for what ringlet always has."""


_USD = Library("usd", "read_usd", "usd")
_VTK = Library("vtk_lines", "read_vtk")
READERS: dict[str, Callable[[Path], Ragged]] = {".tfx": read_tfx, ".hair": read_hair, ".data": read_data}
LIBRARIES = {
    ".usd": _USD,
    ".usda": _USD,
    ".usdc": _USD,
    ".usdz": _USD,
    ".vtp": _VTK,
    ".vtkhdf": _VTK,
    ".abc": Library("alembic", "read_alembic", "alembic"),
}
FORMATS = (*READERS, *LIBRARIES)


def read_groom(path: Path) -> Ragged:
    """Read a groom file by its ending; other people's libraries run in a process of their own.

    Raises InputError for an unknown ending, a library that is missing or a file that does not hold up.
    """
    ending = path.suffix.lower()
    if ending in READERS:
        return READERS[ending](path)
    if ending not in LIBRARIES:
        raise InputError(f"{path}: unknown kind of groom file; ringlet reads {', '.join(sorted(FORMATS))}")
    return read_apart(path)


def read_here(path: Path) -> Ragged:
    """Read a file of a library in this process, which the file may crash."""
    library = LIBRARIES[path.suffix.lower()]
    try:
        read = getattr(
            importlib.import_module(f"pipeline.strands.formats.{library.module}"), library.function
        )
        found: Ragged = read(path)
    except ModuleNotFoundError as error:
        raise InputError(
            f'{path}: reading {path.suffix} files needs {error.name}: pip install "ringlet[{library.extra}]"'
        ) from None
    return found
