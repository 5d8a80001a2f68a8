"""A groom from a file: units and axes as the config says, repairs, equal spacing, progressive order."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.config.schema import Config
from pipeline.errors import InputError
from pipeline.groom.axes import upright
from pipeline.groom.heads import Head
from pipeline.groom.repairs import LONGEST, SHORTEST, Repairs, cleaned, pushed_out, turned
from pipeline.progress import say
from pipeline.strands.formats import Ragged, read_groom
from pipeline.strands.held import held_ends, read_held
from pipeline.strands.random import hashed
from pipeline.strands.resample import resampled
from pipeline.strands.strands import Strands

Vectors = NDArray[np.float64]
Pins = NDArray[np.uint8]

_FAR = 0.05  # [m] roots this far from the head are those of another head, or in another unit
# Cells along a side of the groom, first and last round of the progressive order
_COARSEST, _FINEST = 4, 1 << 16
_ORDER, _KEY = 3, 7  # salts


def load(config: Config, head: Head | None) -> tuple[Strands, dict[str, Any]]:
    """The strands of the config's groom file, and a report of what was repaired.

    Raises InputError for a file that does not hold up, in which no strand has a shape, or that does not fit the head.
    """
    groom, path = config.groom, Path(config.groom.source)
    file = read_groom(path)
    repairs = Repairs()
    metric = in_metres(file, groom.unit_scale, groom.up_axis, groom.face_axis)
    kept, index = cleaned(metric, repairs)
    if not len(kept):
        raise InputError(
            f"{path}: none of its {len(file)} strands has a length from {1e3 * SHORTEST:g} mm to {LONGEST:g} m; "
            "check groom.unit_scale"
        )
    points, pins = evenly_spaced(kept, groom.points)
    if head is not None:
        points, pins = _on_the_head(points, pins, index, head, repairs, path)
    pins[:, 0] = np.maximum(pins[:, 0], 2)  # hair is clamped in its skin: that takes two points
    for line in repairs.lines():
        say("groom", f"{path.name}: {line}")
    order = progressive_order(points[:, 0], config.seed)[: groom.strands]
    wide = width(metric)
    report = {"source": path.name, "file_strands": len(file), "repairs": vars(repairs), "width": wide}
    if wide is not None:
        say("groom", f"{path.name}: its strands are {1e3 * wide:.3g} mm wide; what is drawn is render.width")
    held = held_ends(pins, groom.points)
    if groom.pins is not None:
        held = read_held(Path(groom.pins), len(file), groom.points)[index]
    return _strands(config, points[order], held[order], head), report


def in_metres(
    file: Ragged, unit_scale: float | None, up_axis: str | None, face_axis: str | None = None
) -> Ragged:
    """The strands of a file in metres with y up: as told, else as the file says, else in metres and upright already."""
    scale = unit_scale or file.metres or 1.0
    points = upright(file.points * scale, up_axis or file.up_axis or "y", face_axis)
    widths = None if file.widths is None else file.widths * np.float32(scale)
    return Ragged(points, file.counts, file.pins, widths)


def width(strands: Ragged) -> float | None:
    """Median of the diameters [m] of a file; strands of the pipeline have one width, `render.width`, and a taper."""
    if strands.widths is None or not np.isfinite(strands.widths).any():
        return None
    return float(np.nanmedian(strands.widths))


def evenly_spaced(strands: Ragged, count: int) -> tuple[Vectors, Pins]:
    """Ragged strands as points (S, count, 3) [m] at equal spacing, and how many of them are held (S, 2).

    One held point is a hinge and two are a clamp, whatever the spacing; more than two hold a length of the strand.
    """
    points = np.empty((len(strands), count, 3))
    for n in np.unique(strands.counts):
        rows = np.flatnonzero(strands.counts == n)
        points[rows] = resampled(strands.points[strands.first[rows, None] + np.arange(n)], count)
    pins = strands.pins.astype(np.int64)
    length = np.rint((pins - 1) * ((count - 1) / (strands.counts[:, None] - 1))).astype(np.int64) + 1
    pins = np.minimum(np.where(pins > 2, np.maximum(length, 2), pins), count)
    pins[:, 1] = np.minimum(pins[:, 1], count - pins[:, 0])
    return points, pins.astype(np.uint8)


def progressive_order(roots: Vectors, seed: int) -> NDArray[np.int64]:
    """An order of roots (S, 3) whose every prefix is evenly spread: by rounds over ever finer cells.

    In each round every cell of the round gives one strand, the one of lowest hash; cells halve from round to round.
    """
    left = np.argsort(hashed(seed, np.arange(len(roots)), _ORDER), kind="stable")
    span = max(float(np.ptp(roots, axis=0).max()), 1e-9)
    order: list[NDArray[np.int64]] = []
    cells = _COARSEST
    while len(left) and cells <= _FINEST:
        cell = np.floor((roots[left] - roots.min(axis=0)) / span * cells).astype(np.int64)
        name = (cell[:, 0] * (cells + 1) + cell[:, 1]) * (cells + 1) + cell[:, 2]
        chosen = np.sort(np.unique(name, return_index=True)[1])
        order.append(left[chosen])
        left = np.delete(left, chosen)
        cells *= 2
    return np.concatenate([*order, left])  # roots that share the finest cells come last


def _on_the_head(
    points: Vectors, pins: Pins, index: NDArray[np.int64], head: Head, repairs: Repairs, path: Path
) -> tuple[Vectors, Pins]:
    """Strands turned round where root and tip are swapped, and pushed out of the skin."""
    root, tip = (head.field.distance(points[:, end]) for end in (0, -1))
    wrong = turned(root, tip)
    points[wrong], pins[wrong] = points[wrong, ::-1], pins[wrong, ::-1]
    away = float(np.median(np.abs(np.where(wrong, tip, root))))
    if away > _FAR:
        raise InputError(
            f"{path}: its roots lie {away:.3g} m from the head (median); "
            "check groom.unit_scale and groom.up_axis, and that scene.head is the head it was made for"
        )
    points, through = pushed_out(points, head.field)
    repairs.turned_round += index[wrong].tolist()
    repairs.pushed_out += index[through].tolist()
    return points, pins


def _strands(config: Config, points: Vectors, held: Pins, head: Head | None) -> Strands:
    start = points[:, 1] - points[:, 0]
    normal = start / np.linalg.norm(start, axis=1, keepdims=True)
    if head is not None:
        normal = head.field.sample(points[:, 0])[1]
    return Strands(
        points=points.astype(np.float32),
        held=held,
        normal=normal.astype(np.float32),
        key=hashed(config.seed, np.arange(len(points)), _KEY),
    )
