"""Damaged and hostile files by the thousand: each is read or refused by one message, in bounded time and memory.

    python -m tests.hostile.fuzz --files 100000                     as many for every reader
    python -m tests.hostile.fuzz --files 2000 --only config cache
    python -m tests.hostile.fuzz --totals fuzz.json --seconds 600   and again, until there are enough

Exit code 1 when anything else came out. `--keep` keeps the files that broke something.
"""

import argparse
import fcntl
import json
import os
import sys
import tempfile
import time
from dataclasses import asdict
from pathlib import Path

for _threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "PXR_WORK_THREAD_LIMIT", "VTK_SMP_MAX_THREADS"):
    os.environ[_threads] = "1"

from tests.hostile import grooms, readers  # noqa: E402
from tests.hostile.engine import BATCH, Tally, Target, fuzz, held  # noqa: E402


def all_targets(folder: Path) -> list[Target]:
    """Every reader there is."""
    return grooms.targets(folder) + readers.targets(folder)


def main() -> int:
    """Fuzz what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--files", type=int, default=100_000, help="for every reader")
    parser.add_argument("--seed", type=int, default=0, help="other numbers are other files")
    parser.add_argument("--seconds", type=float, default=float("inf"), help="for each; then the next one")
    parser.add_argument("--totals", type=Path, help="what was found so far: read, gone on from and written")
    parser.add_argument("--keep", type=Path, help="folder for files that broke something")
    parser.add_argument("--only", nargs="+", default=[], help="names of readers, or how they begin")
    options = parser.parse_args()
    found = _totals(options.totals, options.seed)
    with tempfile.TemporaryDirectory(dir="/dev/shm" if Path("/dev/shm").is_dir() else None) as name:
        for target in all_targets(Path(name)):
            if options.only and not target.name.startswith(tuple(options.only)):
                continue
            total, end = found.setdefault(target.name, Tally()), time.monotonic() + options.seconds
            while total.files < options.files and time.monotonic() < end:
                numbers = range(total.files, min(total.files + BATCH, options.files))
                fuzz(target, numbers, options.seed, Path(name), options.keep, total)
                if options.totals:
                    _write(options.totals, options.seed, {target.name: total})
            worst = f"worst {total.seconds:.2f} s, {total.kilobytes / 1024:.0f} MB"
            print(f"{target.name:16} {total.files:7} {worst} {total.outcomes}", file=sys.stderr, flush=True)
    print(json.dumps({name: total.outcomes for name, total in found.items()}))
    return 0 if all(held(outcome) for total in found.values() for outcome in total.outcomes) else 1


def _totals(path: Path | None, seed: int) -> dict[str, Tally]:
    """What earlier calls found with files of this seed."""
    if path is None or not path.exists():
        return {}
    return {name: Tally(**total) for name, total in json.loads(path.read_text()).get(str(seed), {}).items()}


def _write(path: Path, seed: int, some: dict[str, Tally]) -> None:
    """Put totals among those of other readers, which another process may be writing."""
    with Path(f"{path}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        found = json.loads(path.read_text()) if path.exists() else {}
        found.setdefault(str(seed), {}).update({name: asdict(total) for name, total in some.items()})
        written = path.with_suffix(".new")
        written.write_text(json.dumps(found, indent=1))
        written.replace(path)


if __name__ == "__main__":
    sys.exit(main())
