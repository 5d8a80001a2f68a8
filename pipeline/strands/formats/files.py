"""Which reader for which file."""

from collections.abc import Callable
from pathlib import Path

from pipeline.errors import InputError
from pipeline.strands.formats.alembic import read_alembic
from pipeline.strands.formats.apart import read_apart
from pipeline.strands.formats.extras import missing
from pipeline.strands.formats.hair import read_hair
from pipeline.strands.formats.ragged import Ragged
from pipeline.strands.formats.tfx import read_tfx
from pipeline.strands.formats.usc_data import read_data
from pipeline.strands.formats.usd import read_usd
from pipeline.strands.formats.vtk_lines import read_vtk

Reader = Callable[[Path], Ragged]

READERS: dict[str, Reader] = {".tfx": read_tfx, ".hair": read_hair, ".data": read_data}
LIBRARIES: dict[
    str, Reader
] = {  # readers by other people's libraries, which are imported when it comes to that
    **dict.fromkeys((".usd", ".usda", ".usdc", ".usdz"), read_usd),
    **dict.fromkeys((".vtp", ".vtkhdf"), read_vtk),
    ".abc": read_alembic,
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
    try:
        return LIBRARIES[path.suffix.lower()](path)
    except ModuleNotFoundError as error:
        raise missing(error, f"{path}: reading it") from None
