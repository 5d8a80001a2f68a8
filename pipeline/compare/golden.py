"""Golden pictures and golden figures: what a check leaves behind, and how new ones are approved.

<golden folder>/wavy.png, wavy.json      the golden ones, kept in version control
<golden folder>/REASONS.md               when and why they changed
<page's folder>/new/...                  what the last run made
<page's folder>/record.json              every check of the last run: a list of `Check`
"""

import json
import re
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.compare.folders import Pair, judged
from pipeline.compare.gates import Limits
from pipeline.compare.metrics import Metrics
from pipeline.compare.pictures import ENDINGS, FINGERPRINT
from pipeline.errors import InputError

REASONS = "REASONS.md"
RECORD = "record.json"
_NAME = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.,=@+-]{0,119}")


@dataclass(frozen=True)
class Check:
    """One comparison with a golden file."""

    name: str
    """The golden file's name, with its ending."""
    golden: str
    new: str
    reasons: list[str]
    """Why it failed; empty when it passed."""
    test: str = ""
    metrics: dict[str, float] | None = None
    limits: dict[str, float] | None = None

    @classmethod
    def of(
        cls,
        golden: Path,
        new: Path,
        reasons: list[str],
        metrics: Metrics | None = None,
        limits: Limits | None = None,
    ) -> "Check":
        """What a comparison of two files found."""
        figures = (asdict(each) if each else None for each in (metrics, limits))
        return cls(golden.name, str(golden), str(new), reasons, "", *figures)

    def pair(self) -> Pair:
        """What the page shows."""
        golden = Path(self.golden)
        return Pair(
            name=self.test or self.name,
            reference=golden if golden.is_file() else None,
            picture=Path(self.new),
            metrics=Metrics(**self.metrics) if self.metrics else None,
            reasons=self.reasons,
            limits=Limits(**self.limits) if self.limits else None,
        )


def check_picture(golden: Path, new: Path, limits: Limits) -> Check:
    """Compare a new picture file with its golden one: equal pixels of one renderer, else within limits."""
    if not golden.is_file():
        return Check.of(golden, new, ["no golden picture yet; look at the new one, then approve it"])
    try:
        pair = judged(golden.name, golden, new, limits)
    except InputError as error:
        return Check.of(golden, new, [str(error)])
    return Check.of(golden, new, pair.reasons, pair.metrics, pair.limits)


def check_figures(golden: Path, new: Path, relative: float, absolute: float) -> Check:
    """Compare figures, JSON files of one object, value by value: numbers with a point within the larger tolerance, all else equal."""
    if not golden.is_file():
        return Check.of(golden, new, ["no golden figures yet; look at the new ones, then approve them"])
    try:
        expected, found = json.loads(golden.read_text("utf-8")), json.loads(new.read_text("utf-8"))
    except ValueError as error:
        return Check.of(golden, new, [f"{golden}: not JSON ({error})"])
    return Check.of(golden, new, list(_differences("", expected, found, relative, absolute)))


def file_name(name: str, ending: str) -> str:
    """The file of a golden name; raises InputError for names that are no plain file names."""
    if not _NAME.fullmatch(name):
        raise InputError(
            f"golden: {name!r}: expected a name of letters, digits and _.,=@+- that can be a file's name"
        )
    return name + ending


def plain_name(test: str) -> str:
    """A golden name made of a test's: what no file name should hold becomes "-"."""
    return re.sub(r"[^A-Za-z0-9_.,=@+-]+", "-", test).strip("-.")[:120] or "test"


def keep_picture(picture: Path | NDArray[np.uint8], path: Path, fingerprint: str | None) -> None:
    """Copy a picture file, or write pixels (H, W, 3) uint8 as PNG, to where the last run's pictures are."""
    path.parent.mkdir(parents=True, exist_ok=True)
    if isinstance(picture, Path):
        shutil.copyfile(picture, path)
        return
    from PIL import Image, PngImagePlugin

    if picture.dtype != np.uint8 or picture.ndim != 3 or picture.shape[2] != 3:
        raise InputError(f"golden: expected pixels (H, W, 3) uint8, got {picture.shape} {picture.dtype}")
    info = PngImagePlugin.PngInfo()
    if fingerprint is not None:
        info.add_text(FINGERPRINT, fingerprint)
    Image.fromarray(picture).save(path, "PNG", pnginfo=info)


