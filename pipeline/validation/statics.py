"""Shapes at rest: cantilevers, self-buckling, catenaries, and that they depend neither on time step nor on torsion."""

from functools import partial

import numpy as np

from pipeline.validation.case import Case
from pipeline.validation.rod import (
    BENDING,
    GRAVITY,
    HAND,
    HEAD,
    MODELS,
    TORSION,
    Model,
    Rod,
    clamped,
    gravito_length,
    helix,
    settling,
    straight,
    undamped,
)

# Tip drop over tip reach of a horizontally clamped rod under its own weight: two independent solutions of the
# rod equations by hand of the project's reference (validation.md) agree to 3e-10.
CANTILEVER = {1: 0.124562, 10: 1.066802, 100: 5.888105}
# Tip load P L^2/B: drop and reach over length (Bisshopp & Drucker 1945, elliptic integrals).
TIP_LOAD = {1: (0.301721, 0.943567), 10: (0.810609, 0.445004)}
GREENHILL = 7.837347  # Greenhill 1881: critical w L^3/B of an upright rod
CATENARY = {0.5: 0.398194, 0.9: 0.190709}  # sag over length, for span over length
EULER = 20.19  # critical load L^2/B, clamped and hinged


def cantilever(gamma: float, model: Model = "none", points: int = 64) -> float:
    """Tip drop over tip reach of a strand of Gamma, clamped horizontally."""
    rod = Rod(straight(gravito_length(gamma), points), clamped(points), settling(model))
    tip = rod.to_rest()[0, -1]
    return float(-tip[1] / tip[0])


def tip_load(load: float, points: int = 64) -> float:
    """Tip drop over length of a strand with a weight P at its tip, P L^2/B = load; the strand itself weighs little."""
    length = 0.1
    rod = Rod(straight(length, points), clamped(points), settling(dt=1e-3))
    mass = load * BENDING / length**2 / GRAVITY
    masses = np.full(points, 1e-5 * mass)
    masses[-1] = mass
    rod.rest.mass = masses[None]
    return float(-rod.to_rest()[0, -1, 1] / length)


def self_buckling(points: int = 64) -> float:
    """Critical Gamma of an upright strand: between the longest that stays up and the shortest that falls."""
    gammas = GREENHILL * (1 + np.linspace(-0.015, 0.015, 16))
    strands = np.concatenate([straight(gravito_length(gamma), points, (0, 1, 0)) for gamma in gammas])
    settings = undamped(dt=4e-3, theta=0.5)
    settings.gravity = (0.0, -GRAVITY, 0.0)
    rod = Rod(strands, clamped(points), settings)
    lean = 1e-5 * np.linspace(0, 1, points) ** 2
    rod.state.points[:, :, 0] += lean
    rod.advance(2000)
    fallen = np.abs(rod.state.points[:, -1, 0]) > 30 * lean[-1]
    first = int(np.argmax(fallen)) if fallen.any() else 0
    if first == 0 or not fallen[first:].all():
        return float("nan")
    return float(gammas[first - 1 : first + 1].mean())


def catenary(span: float, points: int = 65) -> float:
    """Sag over length of a strand without stiffness, held at its level ends at a distance of span times length."""
    length = 0.2
    half = (
        np.linspace(0, 1, points // 2 + 1)[:, None] * np.array([span, -np.sqrt(1 - span**2), 0]) * length / 2
    )
    other = half[-2::-1] * (-1, 1, 1) + (span * length, 0, 0)
    holds = [HEAD] + [0] * (points - 2) + [HAND]
    rod = Rod(np.concatenate([half, other])[None], holds, settling(), bending=0.0, twisting=0.0)
    shape = rod.to_rest()[0]
    return float(-shape[:, 1].min() / length)


def onset_load(points: int = 64, shortening: float = 0.001) -> float:
    """Load P L^2/B under which a clamped strand buckles when its hinged tip is pushed towards the root.

    The carried tension alone keeps the lengths (to 3e-4 here; the tolerance of 1e-2 is never reached): no
    relaxation can shorten a straight line between two held ends.
    """
    length = 0.1
    settings = undamped(dt=5e-4, theta=1.0)
    settings.drag, settings.tolerance = 20.0, 1e-2
    rod = Rod(straight(length, points), clamped(points, tip=1), settings)
    rod.state.points[0, 2:-1, 1] += 1e-4 * length * np.sin(np.pi * np.linspace(0, 1, points - 3))
    push, rest = 1000, 5000
    hand = np.tile(np.eye(4), (push + rest + 1, 1, 1))
    hand[:, 0, 3] = -shortening * length * np.minimum(np.arange(push + rest + 1) / push, 1)
    rod.advance(push + rest, hand)
    x = rod.state.points[0]
    along = (x[1:, 0] - x[:-1, 0]) / np.linalg.norm(np.diff(x, axis=0), axis=1)
    load = -float(np.mean(rod.state.tension[0, 1:] * along[1:]))
    return load * length**2 / BENDING


def drift_of_helix(model: Model, points: int = 64) -> float:
    """How far a curl moves from its rest shape in 5 s without gravity, over its length."""
    curl = helix(0.01, 0.02, 0.2, points)
    rod = Rod(curl, clamped(points), undamped(model, theta=0.6))
    rod.advance(1200)
    return float(np.abs(rod.state.points - curl).max() / 0.2)


def static_drift(model: Model, points: int = 32) -> float:
    """How far the tip of a hanging curl leaves its place of rest, over its length, when dt goes from 4 ms to others.

    All start from one equilibrium: a curl has several, and "frenet" may fall into another one on another way.
    """
    length = 0.2
    rod = Rod(helix(0.01, 0.03, length, points), clamped(points), settling(model, 4e-3))
    tip = rod.to_rest(still=1e-10)[0, -1].copy()
    drifts = []
    for dt in (0.5e-3, 2e-3, 16e-3):
        rod.settings = settling(model, dt)
        rod.advance(round(2.0 / dt))
        drifts.append(np.abs(rod.state.points[0, -1] - tip).max() / length)
    return float(max(drifts))


def cases() -> list[Case]:
    """All cases of this file."""
    return [
        *[
            Case(f"cantilever Gamma {g}", "none", partial(cantilever, g), h, 0.01)
            for g, h in CANTILEVER.items()
        ],
        *[
            Case("cantilever Gamma 10", model, partial(cantilever, 10, model), CANTILEVER[10], 0.01)
            for model in TORSION
        ],
        *[
            Case(f"cantilever tip load {load}", "none", partial(tip_load, load), drop, 0.01)
            for load, (drop, _) in TIP_LOAD.items()
        ],
        Case("self-buckling critical Gamma", "none", self_buckling, GREENHILL, 0.01),
        *[
            Case(f"catenary span {span}", "none", partial(catenary, span), sag, 1e-3)
            for span, sag in CATENARY.items()
        ],
        Case("buckling load clamped-hinged", "none", onset_load, EULER, 0.02),
        *[
            Case("drift of a helix at rest", model, partial(drift_of_helix, model), 0.0, 1e-6)
            for model in MODELS
        ],
        *[
            Case("static shape against time step", model, partial(static_drift, model), 0.0, 1e-6)
            for model in TORSION
        ],
    ]
