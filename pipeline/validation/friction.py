"""Coulomb friction on an incline: when a strand sticks, and how fast it slides."""

import numpy as np

from pipeline import kernels
from pipeline.validation.case import Law, Model, Outcome, Reading
from pipeline.validation.rod import GRAVITY, Array, Rod, straight, undamped

SLOPE = 30.0
# a/g = sin(slope) - mu cos(slope) at 30 degrees
SLIDING = {0.1: 0.413397, 0.3: 0.240192}


def incline(slopes: Array, friction: float, model: Model, points: int = 16) -> Rod:
    """Free straight strands that lie along a slope [rad], the plane y = 0; gravity is tilted instead of the plane.

    Loads tilt it, one for each strand, so that all slopes are stepped together.
    """
    settings = undamped(model)
    settings.friction, settings.theta = friction, 0.6
    strands = np.repeat(straight(0.1, points), len(slopes), axis=0)
    rod = Rod(strands, [0] * points, settings, twisting=0.0, surface=_plane())
    direction = np.stack([np.sin(slopes), -np.cos(slopes), 0 * slopes], axis=-1)
    rod.rest.load = rod.rest.mass[..., None] * GRAVITY * direction[:, None]
    return rod


def acceleration(friction: float, model: Model = "none") -> float:
    """Acceleration over g of a strand that slides down 30 degrees, over 0.4 s after a start of 0.1 s."""
    rod = incline(np.radians([SLOPE]), friction, model)
    rod.advance(24)
    before = rod.state.velocity[0, :, 0].mean()
    rod.advance(96)
    return float((rod.state.velocity[0, :, 0].mean() - before) / (96 * rod.settings.dt) / GRAVITY)


def sticking_angle(friction: float, model: Model = "none") -> float:
    """Slope [deg] up to which a strand stays where it is, to 0.01 degrees."""
    slopes = np.degrees(np.arctan(friction)) + np.linspace(-0.5, 0.5, 101)
    rod = incline(np.radians(slopes), friction, model)
    rod.advance(120)
    slid = (rod.state.points - rod.points)[..., 0].mean(axis=1) > 1e-4
    first = int(np.argmax(slid)) if slid.any() else 0
    if first == 0 or not slid[first:].all():
        return float("nan")
    return float(slopes[first - 1 : first + 1].mean())


def friction(model: Model, _quick: bool) -> Outcome:
    """Where strands stick, and how fast they slide."""
    readings = []
    for mu in SLIDING:
        stick = float(np.degrees(np.arctan(mu)))
        readings += [Reading(f"mu {mu}, steepest slope [deg]", sticking_angle(mu, model), stick, 0.1 / stick)]
    for mu, a in SLIDING.items():
        readings += [Reading(f"mu {mu}, 30 degrees, a/g", acceleration(mu, model), a, 0.01)]
    return Outcome(tuple(readings))


def _plane() -> kernels.DistanceField:
    origin, spacing = np.array([-1.0, -0.1, -0.1]), 0.05
    height = origin[1] + spacing * np.arange(5)
    values = np.broadcast_to(height[None, :, None], (81, 5, 5)).astype(np.float32)
    return kernels.DistanceField(np.ascontiguousarray(values), origin, spacing)


def laws() -> list[Law]:
    """The laws of this file."""
    return [
        Law(
            "incline",
            "A straight strand lies along a slope. It sticks if and only if tan(slope) <= mu, and slides down with "
            "a = g (sin - mu cos) otherwise (Coulomb).",
            friction,
        )
    ]
