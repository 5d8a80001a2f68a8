"""PNG files of 16 bits a channel, which Pillow reads as 8: W3C, "Portable Network Graphics (PNG) Specification", 2003.

Rows that are filtered by "none", "sub" or "up" are undone at once, "average" and "Paeth" pixel by pixel.
"""

import struct
import zlib
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_TRUE_COLOUR = 2
_PIXEL = 6  # bytes of one
_MOST = 1 << 31  # bytes of a picture that are unpacked


def load_deep(path: Path) -> NDArray[np.uint16] | None:
    """Pixels (H, W, 3) uint16 of a PNG of 16 bits a channel, not interlaced, without transparency; None for any other file.

    Raises ValueError for one that is broken.
    """
    data = path.read_bytes()
    if not data.startswith(_SIGNATURE) or len(data) < 33:
        return None
    width, height, depth, colour, _, _, interlaced = struct.unpack_from(">IIBBBBB", data, 16)
    if depth != 16 or colour != _TRUE_COLOUR or interlaced:
        return None
    length = height * (1 + _PIXEL * width)
    if not 0 < length < _MOST:
        raise ValueError("too large")
    rows = np.frombuffer(zlib.decompressobj().decompress(_packed(data), length), np.uint8)
    if len(rows) != length:
        raise ValueError("ends too early")
    return _unfiltered(rows.reshape(height, -1)).view(">u2").astype(np.uint16).reshape(height, width, 3)


def _packed(data: bytes) -> bytes:
    at, parts = len(_SIGNATURE), []
    while at + 8 <= len(data):
        length, kind = struct.unpack_from(">I4s", data, at)
        if kind == b"IDAT":
            parts.append(data[at + 8 : at + 8 + length])
        at += 12 + length
    return b"".join(parts)


def _unfiltered(filtered: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Rows (H, bytes) from rows with their filter's number before them."""
    above = np.zeros(filtered.shape[1] - 1, np.uint8)
    rows = np.empty((len(filtered), len(above)), np.uint8)
    for row, line in zip(rows, filtered, strict=True):
        kind, coded = int(line[0]), line[1:]
        if kind == 0:
            row[:] = coded
        elif kind == 1:
            row[:] = np.cumsum(coded.reshape(-1, _PIXEL), axis=0, dtype=np.uint8).ravel()
        elif kind == 2:
            np.add(coded, above, out=row)
        elif kind in (3, 4):
            _pixel_by_pixel(kind, coded, above, row)
        else:
            raise ValueError(f"filter {kind} is unknown")
        above = row
    return rows


def _pixel_by_pixel(
    kind: int, coded: NDArray[np.uint8], above: NDArray[np.uint8], row: NDArray[np.uint8]
) -> None:
    left, corner = [0] * _PIXEL, [0] * _PIXEL
    code, up, found = coded.tolist(), above.tolist(), []
    for i, value in enumerate(code):
        a, b, c = left[i % _PIXEL], up[i], corner[i % _PIXEL]
        guess = (a + b) // 2 if kind == 3 else _paeth(a, b, c)
        left[i % _PIXEL], corner[i % _PIXEL] = (value + guess) & 255, b
        found.append(left[i % _PIXEL])
    row[:] = found


def _paeth(a: int, b: int, c: int) -> int:
    p = a + b - c
    far_a, far_b, far_c = abs(p - a), abs(p - b), abs(p - c)
    return a if far_a <= far_b and far_a <= far_c else b if far_b <= far_c else c
