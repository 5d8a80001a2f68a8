"""Frames as .usdc, .abc, .hair and .vtp files.

USD and Alembic files hold all frames; of the others there is one file a frame, and those that are there from the same
strands stay as they are, so that an export that was cut off goes on. Every file appears whole or not at all.
"""

import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

from pipeline import cache
from pipeline.cache.atomic import remove_stale
from pipeline.config import Config
from pipeline.errors import InputError
from pipeline.export.source import Source, What, opened
from pipeline.progress import say, track
from pipeline.strands.formats.alembic import AlembicWriter
from pipeline.strands.formats.extras import missing
from pipeline.strands.formats.hair import write_hair_moment
from pipeline.strands.formats.lines import Chunks, Lines
from pipeline.strands.formats.usd import UsdWriter
from pipeline.strands.formats.vtk_lines import write_series, write_vtp

Format = Literal["usd", "abc", "hair", "vtp"]

_MOMENTS: dict[str, Callable[[Path, Lines, Chunks], None]] = {"hair": write_hair_moment, "vtp": write_vtp}
_STILL_FPS = 24.0  # of one frame
_HEAD = 256  # bytes within which a file says what it was made from


def export(
    config: Config,
    experiment: cache.Experiment,
    kind: Format,
    frames: range,
    *,
    what: What = "strands",
    strands: int | None = None,
    folder: Path | None = None,
) -> Path:
    """Write frames (numbers from 1) of finished stages; returns the file, or the folder of files.

    `what`.usdc or .abc, or `what`/0001.hair and so on, in outputs/<name>/export/ unless another folder is given.
    Raises InputError for a library that is missing or a full disk, Missing or Damaged for caches.
    """
    folder = folder or experiment.folder / "export"
    with (
        experiment.working_on("export"),
        opened(config, experiment, what, strands) as source,
    ):
        for each in (folder, folder / what):
            remove_stale(each)
        _need_room(folder, source.lines, len(frames))
        if kind in _MOMENTS:
            return _write_each(source, kind, frames, folder / what)
        return _write_all(source, kind, frames, folder / f"{what}.{'usdc' if kind == 'usd' else kind}")


def write_still(path: Path, points: NDArray[np.float32], width: float) -> None:
    """Write strands at rest (S, P, 3) [m] of one width [m] as a .usdc, .abc, .hair or .vtp file.

    Raises InputError for another ending, a library that is missing or a full disk.
    """
    count, each, _ = points.shape
    lines = Lines(count, each, np.full(each, width, np.float32), _STILL_FPS, "ringlet import")
    source = Source(lines, lambda _: [points])
    kind = {".usdc": "usd"}.get(path.suffix, path.suffix[1:])
    if kind not in get_args(Format):
        raise InputError(f"{path}: unknown kind of file; ringlet writes .usdc, .abc, .hair and .vtp")
    _need_room(path.parent, lines, 1)
    if kind not in _MOMENTS:
        _write_all(source, kind, range(1, 2), path)
        return
    with cache.replacing(path) as temporary:
        _MOMENTS[kind](temporary, lines, source.moment(1))


def _write_each(source: Source, kind: str, frames: range, folder: Path) -> Path:
    """One file a frame; of .vtp files also the list that makes an animation of them."""
    names = {number: f"{number:04d}.{kind}" for number in frames}
    wanted = [number for number in frames if not _fresh(folder / names[number], source.lines)]
    if len(wanted) < len(frames):
        say("export", f"{len(frames) - len(wanted)} of {len(frames)} frames are there")
    with track("export", len(wanted)) as bar:
        for number in wanted:
            with cache.replacing(folder / names[number]) as temporary:
                _MOMENTS[kind](temporary, source.lines, source.moment(number))
            bar.advance()
    if kind == "vtp":
        with cache.replacing(folder.with_suffix(".pvd")) as temporary:
            times = [
                ((number - 1) / source.lines.fps, f"{folder.name}/{name}") for number, name in names.items()
            ]
            write_series(temporary, times)
    return folder


def _write_all(source: Source, kind: str, frames: range, path: Path) -> Path:
    """All frames in one file."""
    with cache.replacing(path) as temporary, track("export", len(frames)) as bar:
        writer: UsdWriter | AlembicWriter
        try:
            if kind == "usd":
                writer = UsdWriter(temporary, source.lines)
            else:
                writer = AlembicWriter(temporary, source.lines, frames[0])
        except ModuleNotFoundError as error:
            raise missing(error, f"ringlet export --format {kind}") from None
        for number in frames:
            writer.append(number, source.moment(number))
            bar.advance()
        writer.close()
    return path


def _need_room(folder: Path, lines: Lines, frames: int) -> None:
    """Refuse what the disk cannot take before it is begun: the libraries do not survive a full one."""
    place = next(path for path in (folder, *folder.absolute().parents) if path.exists())
    needed, free = lines.strands * lines.points * (12 * frames + 4), shutil.disk_usage(place).free
    if needed > free:
        raise InputError(
            f"{folder}: {frames} frames of {lines.strands:,} strands take {needed / 1e9:.1f} GB, but {free / 1e9:.1f} GB "
            "are free; choose fewer --frames or --strands, or another folder by --to"
        )


def _fresh(path: Path, lines: Lines) -> bool:
    """Whether a file was made from these strands; it says so near its begin."""
    try:
        with path.open("rb") as file:
            return lines.about.encode() in file.read(_HEAD)
    except OSError:
        return False
