"""TressFX: .tfx 4.x and 3.x.

4.x, 160-byte header: f32 version; u32 strands; u32 points per strand; u32 byte offsets of positions, strand UVs, point
UVs, thickness, colours (0 is absent). Positions are f32[4]: x, y, z and w, 0 for a held point.
3.x, 296-byte header: f32 version; u32 guides; u32 points per strand; u32 followers per guide; i32 both ends held; at
byte 144 u32 offset of positions, f32[3]. Roots are held (two points), tips too when the flag is set.
Thicknesses are factors of the renderer's radius, without a unit: they are not read.
"""

import struct
from pathlib import Path

import numpy as np

from pipeline.strands.formats.ragged import Bytes, Ragged, widened

_HEADER_4, _HEADER_3, _POSITIONS_3 = 160, 296, 144


def read_tfx(path: Path) -> Ragged:
    """Read a .tfx file. Raises InputError, naming the field, for anything that does not fit the file's size."""
    file = Bytes(path)
    version = float(file.array("version", np.float32, 1, 0)[0])
    if version == 4.0:
        return _read_4(file)
    if version == 3.0:
        return _read_3(file)
    raise file.error(f"version {version:g}: expected 3.0 or 4.0; is this a .tfx file?")


def write_tfx(path: Path, strands: Ragged) -> None:
    """Write .tfx 4.0; all strands need the same number of points."""
    count = int(strands.counts[0])
    if not (strands.counts == count).all():
        raise ValueError("a .tfx file holds strands of one number of points")
    movable = np.ones((len(strands), count), np.float32)
    index = np.arange(count)
    movable[index < strands.pins[:, :1]] = 0
    movable[index >= count - strands.pins[:, 1:].astype(np.int64)] = 0
    rows = np.concatenate([strands.points, movable.reshape(-1, 1)], axis=1).astype("<f4")
    header = struct.pack("<f8I32I", 4.0, len(strands), count, _HEADER_4, 0, 0, 0, 0, 0, *[0] * 32)
    path.write_bytes(header[:_HEADER_4].ljust(_HEADER_4, b"\0") + rows.tobytes())


def _read_4(file: Bytes) -> Ragged:
    strands, points, offset = (file.number(name, np.uint32, at) for name, at in _FIELDS_4)
    _check(file, strands, points, offset, _HEADER_4)
    rows = file.array("positions", np.float32, 4 * strands * points, offset).reshape(strands, points, 4)
    held = rows[..., 3] == 0
    root = np.where(held.all(axis=1), points, (~held).argmax(axis=1))
    tip = np.where(held.all(axis=1), 0, (~held[:, ::-1]).argmax(axis=1))
    pins = np.stack([np.minimum(root, 255), np.minimum(tip, 255)], axis=1).astype(np.uint8)
    return Ragged(widened(rows[..., :3].reshape(-1, 3)), np.full(strands, points, np.int64), pins)


def _read_3(file: Bytes) -> Ragged:
    strands, points = (file.number(name, np.uint32, at) for name, at in _FIELDS_4[:2])
    both_ends = file.number("bothEndsImmovable", np.int32, 16) != 0
    offset = file.number("offset of positions", np.uint32, _POSITIONS_3)
    _check(file, strands, points, offset, _HEADER_3)
    rows = file.array("positions", np.float32, 3 * strands * points, offset).reshape(-1, 3)
    pins = np.tile(np.array([2, 2 if both_ends else 0], np.uint8), (strands, 1))
    return Ragged(widened(rows), np.full(strands, points, np.int64), pins)


_FIELDS_4 = (("number of strands", 4), ("points per strand", 8), ("offset of positions", 12))


def _check(file: Bytes, strands: int, points: int, offset: int, header: int) -> None:
    if strands == 0:
        raise file.error("number of strands is 0: there is no groom in it")
    if not 2 <= points <= 4096:
        raise file.error(f"points per strand is {points}: expected 2 to 4096")
    if offset < header:
        raise file.error(f"offset of positions is {offset}, inside the {header}-byte header")
