"""Motion: vibrating and swinging strands, and the energy of what nothing damps."""

from functools import partial

import numpy as np

from pipeline.validation.case import Case
from pipeline.validation.rod import (
    BENDING,
    GRAVITY,
    HEAD,
    MASS_PER_LENGTH,
    TORSION,
    Model,
    Rod,
    clamped,
    helix,
    period,
    straight,
    undamped,
)

# Clamped-free beam (Euler & Bernoulli): roots of cos(x) cosh(x) = -1, and Omega = x^2.
WAVENUMBERS = {1: 1.875104, 2: 4.694091}
OMEGA = {1: 3.516015, 2: 22.034492}
# Period of a pendulum over 2 pi sqrt(L/g), 2/pi K(sin(amplitude/2)).
PENDULUM = {30: 1.017409, 90: 1.180341}


def vibration(mode: int, model: Model = "none", points: int = 64) -> float:
    """Omega = 2 pi f L^2 sqrt(rho A / B) of a small vibration of a clamped strand, without gravity."""
    length = 0.1
    scale = length**2 * np.sqrt(MASS_PER_LENGTH / BENDING)
    expected = 2 * np.pi * scale / OMEGA[mode]
    rod = Rod(straight(length, points), clamped(points), undamped(model, dt=expected / 400))
    k = WAVENUMBERS[mode]
    s = k * np.maximum(rod.points[0, :, 0], 0) / length
    sigma = (np.cosh(k) + np.cos(k)) / (np.sinh(k) + np.sin(k))
    shape = np.cosh(s) - np.cos(s) - sigma * (np.sinh(s) - np.sin(s))
    rod.state.points[0, 2:, 1] = 1e-3 * length * shape[2:] / shape[-1]
    measured = period(rod.trace(1800, -1, 1), rod.settings.dt)
    return float(2 * np.pi * scale / measured)


def pendulum(degrees: float, points: int = 16) -> float:
    """Period over 2 pi sqrt(L/g) of a bob on a light strand without stiffness, let go at an angle."""
    length = 0.2
    small = 2 * np.pi * np.sqrt(length / GRAVITY)
    angle = np.radians(degrees)
    arc = np.linspace(0, length, points)[:, None]
    settings = undamped(dt=small / 200)
    settings.gravity = (0.0, -GRAVITY, 0.0)
    line = arc * np.array([np.sin(angle), -np.cos(angle), 0])
    rod = Rod(line[None], [HEAD] + [0] * (points - 1), settings, bending=0.0, twisting=0.0)
    masses = np.full(points, 1e-9)
    masses[-1] = 1e-5
    rod.rest.mass = masses[None]
    return float(period(rod.trace(700, -1, 0), settings.dt) / small)


def energy_gain(model: Model, theta: float) -> float:
    """Largest rise of the total energy above its start, in 5 s of an undamped swing, over the weight times the length."""
    length, points = 0.2, 32
    settings = undamped(model, theta=theta)
    settings.gravity = (0.0, -GRAVITY, 0.0)
    rod = Rod(helix(0.01, 0.03, length, points), clamped(points), settings)
    start, highest = rod.energy(), -np.inf
    for _ in range(300):
        rod.advance(4)
        highest = max(highest, rod.energy())
    return float(max(0.0, highest - start)) / (MASS_PER_LENGTH * GRAVITY * length**2)


def cases() -> list[Case]:
    """All cases of this file."""
    return [
        *[
            Case(f"vibration Omega_{mode}", "none", partial(vibration, mode), omega, 5e-3)
            for mode, omega in OMEGA.items()
        ],
        *[
            Case(f"pendulum {degrees} deg", "none", partial(pendulum, degrees), ratio, 1e-3)
            for degrees, ratio in PENDULUM.items()
        ],
        *[
            Case(
                f"energy gained by a free swing, theta {theta}",
                model,
                partial(energy_gain, model, theta),
                0.0,
                tolerance,
            )
            for model in TORSION
            for theta, tolerance in ((0.5, 0.02), (1.0, 1e-9))
        ],
    ]
