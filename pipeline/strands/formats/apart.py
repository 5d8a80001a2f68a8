"""Reading by a library that may crash, in a process of its own.

OpenUSD, VTK and Alembic are written for files that programs wrote; bytes made to harm them can crash them, or make
them allocate and wait for ever. So a child process reads, under limits of memory and time that grow with the file,
and sends arrays back; whatever happens to it is a message here. The child costs 0.2 to 0.4 s, for the library's start.
"""

import json
import os
import resource
import signal
import subprocess
import sys
from dataclasses import dataclass, fields
from pathlib import Path
from typing import IO, Any

import numpy as np

import pipeline
from pipeline.errors import InputError
from pipeline.strands.formats.ragged import Ragged

REFUSED = 3  # exit code of a child that says what is wrong with the file

_GB = 1 << 30
_MEMORY, _MEMORY_PER_BYTE = 2 * _GB, 64  # the library's own, and for each byte of the file
_SECONDS, _BYTES_PER_SECOND = 4, 2e6
_PATIENCE = 12  # elapsed seconds for each second of processor time: other processes need theirs
_FEW_THREADS = {
    "MALLOC_ARENA_MAX": "2",
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "PXR_WORK_THREAD_LIMIT": "1",
    "VTK_SMP_MAX_THREADS": "1",
}


@dataclass(frozen=True)
class Limits:
    """What reading one file may cost."""

    memory: int
    """Address space [bytes]."""
    seconds: int
    """Processor time."""

    @classmethod
    def of(cls, path: Path) -> "Limits":
        """The limits for a file; raises InputError when there is none."""
        try:
            size = path.stat().st_size
        except OSError as error:
            raise InputError(f"{path}: no such groom file ({error.strerror})") from None
        return cls(_MEMORY + _MEMORY_PER_BYTE * size, _SECONDS + int(size / _BYTES_PER_SECOND))

    def impose(self) -> None:
        """Limit this process, for ever; a limit that is lower already stays."""
        for what, limit in (
            (resource.RLIMIT_AS, self.memory),
            (resource.RLIMIT_CPU, self.seconds),
            (resource.RLIMIT_CORE, 0),
        ):
            _, hard = resource.getrlimit(what)
            least = limit if hard == resource.RLIM_INFINITY else min(limit, hard)
            resource.setrlimit(what, (least, hard))


def read_apart(path: Path) -> Ragged:
    """Read a file in a child process. Raises InputError for whatever goes wrong with it."""
    limits = Limits.of(path)
    root = str(Path(pipeline.__file__).parents[1])
    search = os.pathsep.join(filter(None, [root, os.environ.get("PYTHONPATH")]))
    command = [sys.executable, "-P", "-m", "pipeline.strands.formats", str(path)]
    try:
        child = subprocess.run(
            command,
            env=os.environ | _FEW_THREADS | {"PYTHONPATH": search},
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=_PATIENCE * limits.seconds,
            check=False,
        )
    except subprocess.TimeoutExpired:
        raise InputError(f"{path}: reading it took too long; the file is damaged") from None
    if child.returncode == 0:
        return received(child.stdout)
    if child.returncode == REFUSED:
        raise InputError(child.stdout.decode())
    raise InputError(_told(path, child.returncode, child.stderr.decode(errors="replace"), limits))


def send(strands: Ragged, to: IO[bytes]) -> None:
    """Write strands: a line of JSON with the shapes of the arrays, then their bytes."""
    arrays = {
        field.name: value
        for field in fields(strands)
        if isinstance(value := getattr(strands, field.name), np.ndarray)
    }
    shapes = {name: [array.dtype.str, list(array.shape)] for name, array in arrays.items()}
    header = {"arrays": shapes, "metres": strands.metres, "up_axis": strands.up_axis}
    to.write(json.dumps(header).encode() + b"\n")
    for array in arrays.values():
        to.write(np.ascontiguousarray(array).data)
    to.flush()


def received(data: bytes) -> Ragged:
    """Strands that `send` wrote."""
    end = data.index(b"\n") + 1
    header: dict[str, Any] = json.loads(data[:end])
    arrays: dict[str, Any] = {"metres": header["metres"], "up_axis": header["up_axis"]}
    for name, (kind, shape) in header["arrays"].items():
        array = np.frombuffer(data, kind, int(np.prod(shape)), end).reshape(shape)
        arrays[name] = array
        end += array.nbytes
    return Ragged(**arrays)


def _told(path: Path, code: int, said: str, limits: Limits) -> str:
    """A message from the end of a child."""
    last = (said.strip().splitlines() or ["no reason given"])[-1]
    if -code in (signal.SIGXCPU, signal.SIGKILL):
        return f"{path}: reading it took more than {limits.seconds} s; the file is damaged"
    if "bad_alloc" in said or "MemoryError" in said:
        return (
            f"{path}: reading it takes more than {limits.memory / _GB:.1f} GB; the file is damaged, "
            "or names other files that are larger than itself"
        )
    if code < 0:
        return (
            f"{path}: the library that reads it crashed ({signal.Signals(-code).name}); the file is damaged"
        )
    return f"{path}: cannot be read ({last})"
