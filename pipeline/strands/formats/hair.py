"""Cem Yuksel's .hair.

128-byte header: "HAIR"; u32 strands; u32 points; u32 flags (bit 0 segments, 1 points, 2 thickness, 3 transparency,
4 colours); u32 default segments; then defaults and a text. Then, each where its bit is set: u16 segments of each
strand; f32[3] points. A strand has one point more than segments.
"""

import struct
from pathlib import Path

import numpy as np

from pipeline.strands.formats.ragged import Bytes, Ragged, widened

_HEADER = 128
_SEGMENTS, _POINTS = 1, 2  # bits of the flags


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
        if strands * (default + 1) > points:
            raise file.error(
                f"default segments are {default}: {strands} strands need more than {points} points"
            )
        counts = np.full(strands, default + 1, np.int64)
    if int(counts.sum()) != points:
        raise file.error(f"the strands have {int(counts.sum())} points, but the header says {points}")
    rows = file.array("points", np.float32, 3 * points, offset).reshape(-1, 3)
    pins = np.tile(np.array([2, 0], np.uint8), (strands, 1))
    return Ragged(widened(rows), counts, pins)


def write_hair(path: Path, strands: Ragged) -> None:
    """Write a .hair file with segments and points; at most 65,536 points a strand."""
    if strands.counts.max() > 1 << 16:
        raise ValueError("a strand of a .hair file has at most 65,536 points")
    counts = (len(strands), len(strands.points), _SEGMENTS | _POINTS, 0)
    header = b"HAIR" + struct.pack("<4I5f", *counts, 8e-5, 0.0, 0.3, 0.2, 0.1)
    segments = (strands.counts - 1).astype("<u2").tobytes()
    path.write_bytes(header.ljust(_HEADER, b"\0") + segments + strands.points.astype("<f4").tobytes())
