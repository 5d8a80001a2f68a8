"""The mannequin's scalp: hairline, density of roots, and its chart.

The scalp is star-shaped about the chart's centre, so a chart point is a ray from there; the skin's area per chart area
is 4 r^2 / cos(normal, ray).
"""

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from pipeline.groom.head.distance import fold_parts, smoothstep
from pipeline.groom.head.table import load_table, part
from pipeline.groom.head_field import Field
from pipeline.strands.chart import Chart

Points = NDArray[np.floating[Any]]

_EAR_CLEARANCE = 3e-3  # [m] no roots on the ears
_OUTSIDE, _STEPS = 0.16, 14  # [m] from the chart's centre, and steps of tracing


@cache
def chart() -> Chart:
    """The chart of the skin about the crown's whorl, in the mannequin's coordinates."""
    scalp = load_table()["scalp"]
    w = np.array(scalp["whorl"], float)
    w /= np.linalg.norm(w)
    face = np.cross(w, [-1, 0, 0])
    face /= np.linalg.norm(face)
    return Chart(np.array(scalp["center"], float), np.stack([np.cross(face, w), face, w]))


def density(p: Points) -> Points:
    """Relative density of roots on the skin: 0 at the hairline to 1 inside it; none on the ears."""
    q = np.array(p, copy=True)
    q[:, 0] = np.abs(q[:, 0])
    clear = fold_parts(q, [part("ear")], _EAR_CLEARANCE)
    return smoothstep(_margin(p) / load_table()["scalp"]["fade"]) * smoothstep(clear / _EAR_CLEARANCE)


def on_skin(skin: Field, uv: Points) -> NDArray[np.float64]:
    """Points (N, 3) of the skin at chart points (N, 2), by sphere tracing from outside; fitted coordinates."""
    return skin.traced(chart().center, chart().rays(uv), _OUTSIDE, _STEPS)


def _margin(p: Points) -> Points:
    """How far [m] points on the skin lie inside the hairline (a height over azimuth); negative: bald."""
    scalp = load_table()["scalp"]
    phi, y = np.transpose(scalp["hairline"])
    line = CubicSpline(np.radians(phi), y, bc_type="clamped")
    x, z = np.abs(p[:, 0]), p[:, 2] - scalp["axis_z"]
    azimuth = np.arctan2(x, z)
    slope = line(azimuth, 1) / np.maximum(np.hypot(x, z), 0.02)
    return np.asarray((p[:, 1] - line(azimuth)) / np.hypot(1, slope))
