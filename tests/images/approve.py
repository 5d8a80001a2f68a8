"""Take the new pictures of `make images` for golden ones and record why: python approve.py REASON."""

import shutil
import sys
from datetime import date
from pathlib import Path

GOLDEN = Path(__file__).parent / "golden"
NEW = Path(__file__).parents[2] / "outputs" / "images" / "new"


def main() -> None:
    """Copy what differs; exits 2 without a reason or without new pictures."""
    reason = " ".join(sys.argv[1:]).strip()
    if not reason:
        raise SystemExit('approve: say why, as in: make approve WHY="softer key light"')
    new = sorted(NEW.glob("*.*"))
    if not new:
        raise SystemExit("approve: no new pictures; run make images first")
    changed = [path for path in new if not _same(path, GOLDEN / path.name)]
    for path in changed:
        shutil.copyfile(path, GOLDEN / path.name)
    if changed:
        with (GOLDEN / "REASONS.md").open("a", encoding="utf-8") as log:
            log.write(f"* {date.today()}: {', '.join(path.name for path in changed)}: {reason}\n")
    print(f"approved {len(changed)} of {len(new)} files")


def _same(new: Path, golden: Path) -> bool:
    return golden.is_file() and golden.read_bytes() == new.read_bytes()


if __name__ == "__main__":
    main()
