"""numpy twin of shapes of joined parts: the formulas of the mannequin's distance, point by point."""

from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from pipeline.groom.head.distance import dot, norm, rotation

Points = NDArray[np.floating[Any]]
Distances = NDArray[np.floating[Any]]


def fold_parts(p: Points, parts: Sequence[dict[str, Any]], reach: float) -> Distances:
    """Join the parts in order; each is evaluated only where it can matter within `reach` of the surface."""
    d = np.full(len(p), 1.0, p.dtype)
    blends = np.array([part["blend"] for part in parts])
    for i, part in enumerate(parts):
        near = np.arange(len(p)) if np.isinf(reach) else _close_to(p, part, reach + blends[i:].max())
        if len(near):
            d[near] = _join(d[near], _primitive(p[near], part), part)
    return d


def ellipsoid(
    p: Points, center: Sequence[float], radii: Sequence[float], turn: Sequence[float] = (0, 0, 0)
) -> Distances:
    """First-order distance to an ellipsoid; `turn` is in degrees about x, then y, then z."""
    q = (p - np.asarray(center, p.dtype)) @ rotation(turn).astype(p.dtype) / np.asarray(radii, p.dtype)
    k0 = norm(q) + 1e-9
    q /= np.asarray(radii, p.dtype)
    return np.asarray(k0 * (k0 - 1) / (norm(q) + 1e-9))


def tube(p: Points, knots: Sequence[Sequence[float]]) -> Distances:
    """Distance to a round tube along the natural cubic spline through knots [x, y, z, radius]."""
    curve = _spline(tuple(map(tuple, knots)))
    t = np.linspace(0, curve.x[-1], 6 * len(knots) - 5)
    c, v, a = (curve(t, order).astype(p.dtype) for order in range(3))
    i = np.argmin(dot(c[:, :3], c[:, :3]) - 2 * p @ c[:, :3].T, axis=1)
    c, v, a = c[i], v[i], a[i]
    e, vv = c[:, :3] - p, dot(v[:, :3], v[:, :3])
    s = -dot(e, v[:, :3]) / np.maximum(vv + dot(e, a[:, :3]), 0.3 * vv)
    s = np.clip(s, -t[i], t[-1] - t[i]).astype(p.dtype)[:, None]
    c = c + s * v + s * s / 2 * a
    return np.asarray(norm(p - c[:, :3]) - c[:, 3])


def smooth_min(a: Distances, b: Distances, k: float) -> Distances:
    """Smooth minimum: equals min(a, b) wherever |a - b| >= k; C2 elsewhere."""
    h = np.maximum(k - np.abs(a - b), 0) / k
    return np.minimum(a, b) - k / 6 * h**3


def _primitive(p: Points, part: dict[str, Any]) -> Distances:
    if "parts" in part:
        turned = (p - np.asarray(part["center"], p.dtype)) @ rotation(part["turn"]).astype(p.dtype)
        return fold_parts(turned, part["parts"], np.inf)
    if "knots" in part:
        return tube(p, part["knots"])
    return ellipsoid(p, part["center"], part["radii"], part.get("turn", (0, 0, 0)))


def _join(d: Distances, b: Distances, part: dict[str, Any]) -> Distances:
    k = part["blend"]
    match part.get("op", "add"):
        case "add":
            return smooth_min(d, b, k)
        case "cut":
            return -smooth_min(-d, b, k)
        case _:  # clip
            return -smooth_min(-d, -b, k)


def _close_to(p: Points, part: dict[str, Any], margin: float) -> NDArray[np.intp]:
    """Points whose distance to a part's box is at most `margin`."""
    if part.get("op") == "clip":
        return np.arange(len(p))
    lo, hi = _box(part)
    inside = np.ones(len(p), bool)
    for x, a, b in zip(p.T, lo - margin, hi + margin, strict=True):
        inside &= (x > p.dtype.type(a)) & (x < p.dtype.type(b))
    return np.flatnonzero(inside)


def _box(part: dict[str, Any]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    if "knots" in part:
        curve = _spline(tuple(map(tuple, part["knots"])))
        k = curve(np.linspace(0, curve.x[-1], 20))
        return (k[:, :3] - k[:, 3:]).min(0), (k[:, :3] + k[:, 3:]).max(0)
    reach = part.get("size") or max(part["radii"])
    return np.asarray(part["center"]) - reach, np.asarray(part["center"]) + reach


@cache
def _spline(knots: tuple[tuple[float, ...], ...]) -> CubicSpline:
    k = np.asarray(knots, float)
    chord = np.r_[0, np.cumsum(norm(np.diff(k[:, :3], axis=0)))]
    return CubicSpline(chord, k, bc_type="natural")
