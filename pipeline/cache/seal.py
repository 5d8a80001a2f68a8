"""The seal at the end of a file: what HDF5 keeps between the chunks is checked before HDF5 reads any of it.

HDF5 follows what it finds: one wrong bit in its bookkeeping can send it round in circles for ever (measured:
test_a_wrong_bit_anywhere_is_found). Chunks of data have checksums of their own, so the seal leaves them out and costs
nothing that grows with them. After the last byte of HDF5, which minds nothing that follows:

    n x (first byte, length) uint64      where chunks are, ascending, neighbours in one
    n uint64, CRC-32 uint32              of everything else in the file, and of the above
    b"ringlet1"
"""

import struct
from pathlib import Path
from typing import BinaryIO

import h5py
import numpy as np
from isal import isal_zlib
from numpy.typing import NDArray

from pipeline.cache.columns import Damaged

_MAGIC = b"ringlet1"
_END = struct.Struct("<QI8s")
_SPAN = np.dtype("<u8")

Spans = NDArray[np.uint64]


def seal(path: Path) -> None:
    """Append the seal to a finished HDF5 file."""
    with h5py.File(path, "r", locking=False) as file:
        spans = _chunks(file)
    with path.open("r+b") as file:
        size = path.stat().st_size
        tail = spans.tobytes() + struct.pack("<Q", len(spans))
        crc = isal_zlib.crc32(tail, _crc_between(file, spans, size))
        file.seek(size)
        file.write(tail + struct.pack("<I8s", crc, _MAGIC))


def check(path: Path) -> None:
    """Raise Damaged for a file whose bookkeeping is not as it was sealed."""
    with path.open("rb") as file:
        size = path.stat().st_size - _END.size
        if size < 0:
            raise Damaged(path, "not a file of the cache, or cut short")
        file.seek(size)
        count, right, magic = _END.unpack(file.read(_END.size))
        size -= 2 * _SPAN.itemsize * count
        if magic != _MAGIC or size < 0:
            raise Damaged(path, "not a file of the cache, or cut short")
        file.seek(size)
        listed = file.read(2 * _SPAN.itemsize * count)
        spans = np.frombuffer(listed, _SPAN).reshape(-1, 2)
        first, length = spans.T
        ends = first + length
        if np.any(ends < first) or np.any(first[1:] < ends[:-1]) or np.any(ends > size):
            raise Damaged(path, "its seal is broken")
        crc = _crc_between(file, spans, size)
        if isal_zlib.crc32(listed + struct.pack("<Q", count), crc) != right:
            raise Damaged(path, "the seal does not fit the content")


def _crc_between(file: BinaryIO, spans: Spans, size: int) -> int:
    """CRC-32 of the first `size` bytes but for those in `spans`."""
    crc = at = 0
    for first, length in [*spans.tolist(), (size, 0)]:
        file.seek(at)
        crc = isal_zlib.crc32(file.read(first - at), crc)
        at = first + length
    return int(crc)


def _chunks(file: h5py.File) -> Spans:
    """Where the chunks of all datasets are, (n, 2); neighbours in one."""
    found: list[tuple[int, int]] = []

    def note(_name: str, node: h5py.Dataset | h5py.Group) -> None:
        if isinstance(node, h5py.Dataset) and node.chunks:
            node.id.chunk_iter(lambda chunk: found.append((chunk.byte_offset, chunk.size)))

    file.visititems(note)
    merged: list[list[int]] = []
    for first, length in sorted(found):
        if merged and merged[-1][0] + merged[-1][1] == first:
            merged[-1][1] += length
        else:
            merged.append([first, length])
    return np.array(merged, _SPAN).reshape(-1, 2)
