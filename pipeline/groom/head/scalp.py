"""The mannequin's scalp: hairline, density of roots, and an equal-area chart of the skin.

Chart: Lambert's equal-area projection about the crown's whorl. The scalp is star-shaped about `center`, so a chart
point is a ray from there; the skin's area per chart area is r^2 / cos(normal, ray).
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from pipeline.groom.head.distance import dot, fold_parts, norm, smoothstep
from pipeline.groom.head.table import load_table, part

Points = NDArray[np.floating[Any]]

_EAR_CLEARANCE = 3e-3  # [m] no roots on the ears


def center() -> NDArray[np.float64]:
    """The point inside the skull that chart rays start from [m]."""
    return np.array(load_table()["scalp"]["center"], float)


def whorl() -> NDArray[np.float64]:
    """Unit vector from the chart's centre to the crown's whorl."""
    w = np.array(load_table()["scalp"]["whorl"], float)
    return np.asarray(w / np.linalg.norm(w))


def density(p: Points) -> Points:
    """Relative density of roots on the skin: 0 at the hairline to 1 inside it; none on the ears."""
    q = np.array(p, copy=True)
    q[:, 0] = np.abs(q[:, 0])
    clear = fold_parts(q, [part("ear")], _EAR_CLEARANCE)
    return smoothstep(_margin(p) / load_table()["scalp"]["fade"]) * smoothstep(clear / _EAR_CLEARANCE)


def chart_frame() -> NDArray[np.float64]:
    """Rows: the head's right, towards the face, out of the whorl (right-handed seen from outside)."""
    w = whorl()
    face = np.cross(w, [-1, 0, 0])
    face /= np.linalg.norm(face)
    return np.stack([np.cross(face, w), face, w])


def _margin(p: Points) -> Points:
    """How far [m] points on the skin lie inside the hairline (a height over azimuth); negative: bald."""
    scalp = load_table()["scalp"]
    phi, y = np.transpose(scalp["hairline"])
    line = CubicSpline(np.radians(phi), y, bc_type="clamped")
    x, z = np.abs(p[:, 0]), p[:, 2] - scalp["axis_z"]
    azimuth = np.arctan2(x, z)
    slope = line(azimuth, 1) / np.maximum(np.hypot(x, z), 0.02)
    return np.asarray((p[:, 1] - line(azimuth)) / np.hypot(1, slope))


def rays(uv: Points) -> NDArray[np.float64]:
    """Unit rays (N, 3) of chart points (N, 2) in the unit disc."""
    r2 = dot(uv, uv)[:, None]
    return np.hstack([2 * uv * np.sqrt(np.maximum(1 - r2, 0)), 1 - 2 * r2]) @ chart_frame()


def to_chart(p: Points) -> Points:
    """Chart points (N, 2) of points on the head."""
    q = (p - center()) @ chart_frame().T
    q /= norm(q)[:, None]
    return np.asarray(q[:, :2] / np.sqrt(2 * (1 + q[:, 2:])))
