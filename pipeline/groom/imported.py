"""A groom from a file: units and axes as the config says, repairs, equal spacing, progressive order."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from pipeline.config.schema import Config
from pipeline.errors import InputError
from pipeline.groom.heads import Head
from pipeline.groom.repairs import Repairs, cleaned, turned
from pipeline.progress import say
from pipeline.strands.formats import Ragged, read_groom
from pipeline.strands.random import hashed
from pipeline.strands.spacing import equal_spacing
from pipeline.strands.strands import Strands

Vectors = NDArray[np.float64]

_DENSE = 4  # points of the smooth curve for each point of the resampled strand
_CLEARANCE = 0.8e-3  # [m] between strands and skin
_KEY = 7


def load(config: Config, head: Head | None) -> tuple[Strands, dict[str, Any]]:
    """The strands of the config's groom file, and a report of what was repaired.

    Raises InputError for a file that does not hold up, or in which no strand has a shape.
    """
    groom, path = config.groom, Path(config.groom.source)
    ragged = read_groom(path)
    ragged = Ragged(upright(ragged.points * groom.unit_scale, groom.up_axis), ragged.counts, ragged.pins)
    repairs = Repairs()
    lines, index = cleaned(ragged, repairs)
    if not lines:
        raise InputError(f"{path}: none of its {len(ragged)} strands has a shape; check groom.unit_scale")
    points = np.stack([resampled(line, groom.points) for line in lines])
    pins = ragged.pins[index].copy()
    if head is not None:
        points = _on_the_head(points, pins, index, head, repairs)
    order = progressive_order(points[:, 0], config.seed)[: groom.strands]
    for line in repairs.lines():
        say("groom", f"{path.name}: {line}")
    strands = _strands(config, points[order], pins[order], head)
    return strands, {"source": path.name, "file_strands": len(ragged), "repairs": vars(repairs)}


def upright(points: Vectors, up_axis: str) -> Vectors:
    """Turn points (N, 3) so that y is up; a file with z up looks along -y, as in Blender."""
    if up_axis == "z":
        return points[:, [0, 2, 1]] * np.array([1.0, 1.0, -1.0])
    if up_axis == "x":
        return points[:, [1, 0, 2]] * np.array([-1.0, 1.0, 1.0])
    return points


def resampled(line: Vectors, count: int) -> Vectors:
    """A polyline (n, 3) as `count` points at equal spacing along a smooth curve through its points."""
    along = np.r_[0, np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))]
    wanted = np.linspace(0, along[-1], _DENSE * count)
    if len(line) >= 4:
        dense = CubicSpline(along, line, bc_type="natural")(wanted)
    else:
        dense = np.stack([np.interp(wanted, along, line[:, k]) for k in range(3)], axis=1)
    return np.asarray(equal_spacing(dense[None], count)[0], np.float64)


def progressive_order(roots: Vectors, seed: int) -> NDArray[np.int64]:
    """An order of roots (S, 3) whose every prefix is evenly spread: by rounds over ever finer cells.

    In each round every cell of the round gives one strand, the one of lowest hash; cells halve from round to round.
    """
    rank = hashed(seed, np.arange(len(roots)), 3)
    left = np.lexsort((np.arange(len(roots)), rank))
    span = max(float(np.ptp(roots, axis=0).max()), 1e-9)
    order: list[NDArray[np.int64]] = []
    cells = 4
    while len(left):
        cell = np.floor((roots[left] - roots.min(axis=0)) / span * cells).astype(np.int64)
        name = (cell[:, 0] * (cells + 1) + cell[:, 1]) * (cells + 1) + cell[:, 2]
        _, first = np.unique(name, return_index=True)
        chosen = np.sort(first)
        order.append(left[chosen])
        left = np.delete(left, chosen)
        cells = min(2 * cells, 1 << 16)
    return np.concatenate(order)


def _on_the_head(
    points: Vectors, pins: NDArray[np.uint8], index: NDArray[np.int64], head: Head, repairs: Repairs
) -> Vectors:
    """Strands turned round where root and tip are swapped, and pushed out of the skin."""
    ends = [head.field.distance(points[:, k]) for k in (0, -1)]
    wrong = turned(np.abs(ends[0]), np.abs(ends[1]))
    points[wrong] = points[wrong, ::-1]
    pins[wrong] = pins[wrong, ::-1]
    repairs.turned_round += index[wrong].tolist()
    below = np.zeros(len(points), bool)
    for _ in range(3):
        free = points[:, 2:].reshape(-1, 3)
        d, n = head.field.sample(free)
        depth = np.maximum(_CLEARANCE - d, 0)
        below |= (depth > _CLEARANCE).reshape(len(points), -1).any(axis=1)
        points[:, 2:] = (free + depth[:, None] * n).reshape(points[:, 2:].shape)
    repairs.pushed_out += index[below].tolist()
    return equal_spacing(points, points.shape[1])


def _strands(config: Config, points: Vectors, pins: NDArray[np.uint8], head: Head | None) -> Strands:
    start = points[:, 1] - points[:, 0]
    normal = start / np.linalg.norm(start, axis=1, keepdims=True)
    if head is not None:
        normal = head.field.sample(points[:, 0])[1]
    pins[:, 0] = np.maximum(pins[:, 0], 2)  # a clamped root needs two points
    return Strands(
        points=points.astype(np.float32),
        pins=pins,
        normal=normal.astype(np.float32),
        side=np.zeros(len(points), np.int8),
        key=hashed(config.seed, np.arange(len(points)), _KEY),
    )
