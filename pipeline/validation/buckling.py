"""Straight strands that give way: under their own weight, and pushed at their ends."""

import numpy as np
from numpy.typing import NDArray

from pipeline.validation.case import Law, Model, Outcome, Reading
from pipeline.validation.rod import (
    BENDING,
    GRAVITY,
    Array,
    Rod,
    clamped,
    gravito_length,
    leaning,
    settling,
    straight,
    undamped,
)

GREENHILL = 7.837347  # critical w L^3/B of an upright rod
EULER = 20.19  # critical load P L^2/B, clamped and hinged: the first root of tan(x) = x, squared


def first_fallen(values: Array, fallen: NDArray[np.bool_]) -> float:
    """Where a sorted row of strands begins to give way; nan unless it is a row of upright ones, then fallen ones."""
    first = int(np.argmax(fallen)) if fallen.any() else 0
    if first == 0 or not fallen[first:].all():
        return float("nan")
    return float(values[first - 1 : first + 1].mean())


def self_buckling(model: Model, _quick: bool, points: int = 64) -> Outcome:
    """Critical Gamma of upright strands: between the longest that stays up and the shortest that falls."""
    gammas = GREENHILL * (1 + np.linspace(-0.015, 0.015, 16))
    strands = np.concatenate([straight(gravito_length(gamma), points, (0, 1, 0)) for gamma in gammas])
    settings = undamped(model, dt=4e-3, theta=0.5)
    settings.gravity = (0.0, -GRAVITY, 0.0)
    lean = 1e-5
    rod = Rod(strands, clamped(points), settings, start=leaning(strands, 0, lean))
    rod.advance(2000)
    fallen = np.abs(rod.state.points[:, -1, 0]) > 30 * lean
    return Outcome((Reading("critical Gamma", first_fallen(gammas, fallen), GREENHILL, 0.01),))


def onset(model: Model, quick: bool, points: int = 64) -> Outcome:
    """Load under which a clamped strand gives way when its hinged tip is pushed towards the root."""
    curve = push(model, 0.001 if quick else 0.02, points)
    load = float(np.interp(0.001, curve[1], curve[2]))
    return Outcome((Reading("P L^2/B at 0.1 %", load, EULER, 0.02),), {"push": curve})


def push(model: Model, shortening: float, points: int = 64) -> Array:
    """A strand whose hinged tip is pushed towards its clamped root by a part of its length, evenly.

    The carried tension alone keeps the lengths (to 3e-4 here; the tolerance of 1e-2 is never reached): no
    relaxation can shorten a straight line between two held ends.

    Returns (4, T): time [s], shortening over length, load P L^2/B, elastic energy E L/B.
    """
    length, pieces, steps = 0.1, round(shortening / 0.001), 200
    settings = settling(model, dt=5e-4, drag=20.0)
    settings.gravity, settings.tolerance = (0.0, 0.0, 0.0), 1e-2
    line = straight(length, points)
    bent = line.copy()
    bent[0, 2:-1, 1] = 1e-4 * length * np.sin(np.pi * np.linspace(0, 1, points - 3))
    rod = Rod(line, clamped(points, tip=1), settings, start=bent)
    rows, pushed = [], 0.0
    for piece in range(10 * pieces + 25):
        to = min((piece + 1) * 1e-4, shortening)
        hand = np.tile(np.eye(4), (steps + 1, 1, 1))
        hand[:, 0, 3] = -length * np.linspace(pushed, to, steps + 1)
        rod.advance(steps, hand)
        pushed = to
        rows.append(
            [
                (piece + 1) * steps * settings.dt,
                pushed,
                _load(rod) * length**2 / BENDING,
                rod.energy() * length / BENDING,
            ]
        )
    return np.array(rows).T


def _load(rod: Rod) -> float:
    x = rod.state.points[0]
    along = (x[1:, 0] - x[:-1, 0]) / np.linalg.norm(np.diff(x, axis=0), axis=1)
    return -float(np.mean(rod.state.tension[0, 1:] * along[1:]))


def laws() -> list[Law]:
    """The laws of this file."""
    return [
        Law(
            "self-buckling",
            "Strands stand upright, clamped at their lower ends, and lean by 1e-5 m; from a certain length on they "
            "fall. Reference: Greenhill, *Determination of the greatest height consistent with stability* (1881).",
            self_buckling,
        ),
        Law(
            "buckling under compression",
            "A strand is clamped at its root; its hinged tip is pushed towards it. The load, the mean axial tension, "
            "is read once the strand has given way. Reference: Euler's column, clamped and hinged, tan(x) = x.",
            onset,
        ),
    ]
