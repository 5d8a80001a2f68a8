"""Signed distance to the head: primitives, and the fold that joins them.

Points are (N, 3) [m], distances (N,) [m], negative inside. The formulas are those of `kernels.Shape`. Its smooth
minimum makes |d| too small near blends, never too large outside: contact takes its distances from the mesh instead.
"""

from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from pipeline import kernels
from pipeline.groom.head.table import load_table

Points = NDArray[np.floating[Any]]
Distances = NDArray[np.floating[Any]]

FOLD = 2e-3  # [m] half-width over which |x| is rounded off


def distance(p: Points, reach: float = np.inf) -> Distances:
    """Signed distance of points to the head; valid only within `reach` [m] of the surface."""
    q = np.array(p, np.float64)
    q[:, 0] = np.sqrt(q[:, 0] ** 2 + FOLD**2)
    return _head().distance(q, reach)


def value_and_gradient(p: Points, reach: float = np.inf, eps: float = 3e-4) -> tuple[Distances, Points]:
    """Distance (N,) and its gradient (N, 3), by differences on the corners of a tetrahedron of size `eps` [m]."""
    corners = np.array([[1, -1, -1], [-1, -1, 1], [-1, 1, -1], [1, 1, 1]], float)
    a, b, c, d = (distance(p + eps * corner, reach) for corner in corners)
    gradient = np.stack([a - b - c + d, c + d - a - b, b + d - a - c], axis=-1) / (4 * eps)
    return (a + b + c + d) / 4, gradient


def foot(p: Points, steps: int = 2, reach: float = np.inf) -> tuple[Points, Points]:
    """Points near the skin pulled onto it by Newton steps, and the unit normals there."""
    for _ in range(steps):
        d, g = value_and_gradient(p, reach)
        p = p - (d / np.maximum(dot(g, g), 0.2))[:, None] * g
    return p, g / norm(g)[:, None]


def fold_parts(p: Points, parts: Sequence[dict[str, Any]], reach: float) -> Distances:
    """Distances (N,) to the parts joined in order; each is evaluated only where it can matter within `reach`."""
    return _shape(parts).distance(np.ascontiguousarray(p, np.float64), reach)


def rotation(turn: Sequence[float]) -> NDArray[np.float64]:
    """Rotation matrix of degrees about x, then y, then z."""
    (cx, cy, cz), (sx, sy, sz) = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    about_z = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    about_y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    return np.asarray(about_z @ about_y @ np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]]))


def dot(a: Points, b: Points) -> Distances:
    """Scalar products of rows."""
    return np.asarray(np.einsum("ij,ij->i", a, b))


def norm(a: Points) -> Distances:
    """Lengths of rows."""
    return np.sqrt(dot(a, a))


def smoothstep(t: Distances) -> Distances:
    """0 below 0, 1 above 1, cubic between."""
    t = np.clip(t, 0, 1)
    return t * t * (3 - 2 * t)


@cache
def _head() -> kernels.Shape:
    return _shape(load_table()["parts"])


def _shape(parts: Sequence[dict[str, Any]]) -> kernels.Shape:
    """The parts of a table: ellipsoids (center, radii), tubes (knots x, y, z, radius) and groups of parts.

    `turn` is in degrees about x, then y, then z; a tube follows the natural cubic spline through its knots.
    """
    shape = kernels.Shape()
    for part in parts:
        join, blend = part.get("op", "add"), part.get("blend", 0.0)
        if "knots" in part:
            curve = _spline(part["knots"])
            t = np.linspace(0, curve.x[-1], 6 * len(part["knots"]) - 5)
            shape.tube(join, blend, _tube_box(curve), t, np.stack([curve(t, order) for order in range(3)]))
            continue
        center, turn = np.array(part["center"], float), rotation(part.get("turn", (0, 0, 0)))
        size = part.get("size") or max(part["radii"])
        box = np.stack([center - size, center + size])
        if "parts" in part:
            shape.group(join, blend, box, center, turn, _shape(part["parts"]))
        else:
            shape.ellipsoid(join, blend, box, center, turn, np.array(part["radii"], float))
    return shape


def _tube_box(curve: CubicSpline) -> NDArray[np.float64]:
    """The box (2, 3) around a tube, from corner to corner."""
    k = curve(np.linspace(0, curve.x[-1], 20))
    return np.stack([(k[:, :3] - k[:, 3:]).min(0), (k[:, :3] + k[:, 3:]).max(0)])


def _spline(knots: Sequence[Sequence[float]]) -> CubicSpline:
    k = np.asarray(knots, float)
    chord = np.r_[0, np.cumsum(norm(np.diff(k[:, :3], axis=0)))]
    return CubicSpline(chord, k, bc_type="natural")
