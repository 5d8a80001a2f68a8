"""Columns: arrays in HDF5, cut into chunks of rows that are shuffled, deflated and checked one by one.

HDF5's own filter calls zlib, which is the slowest part of writing; ISA-L deflates about 15 times faster at
the same ratio, so chunks are filtered here and handed over finished. Any HDF5 reader understands them.
"""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from isal import isal_zlib
from numpy.typing import ArrayLike, DTypeLike, NDArray

from pipeline.errors import InputError

CHUNK_BYTES = 1 << 20
_DENSEST = 1100  # bytes that one deflated byte can stand for, and some more
_NotDeflated: type[Exception] = isal_zlib.error  # type: ignore[assignment]


class Damaged(InputError):
    """A file of the cache whose content is not what was written."""

    def __init__(self, path: Path | str, what: str) -> None:
        super().__init__(f"{path}: {what}; the file is damaged and has to be made again (`ringlet run` does)")


class ColumnWriter:
    """Appends rows to one dataset; the dataset appears with the first full chunk, or when it is closed."""

    def __init__(
        self,
        file: h5py.File,
        name: str,
        row_shape: tuple[int, ...],
        dtype: DTypeLike,
        chunk_rows: int | None = None,
    ) -> None:
        self.file, self.name = file, name
        self.row_shape, self.dtype = row_shape, np.dtype(dtype).newbyteorder("<")
        row_bytes = max(1, int(np.prod(row_shape)) * self.dtype.itemsize)
        self.chunk_rows = chunk_rows or max(1, CHUNK_BYTES // row_bytes)
        self.checksums: list[int] = []
        self.rows = 0
        self._pending: NDArray[Any] = np.empty((0, *row_shape), self.dtype)
        self._dataset: h5py.Dataset | None = None

    def append(self, rows: ArrayLike) -> None:
        """Append rows (n, ...), each of the row shape; raises ValueError for any other shape and TypeError for a lossy dtype."""
        array = np.asarray(rows)
        if array.shape[1:] != self.row_shape:
            raise ValueError(f"{self.name}: expected rows of shape {self.row_shape}, got {array.shape[1:]}")
        array = array.astype(self.dtype, casting="same_kind", copy=False)
        if len(self._pending):
            array = np.concatenate([self._pending, array])
        whole = len(array) - len(array) % self.chunk_rows
        for start in range(0, whole, self.chunk_rows):
            self._write(array[start : start + self.chunk_rows])
        self._pending = array[whole:].copy() if whole or array.base is not None else array

    def close(self) -> None:
        """Write what is left; a dataset of less than one chunk gets a chunk of its own size."""
        if len(self._pending):
            if self._dataset is None:
                self.chunk_rows = len(self._pending)
            self._write(self._pending)
            self._pending = self._pending[:0]
        if self._dataset is None:
            self.file.create_dataset(self.name, shape=(0, *self.row_shape), dtype=self.dtype)

    def _write(self, rows: NDArray[Any]) -> None:
        if self._dataset is None:
            self._dataset = self.file.create_dataset(
                self.name,
                shape=(0, *self.row_shape),
                maxshape=(None, *self.row_shape),
                chunks=(self.chunk_rows, *self.row_shape),
                dtype=self.dtype,
                shuffle=self.dtype.itemsize > 1,
                compression="gzip",
                compression_opts=1,
            )
        start = self.rows
        self.rows += len(rows)
        self._dataset.resize(self.rows, axis=0)
        chunk = np.zeros((self.chunk_rows, *self.row_shape), self.dtype)
        chunk[: len(rows)] = rows
        self.checksums.append(isal_zlib.crc32(chunk.data))
        offset = (start,) + (0,) * len(self.row_shape)
        self._dataset.id.write_direct_chunk(offset, isal_zlib.compress(_shuffled(chunk), 1))


class Column:
    """A dataset of a file: `column[a:b]` reads rows and verifies the checksum of every chunk that it touches."""

    def __init__(self, path: Path, dataset: h5py.Dataset, checksums: NDArray[np.uint32]) -> None:
        self._path, self._dataset, self._checksums = path, dataset, checksums
        self.shape: tuple[int, ...] = dataset.shape
        self.dtype: np.dtype[Any] = dataset.dtype
        chunks = dataset.chunks or (1,)
        # Before room is made for what a file says that it holds
        if not (
            self.dtype.kind in "iufb"
            and (len(self) == 0 or chunks[1:] == self.shape[1:])
            and -(-len(self) // chunks[0]) == len(checksums)
            and math.prod(chunks) * self.dtype.itemsize <= _DENSEST * max(1 << 16, path.stat().st_size)
        ):
            raise Damaged(path, f"the chunks of dataset {dataset.name} do not fit its checksums")

    def __len__(self) -> int:
        return self.shape[0]

    def __getitem__(self, item: Any) -> NDArray[Any]:
        """Read rows; of a list of row numbers the chunks that they lie in. Any other index reads the whole column first."""
        if isinstance(item, int | np.integer):
            row = range(len(self))[item]
            return np.asarray(self._read(row, row + 1)[0])
        if isinstance(item, slice) and item.step in (None, 1):
            start, stop, _ = item.indices(len(self))
            return self._read(start, max(start, stop))
        if isinstance(item, np.ndarray) and item.ndim == 1 and item.dtype.kind in "iu":
            return self._rows(item)
        return np.asarray(self._read(0, len(self))[item])

    def _rows(self, rows: NDArray[np.integer]) -> NDArray[Any]:
        """Rows by their numbers, chunk by chunk. Raises IndexError for one that there is not."""
        if len(rows) and not (int(rows.min()) >= 0 and int(rows.max()) < len(self)):
            raise IndexError(f"{self._path}: a row beyond the {len(self)} of dataset {self._dataset.name}")
        found = np.empty((len(rows), *self.shape[1:]), self.dtype)
        size = self._dataset.chunks[0] if len(rows) else 1
        within = rows // size
        for number in np.unique(within).tolist():
            here = within == number
            found[here] = self._chunk(int(number), size)[rows[here] - number * size]
        return found

    def __array__(self, dtype: DTypeLike | None = None, copy: bool | None = None) -> NDArray[Any]:
        return self[:].astype(dtype or self.dtype, copy=bool(copy))

    def verify(self) -> None:
        """Read every chunk; raises Damaged."""
        for _ in self._chunks(0, len(self)):
            pass

    def _read(self, start: int, stop: int) -> NDArray[Any]:
        rows = np.empty((stop - start, *self.shape[1:]), self.dtype)
        for first, chunk in self._chunks(start, stop):
            a, b = max(start, first), min(stop, first + len(chunk))
            rows[a - start : b - start] = chunk[a - first : b - first]
        return rows

    def _chunks(self, start: int, stop: int) -> Iterator[tuple[int, NDArray[Any]]]:
        if stop <= start:
            return
        size = self._dataset.chunks[0]
        for number in range(start // size, -(-stop // size)):
            yield number * size, self._chunk(number, size)

    def _chunk(self, number: int, size: int) -> NDArray[Any]:
        shape = (size, *self.shape[1:])
        length = int(np.prod(shape)) * self.dtype.itemsize
        where = f"rows {number * size} and up of dataset {self._dataset.name}"
        try:
            offset = (number * size,) + (0,) * (len(shape) - 1)
            if self._dataset.id.get_chunk_info_by_coord(offset).size > self._path.stat().st_size:
                raise ValueError("a chunk larger than its file")  # before room is made for it
            _, stored = self._dataset.id.read_direct_chunk(offset)
            raw = isal_zlib.decompressobj().decompress(stored, length + 1)  # no more, whatever it claims
        except (OSError, RuntimeError, ValueError, _NotDeflated) as error:
            raise Damaged(self._path, f"cannot read {where}") from error
        if len(raw) != length:
            raise Damaged(self._path, f"wrong length of {where}")
        chunk = _unshuffled(raw, self.dtype).reshape(shape)
        if isal_zlib.crc32(chunk.data) != self._checksums[number]:
            raise Damaged(self._path, f"wrong checksum of {where}")
        return chunk


def _shuffled(chunk: NDArray[Any]) -> bytes:
    """Put the first bytes of all values first, then the second bytes: neighbours that compress well."""
    by_value = chunk.reshape(-1).view(np.uint8).reshape(-1, chunk.dtype.itemsize)
    return by_value.T.tobytes()


def _unshuffled(raw: bytes, dtype: np.dtype[Any]) -> NDArray[Any]:
    by_byte = np.frombuffer(raw, np.uint8).reshape(dtype.itemsize, -1)
    return np.ascontiguousarray(by_byte.T).view(dtype).reshape(-1)
