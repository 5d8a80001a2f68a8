"""One HDF5 file of the cache: columns, and a record of where it came from; sealed (see seal.py).

    <columns>                     as the stage names them, for example strands/points
    provenance/kind, key          what the file is, and the key of what it was made from
    provenance/record, meta       JSON; host and wall time are in the record and nowhere else
    checksums/<column>            CRC-32 of every chunk of rows, before compression

The seal is checked when a file is opened, a chunk's checksum when it is read, so that nothing damaged goes
unnoticed and nothing is read that is not needed. Two runs of one config differ in provenance/record only.
"""

import importlib.metadata
import json
import socket
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import ArrayLike, DTypeLike

from pipeline import kernels
from pipeline.cache import seal
from pipeline.cache.atomic import disk_full, no_room, remove_stale, replacing
from pipeline.cache.columns import Column, ColumnWriter, Damaged
from pipeline.errors import InputError

LIBRARIES = ("ringlet", "numpy", "scipy", "h5py", "vtk", "pyvista", "isal")
_FORMAT = ("earliest", "v114")  # what VTK's reader understands


class Missing(InputError):
    """A file of the cache that does not exist."""

    def __init__(self, path: Path) -> None:
        super().__init__(f"{path}: no such file; `ringlet run` with its config makes it")


class Writer:
    """A file that is being written; `create` makes one."""

    def __init__(self, file: h5py.File, kind: str, key: str, provenance: dict[str, Any]) -> None:
        self.file, self.kind, self.key = file, kind, key
        self.meta: dict[str, Any] = {}
        self._provenance = provenance
        self._columns: dict[str, ColumnWriter] = {}
        self._start = time.monotonic()

    def write(self, name: str, array: ArrayLike, chunk_rows: int | None = None) -> None:
        """Write a whole array (n, ...) as a column, chunked along its first axis."""
        values = np.asarray(array)
        self.stream(name, values.shape[1:], values.dtype, chunk_rows).append(values)

    def stream(
        self, name: str, row_shape: tuple[int, ...], dtype: DTypeLike, chunk_rows: int | None = None
    ) -> ColumnWriter:
        """Begin a column of unknown length; `append` rows to what is returned."""
        if name in self._columns:
            raise ValueError(f"{name}: written twice")
        self._columns[name] = ColumnWriter(self.file, name, row_shape, dtype, chunk_rows)
        return self._columns[name]

    def finish(self) -> None:
        """Write what is left of the columns, then the record."""
        for name, column in self._columns.items():
            column.close()
            self.file[f"checksums/{name}"] = np.array(column.checksums, np.uint32)
        now = datetime.now(UTC).isoformat(timespec="seconds")
        record = self._provenance | {
            "libraries": _versions(),
            "kernels": kernels.VARIANT,
            "host": socket.gethostname(),
            "written": now,
            "wall_time_s": round(time.monotonic() - self._start, 3),
        }
        texts = {"kind": self.kind, "key": self.key, "record": _json(record), "meta": _json(self.meta)}
        for name, text in texts.items():
            self.file[f"provenance/{name}"] = np.bytes_(text.encode())


class Reader:
    """A file that was opened and whose seal is right: `reader["strands/points"][a:b]`."""

    def __init__(self, path: Path, file: h5py.File) -> None:
        self.path, self._file = path, file
        self.kind, self.key = _text(file, "kind"), _text(file, "key")
        self.meta: dict[str, Any] = json.loads(_text(file, "meta"))
        self.provenance: dict[str, Any] = json.loads(_text(file, "record"))
        self.names: tuple[str, ...] = tuple(sorted(_datasets(file["checksums"])))

    def __contains__(self, name: str) -> bool:
        return name in self.names

    def __getitem__(self, name: str) -> Column:
        """A column; raises KeyError when the file has none of this name, Damaged when it cannot be read."""
        if name not in self.names:
            raise KeyError(f"{self.path}: no column {name}; it has {', '.join(self.names)}")
        try:
            return Column(self.path, self._file[name], self._file[f"checksums/{name}"][:])
        except (
            OSError,
            RuntimeError,
            LookupError,
            ValueError,
            TypeError,
            AttributeError,
            MemoryError,
        ) as error:
            raise Damaged(self.path, f"column {name} is none") from error

    def verify(self) -> None:
        """Read everything; raises Damaged."""
        for name in self.names:
            self[name].verify()


@contextmanager
def create(path: Path, kind: str, key: str, provenance: dict[str, Any] | None = None) -> Iterator[Writer]:
    """Write a file of the cache; it appears under `path` whole when the block succeeds, else not at all.

    `provenance` is what `config.provenance(...)` returns; host, libraries and wall time are added here.
    Raises InputError when the disk is full.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    remove_stale(path.parent)
    with replacing(path) as temporary:
        file = h5py.File(temporary, "w", libver=_FORMAT, locking=False)
        try:
            writer = Writer(file, kind, key, provenance or {})
            yield writer
            writer.finish()
            file.close()
            seal.seal(temporary)
        except BaseException as error:
            with suppress(OSError, RuntimeError, ValueError):  # the error that is under way says more
                file.close()
            if _no_room(error):
                raise disk_full(path) from error
            raise


@contextmanager
def open(path: Path, kind: str | None = None) -> Iterator[Reader]:
    """Open a file of the cache for reading.

    Raises Missing when there is none, Damaged when it is not as it was written, InputError when it is
    whole but not of the expected kind.
    """
    if not path.exists():
        raise Missing(path)
    seal.check(path)
    try:
        file = h5py.File(path, "r", locking=False)
    except OSError as error:
        raise Damaged(path, "not a readable HDF5 file") from error
    with file:
        reader = _reader(path, file)
        if kind is not None and reader.kind != kind:
            raise InputError(f"{path}: a file of kind {reader.kind}; expected {kind}")
        yield reader


def _reader(path: Path, file: h5py.File) -> Reader:
    try:
        return Reader(path, file)
    except (OSError, RuntimeError, LookupError, ValueError, TypeError, AttributeError) as error:
        raise Damaged(path, "not a file of the cache, or its structure is broken") from error


def _datasets(group: h5py.Group) -> list[str]:
    names: list[str] = []
    group.visititems(lambda name, node: names.append(name) if isinstance(node, h5py.Dataset) else None)
    return names


def _text(file: h5py.File, name: str) -> str:
    value: bytes = file[f"provenance/{name}"][()]
    return value.decode()


def _json(value: dict[str, Any]) -> str:
    return json.dumps(value, sort_keys=True, default=_plain)


def _plain(value: Any) -> Any:
    if isinstance(value, np.generic | np.ndarray):
        return value.tolist()
    raise TypeError(f"cannot be written as JSON: {type(value).__name__}")


def _no_room(error: BaseException) -> bool:
    # HDF5 reports a failed write as an OSError or, from its C layers, as text in a RuntimeError.
    return no_room(error) or (
        isinstance(error, OSError | RuntimeError)
        and any(f"errno = {number}," in str(error) for number in (27, 28, 122))
    )


def _versions() -> dict[str, str]:
    versions: dict[str, str] = {}
    for name in LIBRARIES:
        with suppress(importlib.metadata.PackageNotFoundError):
            versions[name] = importlib.metadata.version(name)
    return versions
