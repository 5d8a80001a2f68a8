"""USC-HairSalon's .data: i32 strands; for each strand i32 n, then f32[3 n], root to tip. No header."""

import struct
from pathlib import Path

import numpy as np

from pipeline.strands.formats.ragged import Bytes, Ragged, widened


def read_data(path: Path) -> Ragged:
    """Read a .data file. Raises InputError, naming the strand, for anything that does not fit the file's size."""
    file = Bytes(path)
    strands = file.number("number of strands", np.int32, 0)
    if strands <= 0 or 4 + 4 * strands > len(file):
        raise file.error(
            f"number of strands is {strands}, but the file has {len(file)} bytes; is this a .data file?"
        )
    counts = np.empty(strands, np.int64)
    pieces = []
    offset = 4
    for strand in range(strands):
        count = file.number(f"points of strand {strand}", np.int32, offset)
        if count < 0:
            raise file.error(f"strand {strand} has {count} points")
        pieces.append(file.array(f"strand {strand}", np.float32, 3 * count, offset + 4))
        counts[strand] = count
        offset += 4 + 12 * count
    points = widened(np.concatenate(pieces).reshape(-1, 3))
    return Ragged(points, counts, np.tile(np.array([2, 0], np.uint8), (strands, 1)))


def write_data(path: Path, strands: Ragged) -> None:
    """Write a .data file."""
    parts = [struct.pack("<i", len(strands))]
    for first, count in zip(strands.first, strands.counts, strict=True):
        parts += [struct.pack("<i", count), strands.points[first : first + count].astype("<f4").tobytes()]
    path.write_bytes(b"".join(parts))