def unused(folder: Path, used: set[str]) -> list[str]:
    """Golden files of a folder that no check asked for."""
    endings = (*ENDINGS, ".json")
    files = (
        {path.name for path in folder.iterdir() if path.suffix.lower() in endings}
        if folder.is_dir()
        else set()
    )
    return sorted(files - used)


def write_record(folder: Path, checks: Sequence[Check]) -> None:
    """Write record.json, and remove what earlier runs left in new/."""
    folder.mkdir(parents=True, exist_ok=True)
    record = [asdict(check) for check in checks]
    (folder / RECORD).write_text(json.dumps(record, indent=1) + "\n", "utf-8")
    kept = {Path(check.new).resolve() for check in checks}
    for path in [*(folder / "new").rglob("*")]:
        if path.is_file() and path.resolve() not in kept:
            path.unlink()


def approve(
    folder: Path, reason: str, names: Sequence[str] = (), everything: bool = False
) -> tuple[list[str], int]:
    """Take what failed in the last run for golden, and write down why; returns names and the number of checks.

    `names` limits it to some files; `everything` also takes pictures that passed and are not equal, as another
    renderer's do. Raises InputError without a reason, without a record, and for a name that is not in it.
    """
    if not reason.strip():
        raise InputError('ringlet approve: say why, as in: ringlet approve "softer key light"')
    checks = _record(folder)
    unknown = set(names) - {check.name for check in checks} - {Path(check.name).stem for check in checks}
    if unknown:
        raise InputError(f"ringlet approve: not in the last run: {', '.join(sorted(unknown))}")
    wanted = [check for check in checks if not names or check.name in names or Path(check.name).stem in names]
    taken = [check for check in wanted if check.reasons or (everything and _differs(check))]
    for check in taken:
        golden = Path(check.golden)
        golden.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(check.new, golden)
    for parent in sorted({Path(check.golden).parent for check in taken}):
        listed = ", ".join(check.name for check in taken if Path(check.golden).parent == parent)
        with (parent / REASONS).open("a", encoding="utf-8") as log:
            log.write(f"* {date.today()}: {listed}: {' '.join(reason.split())}\n")
    return [check.name for check in taken], len(checks)


def _record(folder: Path) -> list[Check]:
    path = folder / RECORD
    try:
        return [Check(**entry) for entry in json.loads(path.read_text("utf-8"))]
    except FileNotFoundError:
        raise InputError(
            f"{path}: no such file; run the tests first, they leave the new pictures there"
        ) from None
    except (ValueError, TypeError) as error:
        raise InputError(f"{path}: not a record of golden pictures ({error})") from None


def _differs(check: Check) -> bool:
    golden = Path(check.golden)
    return not golden.is_file() or golden.read_bytes() != Path(check.new).read_bytes()


def _differences(key: str, expected: Any, found: Any, relative: float, absolute: float) -> list[str]:
    if isinstance(expected, Mapping) and isinstance(found, Mapping) and expected.keys() == found.keys():
        items = [(f"{key}.{name}" if key else str(name), expected[name], found[name]) for name in expected]
    elif isinstance(expected, list) and isinstance(found, list) and len(expected) == len(found):
        items = [
            (f"{key}[{index}]", one, other)
            for index, (one, other) in enumerate(zip(expected, found, strict=True))
        ]
    elif isinstance(expected, float) and isinstance(found, float | int) and not isinstance(found, bool):
        close = abs(found - expected) <= max(absolute, relative * abs(expected))
        return [] if close else [f"{key}: {expected:g} became {found:g}"]
    else:
        return [] if expected == found else [f"{key}: {expected!r} became {found!r}"]
    return [line for item in items for line in _differences(*item, relative, absolute)]
