"""Damaged groom files by the thousand: each gives strands or one message, in bounded time and memory.

    python tests/formats/fuzz.py --files 100000

Files that hold up are damaged in the ways that disks, networks and enemies do it: bits flipped, the end cut off, pieces
moved, doubled or left out, numbers of headers and of text replaced by those that break programs. Each one is read under
the limits of its size: address space that is in use already, 64 MB and 64 bytes for each byte of the file; 5 s of processor time. A
library that crashes on one is contained when `read_groom` makes a message of it. Exit code 1 when anything else than
strands or a message came out.
"""

import argparse
import faulthandler
import json
import os
import resource
import signal
import struct
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import IO

sys.path.insert(0, str(Path(__file__).parents[2]))
for _threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "PXR_WORK_THREAD_LIMIT", "VTK_SMP_MAX_THREADS"):
    os.environ[_threads] = "1"

import numpy as np  # noqa: E402

from pipeline.errors import InputError  # noqa: E402
from pipeline.strands.formats import Ragged, read_groom  # noqa: E402
from pipeline.strands.formats.files import LIBRARIES, READERS, read_here  # noqa: E402
from pipeline.strands.formats.hair import write_hair  # noqa: E402
from pipeline.strands.formats.lines import Lines  # noqa: E402
from pipeline.strands.formats.tfx import write_tfx  # noqa: E402
from pipeline.strands.formats.usc_data import write_data  # noqa: E402
from pipeline.strands.formats.vtk_lines import write_vtp  # noqa: E402

SECONDS = 5  # of processor time
PATIENCE = 12  # elapsed seconds for each: other processes need theirs
BATCH = 200  # files that one process reads
MEMORY, MEMORY_PER_BYTE = 64 << 20, 64
SHARE = {".hair": 24, ".tfx": 24, ".data": 22, ".vtp": 12, ".usda": 8, ".usdc": 4, ".abc": 4, ".vtkhdf": 2}
EVIL = [0, 1, 2, 3, 0x7F, 0x80, 0xFF, 0x7FFF, 0x8000, 0xFFFF, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFE, 0xFFFFFFFF]
WORDS = [
    b"-1",
    b"0",
    b"1e308",
    b"nan",
    b"99999999999",
    b"4294967295",
    b"2147483648",
    b"",
    b"(",
    b"]",
    b"}",
    b'"',
    b"\0",
]

Rng = np.random.Generator


def flipped(data: bytearray, rng: Rng) -> None:
    for at in rng.integers(len(data), size=rng.integers(1, 9)):
        data[at] ^= 1 << rng.integers(8)


def overwritten(data: bytearray, rng: Rng) -> None:
    for at in rng.integers(len(data), size=rng.integers(1, 5)):
        data[at] = rng.integers(256)


def cut(data: bytearray, rng: Rng) -> None:
    del data[rng.integers(len(data)) :]


