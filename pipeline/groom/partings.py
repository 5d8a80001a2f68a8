"""Partings of a config, as lines in the chart of the scalp."""

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.config.schema import Config, Parting
from pipeline.errors import InputError
from pipeline.groom.head import scalp
from pipeline.groom.head.distance import smoothstep
from pipeline.groom.heads import Head
from pipeline.strands.chart import Chart
from pipeline.strands.formats.table import read_table
from pipeline.strands.partings import Partings
from pipeline.strands.spacing import arc_length

Points = NDArray[np.floating[Any]]
Vectors = NDArray[np.float64]

_FRONT, _BACK = 0.10, -0.045  # [m] ends of the line from the hairline to the crown, in z
_FADE_FROM, _FADE_OVER = -0.08, 0.09  # [m] off the middle it bends back to it towards the crown
_BEYOND = 0.02  # [m] that it goes on after the hairline
_CORNERS = 60
_CHORD = 2e-3  # [m] longest piece of a line between corners that is taken for straight in the chart
_FAR = 0.05  # [m] corners this far from the skin were meant for something else
_ENDLESS = 100.0  # [m] half of the length of an offset's line where there is no head
_COLUMNS = "a corner has 2 numbers (u and v of the chart) or 3 (x, y and z in metres)"


def partings_of(config: Config, head: Head | None) -> Partings:
    """The partings that are not switched off, in the chart of the head, world coordinates, by name.

    Raises InputError for a file that is no table of corners, and for a line that does not touch the scalp.
    """
    named = {name: parting for name, parting in sorted(config.groom.partings.items()) if parting.enabled}
    if head is None:
        chart = Chart.from_above()
        return Partings(chart, tuple(_flat_line(name, parting, chart) for name, parting in named.items()))
    lines = tuple(_line(name, parting, head) for name, parting in named.items())
    for name, line in zip(named, lines, strict=True):
        skin = head.on_skin(refined(line, 0.01))
        if not (scalp.density(skin).any() or head.density(skin).any()):
            raise InputError(
                f"groom.partings.{name}: no part of it lies where hair grows; move its corners onto the scalp"
            )
    return Partings(head.chart, lines)


def refined(line: Vectors, step: float) -> Vectors:
    """The polyline (N, D) with points between its corners, at most `step` apart."""
    pieces = [line[:1]]
    for a, b in pairwise(line):
        count = max(1, int(np.ceil(np.linalg.norm(b - a) / step)))
        pieces.append(a + np.linspace(0, 1, count + 1)[1:, None] * (b - a))
    return np.concatenate(pieces)


def _line(name: str, parting: Parting, head: Head) -> Vectors:
    """Chart points of a parting on a head."""
    if parting.offset is not None:
        return head.fitted_chart.uv(_front_to_crown(parting.offset, head))
    corners = _corners(name, parting)
    if corners.shape[1] == 2:
        if (np.hypot(*corners.T) >= 1).any():
            row = int(np.argmax(np.hypot(*corners.T) >= 1))
            raise InputError(
                f"groom.partings.{name}: corner {row} lies outside of the chart; the scalp is where u^2 + v^2 < 0.81"
            )
        return corners
    off = np.abs(head.fitted_field.distance(corners))
    if (off > _FAR).any():
        row = int(off.argmax())
        raise InputError(
            f"groom.partings.{name}: corner {row} lies {off[row]:.2g} m from the skin; points are in the coordinates of "
            "the built-in head (y up, z forward, metres), whatever the size of the head"
        )
    return head.fitted_chart.uv(refined(corners, _CHORD))


def _flat_line(name: str, parting: Parting, chart: Chart) -> Vectors:
    """Chart points of a parting of strands without a head."""
    if parting.offset is not None:
        return np.array([[parting.offset, -_ENDLESS], [parting.offset, _ENDLESS]])
    corners = _corners(name, parting)
    return chart.uv(corners) if corners.shape[1] == 3 else corners


def _corners(name: str, parting: Parting) -> Vectors:
    if parting.file is not None:
        corners = read_table(Path(parting.file), (2, 3), _COLUMNS).values
        if len(corners) < 2 or not np.isfinite(corners).all():
            raise InputError(
                f"{parting.file}: groom.partings.{name} needs two corners at least, all of them finite; {_COLUMNS}"
            )
    else:
        corners = np.array(parting.points if parting.points is not None else parting.chart, np.float64)
    return np.concatenate([corners, corners[:1]]) if parting.closed else corners


def _front_to_crown(offset: float, head: Head) -> Vectors:
    """Points of the classic line on the skin, in fitted coordinates."""
    z = np.linspace(_BACK, _FRONT, _CORNERS)
    line = np.stack([offset * smoothstep((z - _FADE_FROM) / _FADE_OVER), np.full(_CORNERS, 0.16), z], axis=1)
    skin = head.fitted_field
    for _ in range(30):  # lower it onto the skin
        line[:, 1] -= skin.distance(line)
    # Far to the side there is no skin below its front: it would fall down the face. It ends beyond the hairline.
    hairy = np.flatnonzero(head.density(line) > 0)
    if not len(hairy):
        return line
    along = arc_length(line[None])[0]
    return np.asarray(line[along < along[hairy[-1]] + _BEYOND])
