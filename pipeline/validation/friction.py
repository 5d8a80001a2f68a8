"""Coulomb friction on an incline: when a strand sticks, and how fast it slides."""

from functools import partial

import numpy as np

from pipeline import kernels
from pipeline.validation.case import Case
from pipeline.validation.rod import GRAVITY, Rod, straight, undamped

SLOPE = 30.0
# a/g = sin(slope) - mu cos(slope) at 30 degrees
SLIDING = {0.1: 0.413397, 0.3: 0.240192}
STICKING = 0.3


def incline(degrees: float, friction: float, points: int = 16) -> Rod:
    """A free straight strand that lies along a slope, the plane y = 0; gravity is tilted instead of the plane."""
    settings = undamped()
    angle = np.radians(degrees)
    settings.gravity = (GRAVITY * float(np.sin(angle)), -GRAVITY * float(np.cos(angle)), 0.0)
    settings.friction, settings.theta = friction, 0.6
    return Rod(straight(0.1, points), [0] * points, settings, surface=_plane())


def acceleration(friction: float) -> float:
    """Acceleration over g of a strand that slides down 30 degrees, over 0.4 s after a start of 0.1 s."""
    rod = incline(SLOPE, friction)
    rod.advance(24)
    before = rod.state.velocity[0, :, 0].mean()
    rod.advance(96)
    return float((rod.state.velocity[0, :, 0].mean() - before) / (96 * rod.settings.dt) / GRAVITY)


def sticking_angle() -> float:
    """Slope [deg] up to which a strand of friction 0.3 stays where it is, by bisection."""
    low, high = np.degrees(np.arctan(STICKING)) + np.array([-0.5, 0.5])
    for _ in range(6):
        middle = (low + high) / 2
        rod = incline(middle, STICKING)
        rod.advance(120)
        slid = float((rod.state.points - rod.points)[..., 0].mean())
        low, high = (low, middle) if slid > 1e-4 else (middle, high)
    return float(low + high) / 2


def _plane() -> kernels.DistanceField:
    origin, spacing = np.array([-1.0, -0.1, -0.1]), 0.05
    height = origin[1] + spacing * np.arange(5)
    values = np.broadcast_to(height[None, :, None], (81, 5, 5)).astype(np.float32)
    return kernels.DistanceField(np.ascontiguousarray(values), origin, spacing)


def cases() -> list[Case]:
    """All cases of this file."""
    stick = float(np.degrees(np.arctan(STICKING)))
    return [
        Case("incline sticking angle", "none", sticking_angle, stick, 0.1 / stick),
        *[
            Case(f"incline acceleration mu {mu}", "none", partial(acceleration, mu), a, 0.01)
            for mu, a in SLIDING.items()
        ],
    ]
