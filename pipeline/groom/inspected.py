"""What is in a groom file, what its import would repair, and a config to begin with."""

import json
import os
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import InputError
from pipeline.groom.imported import evenly_spaced, in_metres, width
from pipeline.groom.repairs import Repairs, cleaned
from pipeline.strands.formats import Ragged, read_groom

_HAIR = (5e-3, 2.0)  # [m] lengths that hair has
_POINTS, _MOST_POINTS = 32, 128  # on a strand, of the config to begin with
_GUIDES = 1000


@dataclass(frozen=True)
class Inspected:
    """A groom file, read and cleaned."""

    path: Path
    file: Ragged
    kept: Ragged
    """In metres with y up, without what the import drops."""
    repairs: Repairs
    scale: float
    up_axis: str

    @property
    def lengths(self) -> NDArray[np.float64]:
        """(S,) [m] of the strands that are kept."""
        step = np.linalg.norm(np.diff(self.kept.points, axis=0, prepend=0), axis=1)
        step[self.kept.first] = 0
        return np.add.reduceat(step, self.kept.first) if len(self.kept) else np.zeros(0)

    @property
    def points(self) -> int:
        """How many points a strand of the pipeline should have: no fewer than most strands of the file."""
        return int(np.clip(np.median(self.file.counts), _POINTS, _MOST_POINTS))

    def evenly(self) -> NDArray[np.float32]:
        """The strands that are kept as points (S, P, 3) [m] at equal spacing, in the order of the file."""
        return evenly_spaced(self.kept, self.points)[0].astype(np.float32)


def inspect(path: Path, unit_scale: float | None = None, up_axis: str | None = None) -> Inspected:
    """Read a groom file. Raises InputError for one that does not hold up."""
    file, repairs = read_groom(path), Repairs()
    kept, _ = cleaned(in_metres(file, unit_scale, up_axis), repairs)
    return Inspected(
        path, file, kept, repairs, unit_scale or file.metres or 1.0, up_axis or file.up_axis or "y"
    )


def report(found: Inspected) -> dict[str, Any]:
    """Figures of a groom file, in metres where not said otherwise."""
    file, lengths = found.file, found.lengths
    held = np.unique(file.pins, axis=0)
    facts: dict[str, Any] = {
        "file": str(found.path),
        "strands": len(file),
        "points": [int(file.counts.min()), int(file.counts.max())] if len(file) else [0, 0],
        "unit_scale": found.scale,
        "unit_says": file.metres,
        "up_axis": found.up_axis,
        "up_axis_says": file.up_axis,
        "held": [{"root": int(root), "tip": int(tip)} for root, tip in held],
        "width": width(found.kept),
        "strands_kept": len(found.kept),
        "length": [float(x) for x in np.quantile(lengths, [0, 0.5, 1])] if len(lengths) else None,
        "lower": found.kept.points.min(axis=0).tolist() if len(found.kept) else None,
        "upper": found.kept.points.max(axis=0).tolist() if len(found.kept) else None,
        "repairs": {name: len(which) for name, which in vars(found.repairs).items() if which},
    }
    return facts | {"doubt": _doubt(facts)}


def lines(found: Inspected) -> list[str]:
    """The report in words."""
    facts = report(found)
    fewest, most = facts["points"]
    points = f"{fewest}" if fewest == most else f"{fewest} to {most}"
    held = (f"{pins['root']} at the root, {pins['tip']} at the tip" for pins in facts["held"][:4])
    told = [
        f"{found.path}: {facts['strands']:,} strands of {points} points",
        f"unit      {found.scale:g} m ({_whence(found.scale, facts['unit_says'])})",
        f"up axis   {found.up_axis} ({_whence(found.up_axis, facts['up_axis_says'])})",
        f"held      {', or '.join(held)}",
    ]
    if facts["length"]:
        shortest, median, longest = (_length(x) for x in facts["length"])
        size = np.subtract(facts["upper"], facts["lower"])
        told.append(f"lengths   {shortest} to {longest}, median {median}")
        told.append(
            f"size      {' x '.join(_length(x) for x in size)}, from y = {_length(facts['lower'][1])}"
        )
    if facts["width"]:
        told.append(f"width     {1e3 * facts['width']:.3g} mm (median; what is drawn is render.width)")
    told += [f"repair    {line}" for line in found.repairs.lines()]
    return told + ([f"doubt     {facts['doubt']}"] if facts["doubt"] else [])


def starting_config(found: Inspected, folder: Path) -> str:
    """A config to begin with, to be put into a folder. Raises InputError where no strand is left."""
    if not len(found.kept):
        raise InputError(f"{found.path}: no strand of it can serve; {_doubt(report(found))}")
    strands = len(found.kept)
    extends = 'extends = "default.toml"\n' if (folder / "default.toml").exists() else ""
    drawn = width(found.kept)
    source = Path(os.path.relpath(found.path.absolute(), folder.absolute())).as_posix()
    text = f"""\
#:schema ./schema.json
# The groom of {found.path.name}.
{extends}name = {json.dumps(_name(found.path))}

[scene]
head = "none" # the mesh of the head that the groom was made for; without it there is no contact

[groom]
source = {json.dumps(source, ensure_ascii=False)}
unit_scale = {found.scale:g} # metres per unit of the file
up_axis = "{found.up_axis}"
strands = {strands}
guides = {min(strands, _GUIDES)}
points = {found.points}
"""
    return text + (f'\n[render]\nwidth = "{1e3 * drawn:.3g} mm" # of the file\n' if drawn else "")


def _doubt(facts: dict[str, Any]) -> str:
    if facts["length"] is None:
        return "no strand has a length between 1 mm and 10 m: check groom.unit_scale"
    median = facts["length"][1]
    if not _HAIR[0] <= median <= _HAIR[1]:
        return f"strands of {_length(median)} are no hair: groom.unit_scale is 0.01 for centimetres, 0.001 for millimetres"
    return ""


def _name(path: Path) -> str:
    """A file's stem as the name of an experiment."""
    return re.sub(r"^[^A-Za-z0-9]+|[^A-Za-z0-9._-]+", "_", path.stem).lstrip("_")[:99] or "groom"


def _whence(value: object, said: object) -> str:
    if said is None:
        return "the file does not say"
    return "the file says so" if value == said else f"the file says {said}"


def _length(metres: float) -> str:
    return f"{metres:.3g} m" if abs(metres) >= 1 else f"{100 * metres:.3g} cm"
