"""Cem Yuksel's .hair.

128-byte header: "HAIR"; u32 strands; u32 points; u32 flags (bit 0 segments, 1 points, 2 thickness, 3 transparency,
4 colours); u32 default segments; f32 default thickness; f32 default transparency; f32[3] default colour; 88 letters of
text. Then, each where its bit is set: u16 segments of each strand; f32[3] points; f32 thickness, f32 transparency and
f32[3] colour of each point. A strand has one point more than segments. Thickness is read as a diameter.
"""

import struct
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipeline.strands.formats.lines import Chunks, Lines
from pipeline.strands.formats.ragged import Bytes, Ragged, widened

_HEADER = 128
_SEGMENTS, _POINTS, _THICKNESS = 1, 2, 4  # bits of the flags
_LATER = (("thickness", 4, 1), ("transparency", 8, 1), ("colours", 16, 3))  # and their numbers a point
_THICK = 20  # byte of the default thickness
_MOST = 1 << 16  # points of a strand
_TOGETHER = 1 << 16  # strands whose thickness is written at once


def read_hair(path: Path) -> Ragged:
    """Read a .hair file. Raises InputError, naming the field, for anything that does not fit the file's size."""
    file = Bytes(path)
    if file.data[:4] != b"HAIR":
        raise file.error('does not begin with "HAIR"; is this a .hair file?')
    names = ("number of strands", "number of points", "flags", "default segments")
    strands, points, flags, default = (
        file.number(name, np.uint32, 4 * i + 4) for i, name in enumerate(names)
    )
    if strands == 0:
        raise file.error("number of strands is 0: there is no groom in it")
    if not flags & _POINTS:
        raise file.error(f"flags are {flags}: the file has no points")
    offset = _HEADER
    if flags & _SEGMENTS:
        counts = file.array("segments", np.uint16, strands, offset).astype(np.int64) + 1
        offset += 2 * strands
    else:
        if strands * (default + 1) != points:
            raise file.error(
                f"default segments are {default}: {strands} strands have {strands * (default + 1)} points, "
                f"but the header says {points}"
            )
        file.array("points", np.float32, 3 * points, offset)  # before anything is made of their number
        counts = np.full(strands, default + 1, np.int64)
    if int(counts.sum()) != points:
        raise file.error(f"the strands have {int(counts.sum())} points, but the header says {points}")
    rows = file.array("points", np.float32, 3 * points, offset).reshape(-1, 3)
    pins = np.tile(np.array([2, 0], np.uint8), (strands, 1))
    return Ragged(widened(rows), counts, pins, _thickness(file, flags, points, offset + 12 * points))


def write_hair(path: Path, strands: Ragged) -> None:
    """Write a .hair file; raises ValueError for a strand of more than 65,536 points."""
    widths = [] if strands.widths is None else [strands.widths]
    _write(path, strands.counts, [strands.points], widths)


def write_hair_moment(path: Path, lines: Lines, chunks: Chunks) -> None:
    """Write one moment as a .hair file, chunk by chunk; raises ValueError for more than 65,536 points a strand."""
    profile = np.tile(lines.widths, min(lines.strands, _TOGETHER))
    left = [lines.strands - a for a in range(0, lines.strands, _TOGETHER)]
    widths = (profile[: n * lines.points] for n in left)
    _write(path, np.full(lines.strands, lines.points), chunks, widths, lines.about)


def _write(
    path: Path,
    counts: NDArray[np.int64],
    points: Iterable[NDArray[np.floating]],
    widths: Iterable[NDArray[np.float32]],
    about: str = "",
) -> None:
    if counts.max() > _MOST:
        raise ValueError("a strand of a .hair file has at most 65,536 points")
    with path.open("wb") as file:
        file.write(bytes(_HEADER))  # until it is known whether there is thickness
        file.write((counts - 1).astype("<u2").tobytes())
        for piece in points:
            file.write(piece.astype("<f4").tobytes())
        flags = _SEGMENTS | _POINTS
        for values in widths:
            file.write(values.astype("<f4").tobytes())
            flags |= _THICKNESS
        file.seek(0)
        file.write(struct.pack("<4s4I5f", b"HAIR", len(counts), counts.sum(), flags, 0, 0, 0, 0.3, 0.2, 0.1))
        file.write(about.encode("ascii")[:87])


def _thickness(file: Bytes, flags: int, points: int, offset: int) -> NDArray[np.float32] | None:
    """Thickness of every point; what else the header promises has to be there, too."""
    found: NDArray[np.float32] | None = None
    for name, bit, numbers in _LATER:
        if flags & bit:
            values = file.array(name, np.float32, numbers * points, offset)
            found = values.astype(np.float32) if bit == _THICKNESS else found
            offset += 4 * numbers * points
    default = float(file.array("default thickness", np.float32, 1, _THICK)[0])
    if found is None and np.isfinite(default) and default > 0:
        found = np.full(points, default, np.float32)
    return found
