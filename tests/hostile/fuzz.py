"""Damaged and hostile files by the thousand: each is read or refused by one message, in bounded time and memory.

    python -m tests.hostile.fuzz --files 100000                     as many for every reader
    python -m tests.hostile.fuzz --files 2000 --only config cache

Exit code 1 when anything else came out. `--keep` keeps the files that broke something.
"""

import argparse
import json
import os
import sys
import tempfile
import time
from pathlib import Path

for _threads in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "PXR_WORK_THREAD_LIMIT", "VTK_SMP_MAX_THREADS"):
    os.environ[_threads] = "1"

from tests.hostile import grooms, readers  # noqa: E402
from tests.hostile.engine import Target, fuzz, held  # noqa: E402


def all_targets(folder: Path) -> list[Target]:
    """Every reader there is."""
    return grooms.targets(folder) + readers.targets(folder)


def main() -> int:
    """Fuzz what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--files", type=int, default=100_000, help="for every reader")
    parser.add_argument("--from", type=int, default=0, dest="first", help="number of the first file")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument(
        "--seconds", type=float, default=float("inf"), help="for every reader; then the next one"
    )
    parser.add_argument("--keep", type=Path, help="folder for files that broke something")
    parser.add_argument("--only", nargs="+", default=[], help="names of readers, or how they begin")
    options = parser.parse_args()
    found: dict[str, dict[str, int]] = {}
    with tempfile.TemporaryDirectory(dir="/dev/shm" if Path("/dev/shm").is_dir() else None) as name:
        for target in all_targets(Path(name)):
            if options.only and not target.name.startswith(tuple(options.only)):
                continue
            total: dict[str, int] = {}
            end, step = time.monotonic() + options.seconds, 200
            for first in range(options.first, options.first + options.files, step):
                if time.monotonic() > end:
                    break
                numbers = range(first, min(first + step, options.first + options.files))
                for outcome, count in fuzz(target, numbers, options.seed, Path(name), options.keep).items():
                    total[outcome] = total.get(outcome, 0) + count
            found[target.name] = total
            print(f"{target.name:16} {sum(total.values()):7} {total}", file=sys.stderr, flush=True)
    print(json.dumps(found))
    return 0 if all(held(outcome) for total in found.values() for outcome in total) else 1


if __name__ == "__main__":
    sys.exit(main())