def number(data: bytearray, rng: Rng) -> None:
    """Numbers of headers, which stand at the begin of most formats, and anywhere."""
    for _ in range(rng.integers(1, 4)):
        size = int(rng.choice([2, 4, 8]))
        end = min(len(data), 320) if rng.random() < 0.7 else len(data)
        if end >= size:
            at = int(rng.integers(end // size)) * size
            value = int(rng.choice(EVIL)) if rng.random() < 0.7 else int(rng.integers(2 * len(data)))
            struct.pack_into({2: "<H", 4: "<I", 8: "<Q"}[size], data, at, value % (1 << 8 * size))


def spliced(data: bytearray, rng: Rng) -> None:
    """A piece of the file again, at another place: in place of what was there, or between."""
    a, b = sorted(rng.integers(len(data) + 1, size=2))
    piece = data[a : min(b, a + 512)]
    at = rng.integers(len(data) + 1)
    data[at : at + len(piece) * (rng.random() < 0.5)] = piece


def shortened(data: bytearray, rng: Rng) -> None:
    at = rng.integers(len(data))
    del data[at : at + rng.integers(1, 65)]


def word(data: bytearray, rng: Rng) -> None:
    """A number or a word of a text."""
    marks = [i for i, byte in enumerate(data) if byte in b' ,()[]="\n']
    if len(marks) > 1:
        i = int(rng.integers(len(marks) - 1))
        data[marks[i] + 1 : marks[i + 1]] = WORDS[rng.integers(len(WORDS))]


DAMAGES: list[Callable[[bytearray, Rng], None]] = [
    flipped,
    overwritten,
    cut,
    number,
    spliced,
    shortened,
    word,
]


def damaged(data: bytes, rng: Rng) -> bytes:
    """One to three damages."""
    found = bytearray(data)
    for _ in range(rng.integers(1, 4)):
        if found:
            DAMAGES[rng.integers(len(DAMAGES))](found, rng)
    return bytes(found)


def seeds(folder: Path, endings: Sequence[str]) -> dict[str, list[bytes]]:
    """Files that hold up, by their ending; without a library there are none of its kind."""
    rng = np.random.default_rng(0)
    pins = np.tile(np.array([2, 0], np.uint8), (6, 1))
    ragged = Ragged(rng.normal(size=(38, 3)), np.array([8, 4, 2, 9, 5, 10]), pins)
    even = Ragged(rng.normal(size=(48, 3)), np.full(6, 8), pins)
    wide = Ragged(even.points, even.counts, pins, np.full(48, 1e-4, np.float32))
    lines = Lines(6, 8, np.full(8, 1e-4, np.float32), 24, "seed")
    moment = even.points.reshape(6, 8, 3).astype(np.float32)
    write_hair(folder / "a.hair", ragged)
    write_hair(folder / "b.hair", wide)
    write_tfx(folder / "a.tfx", even)
    write_data(folder / "a.data", ragged)
    write_vtp(folder / "a.vtp", lines, [moment])
    header = struct.pack("<f3Ii", 3.0, 6, 8, 0, 1).ljust(144, b"\0") + struct.pack("<I", 296)
    (folder / "b.tfx").write_bytes(header.ljust(296, b"\0") + moment.tobytes())
    if not set(endings) <= READERS.keys():
        _library_seeds(folder, lines, moment)
    found: dict[str, list[bytes]] = {}
    for path in sorted(folder.iterdir()):
        if path.suffix in endings:
            found.setdefault(path.suffix, []).append(path.read_bytes())
            assert len(READERS.get(path.suffix, read_here)(path)) > 0
        path.unlink()
    return found


def _library_seeds(folder: Path, lines: Lines, moment: "np.typing.NDArray[np.float32]") -> None:
    from vtkmodules.vtkIOXML import vtkXMLPolyDataReader, vtkXMLPolyDataWriter

    reader = vtkXMLPolyDataReader()
    reader.SetFileName(str(folder / "a.vtp"))
    for mode in ("Ascii", "Binary"):
        writer = vtkXMLPolyDataWriter()
        writer.SetInputConnection(reader.GetOutputPort())
        writer.SetFileName(str(folder / f"{mode}.vtp"))
        getattr(writer, f"SetDataModeTo{mode}")()
        writer.Write()
    from pipeline.cache import create_guides

    with create_guides(folder / "a.vtkhdf", "key", guides=6, points=8, fps=24) as guides:
        guides.append(moment, np.eye(4))
    try:
        from pxr import Usd

        from pipeline.strands.formats.usd import UsdWriter

        usd = UsdWriter(folder / "a.usdc", lines)
        usd.append(1, [moment])
        usd.close()
        Usd.Stage.Open(str(folder / "a.usdc")).Export(str(folder / "a.usda"))
    except ModuleNotFoundError as error:
        print(f"without {error.name}", file=sys.stderr)
    try:
        from pipeline.strands.formats.alembic import AlembicWriter

        abc = AlembicWriter(folder / "a.abc", lines, 1)
        abc.append(1, [moment])
        abc.close()
    except ModuleNotFoundError as error:
        print(f"without {error.name}", file=sys.stderr)


def judged(read: Callable[[Path], Ragged], path: Path) -> str:
    """What comes of reading a file: "strands", "refused" or what is wrong with that."""
    try:
        strands = read(path)
    except InputError as error:
        return "refused" if str(error).startswith(str(path)) else f"nameless message: {error}"
    except Exception as error:  # noqa: BLE001, any other is what is looked for
        return type(error).__name__
    if strands.counts.sum() != len(strands.points) or (len(strands) and strands.counts.min() < 0):
        return "strands that do not fit together"
    return "strands"


def work(path: Path, whole: list[bytes], seed: int, numbers: range, outcomes: IO[str]) -> None:
    """Damage and read files one after the other under limits, and say what comes of each; may die of it."""
    silence = os.open(os.devnull, os.O_WRONLY)
    os.dup2(silence, 1)
    os.dup2(silence, 2)
    faulthandler.disable()
    signal.signal(signal.SIGPROF, signal.SIG_DFL)
    signal.signal(signal.SIGALRM, signal.SIG_DFL)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    read = READERS.get(path.suffix) or LIBRARIES[path.suffix]
    begin = _address_space() + MEMORY
    for number in numbers:
        size = make(path, whole, seed, number)
        resource.setrlimit(resource.RLIMIT_AS, (begin + MEMORY_PER_BYTE * size, resource.RLIM_INFINITY))
        signal.setitimer(signal.ITIMER_PROF, SECONDS)
        signal.setitimer(signal.ITIMER_REAL, PATIENCE * SECONDS)
        outcomes.write(judged(read, path) + "\n")
        outcomes.flush()


def make(path: Path, whole: list[bytes], seed: int, number: int) -> int:
    """Write the file of a number; returns its size."""
    rng = np.random.default_rng([seed, number, *path.suffix.encode()])
    data = damaged(whole[rng.integers(len(whole))], rng)
    path.write_bytes(data)
    return len(data)


def watched(path: Path, whole: list[bytes], seed: int, numbers: range) -> Iterator[str]:
    """What comes of files of these numbers, in processes that may die; only those of libraries ought to."""
    while numbers:
        batch = numbers[:BATCH]
        reading, writing = os.pipe()
        child = os.fork()
        if child == 0:
            os.close(reading)
            try:
                with os.fdopen(writing, "w") as outcomes:
                    work(path, whole, seed, batch, outcomes)
                os._exit(0)
            finally:
                os._exit(1)
        os.close(writing)
        with os.fdopen(reading) as outcomes:
            told = outcomes.read().splitlines()
        _, status = os.waitpid(child, 0)
        for number, outcome in zip(batch, told, strict=False):
            if outcome not in ("strands", "refused"):
                make(path, whole, seed, number)
                outcome = _told(path, outcome)
            yield outcome
        code = os.waitstatus_to_exitcode(status)
        if code:
            make(path, whole, seed, batch[len(told)])
            yield _told(path, signal.Signals(-code).name if code < 0 else f"exit code {code}")
        numbers = numbers[len(told) + bool(code) :]


def _told(path: Path, what: str) -> str:
    """What `read_groom` makes of a file that broke its reader; those of libraries have a process of their own."""
    if path.suffix in READERS:
        return what
    outcome = judged(read_groom, path)
    return f"contained: {what}" if outcome in ("strands", "refused") else f"{what}: {outcome}"


def _address_space() -> int:
    return int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()


def fuzz(
    files: int, seed: int, keep: Path | None = None, endings: Sequence[str] = tuple(SHARE)
) -> dict[str, dict[str, int]]:
    """Damage and read so many files; what came out, by ending. Files that broke something are kept in a folder."""
    found: dict[str, dict[str, int]] = {}
    with tempfile.TemporaryDirectory(dir="/dev/shm" if Path("/dev/shm").is_dir() else None) as name:
        for ending, whole in seeds(Path(name), endings).items():
            path = Path(name) / f"damaged{ending}"
            count = files * SHARE[ending] // sum(SHARE[each] for each in endings)
            outcomes: Counter[str] = Counter()
            for number, outcome in enumerate(watched(path, whole, seed, range(count))):
                outcomes[outcome] += 1
                if keep and not held(outcome):
                    keep.mkdir(exist_ok=True)
                    make(keep / f"{number}{ending}", whole, seed, number)
            found[ending] = dict(outcomes)
            print(f"{ending:8} {dict(outcomes)}", file=sys.stderr, flush=True)
    return found


def held(outcome: str) -> bool:
    """Whether an outcome is one of those that are promised."""
    return outcome in ("strands", "refused") or outcome.startswith("contained")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--files", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--keep", type=Path, help="folder for files that broke something")
    parser.add_argument("--only", nargs="+", choices=list(SHARE), default=list(SHARE), help="endings")
    options = parser.parse_args()
    result = fuzz(options.files, options.seed, options.keep, options.only)
    print(json.dumps(result))
    sys.exit(not all(held(outcome) for outcomes in result.values() for outcome in outcomes))
