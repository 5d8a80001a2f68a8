"""Which reader for which file."""

from collections.abc import Callable
from pathlib import Path

from pipeline.errors import InputError
from pipeline.strands.formats.hair import read_hair
from pipeline.strands.formats.ragged import Ragged
from pipeline.strands.formats.tfx import read_tfx
from pipeline.strands.formats.usc_data import read_data

FORMATS: dict[str, Callable[[Path], Ragged]] = {".tfx": read_tfx, ".hair": read_hair, ".data": read_data}


def read_groom(path: Path) -> Ragged:
    """Read a groom file by its ending. Raises InputError for an unknown ending or a file that does not hold up."""
    reader = FORMATS.get(path.suffix.lower())
    if reader is None:
        raise InputError(f"{path}: unknown kind of groom file; ringlet reads {', '.join(sorted(FORMATS))}")
    return reader(path)
