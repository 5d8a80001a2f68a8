"""How the built-in head lies in another one: one scale and one offset, and whether the other one looks the same way.

The mannequin's skull is laid onto the mesh's by crown, breadth and occiput; then scale and offset are refined by
Gauss-Newton on the distances d of points x of the mannequin's skull to the mesh: d(s x + o) + n . (ds x + do) = 0, the
worst points left out (ears, noses). Chen & Medioni, "Object Modelling by Registration of Multiple Range Images" (1992).
"""

from dataclasses import dataclass
from functools import cache
from itertools import permutations, product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.body.placement import Placement
from pipeline.groom.head import distance, scalp
from pipeline.groom.head_field import Field

Points = NDArray[np.floating[Any]]
Vectors = NDArray[np.float64]

# The mannequin's skull [m]: where a fit starts from.
_CROWN, _BREADTH, _OCCIPUT, _TOP = 0.131, 0.158, -0.0876, 0.075

_SAMPLES = 2000  # of the mannequin's skin
_PLASTIC = np.array([0.7548776662466927, 0.5698402909980532])  # steps of the R2 sequence
_OUTSIDE, _STEPS = 0.16, 14  # [m] from the chart's centre, and steps from there to the skin
_NECK, _SKULL = -0.11, -0.02  # [m] heights above which points are compared, and fitted
_ROUNDS, _KEPT = 12, 0.85
_FARTHEST = 0.04  # [m] more than this does not matter
_SIZES = 0.5, 2.0  # of the first guess: a fit that leaves this range is none
_BETTER = 0.8  # another way round has to fit this much better to be told


@dataclass(frozen=True)
class Fit:
    """A head laid onto a mesh."""

    placement: Placement
    apart: float
    """Mean distance [m] of the mannequin's skin to the mesh, in the mannequin's size."""


def fit_skull(points: Points, field: Field, turn: Vectors | None = None) -> Fit:
    """Lay the mannequin onto a mesh of points (V, 3) [m] and distances `field`, after turning it by `turn` (3, 3)."""
    turn = np.eye(3) if turn is None else turn
    scale, offset = _first_guess(np.asarray(points, np.float64) @ turn.T)
    first = scale
    skin = _skin()
    skull = skin[skin[:, 1] > _SKULL]
    for _ in range(_ROUNDS):
        d, n = field.sample((skull * scale + offset) @ turn)
        n = n @ turn.T
        kept = np.abs(d) <= np.quantile(np.abs(d), _KEPT)
        rows = np.column_stack([np.einsum("ij,ij->i", n, skull), n])[kept]
        step = np.linalg.lstsq(rows, -d[kept], rcond=None)[0]
        scale, offset = scale + float(step[0]), offset + step[1:]
    x, y, z = offset.tolist()
    if not _SIZES[0] < scale / first < _SIZES[1]:
        return Fit(Placement(scale, (x, y, z)), np.inf)
    off = np.abs(field.distance((skin * scale + offset) @ turn)) / scale
    return Fit(Placement(scale, (x, y, z)), float(np.minimum(off, _FARTHEST).mean()))


def better_turned(points: Points, field: Field, fit: Fit) -> Vectors | None:
    """The quarter turns (3, 3) after which the head fits clearly better than it does, or None."""
    found = [(fit_skull(points, field, turn).apart, index) for index, turn in enumerate(_quarter_turns())]
    apart, best = min(found)
    return _quarter_turns()[best] if apart < _BETTER * fit.apart else None


def _first_guess(p: Vectors) -> tuple[float, Vectors]:
    """Same crown, breadth and occiput."""
    crown = p[:, 1].max()
    scale = 1.0
    for _ in range(20):
        top = p[p[:, 1] > crown - _TOP * scale]
        scale = float(np.ptp(top[:, 0])) / _BREADTH
    middle = 0.5 * (top[:, 0].min() + top[:, 0].max())
    return scale, np.array([middle, crown - _CROWN * scale, top[:, 2].min() - _OCCIPUT * scale])


@cache
def _skin() -> Vectors:
    """Points (N, 3) [m] of the mannequin's skin above its neck."""
    uv = 2 * ((0.5 + np.arange(_SAMPLES)[:, None] * _PLASTIC) % 1) - 1
    chart = scalp.chart()
    ray = chart.rays(uv[np.hypot(*uv.T) < 0.98])
    reach = np.full(len(ray), _OUTSIDE)
    for _ in range(_STEPS):  # sphere tracing
        reach -= distance.distance(chart.center + reach[:, None] * ray)
    points = chart.center + reach[:, None] * ray
    return np.asarray(points[points[:, 1] > _NECK])


@cache
def _quarter_turns() -> list[Vectors]:
    """The 24 rotations that take axes to axes."""
    found = []
    for order, signs in product(permutations(range(3)), product((1.0, -1.0), repeat=3)):
        turn = np.zeros((3, 3))
        turn[range(3), order] = signs
        if np.linalg.det(turn) > 0:
            found.append(turn)
    return found
