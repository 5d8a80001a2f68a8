"""Motion: vibrating and swinging strands, and the energy of what nothing damps."""

from functools import partial

import numpy as np

from pipeline import kernels
from pipeline.validation.case import Case
from pipeline.validation.rod import (
    BENDING,
    GRAVITY,
    HEAD,
    MASS_PER_LENGTH,
    Model,
    Rod,
    clamped,
    first_crossing,
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
    """Period over 2 pi sqrt(L/g) of a bob on a light strand without stiffness, let go at an angle.

    Four times the first quarter, at T/200: carrying the tension over a step damps a swing by O(dt), which
    later quarters would show.
    """
    length = 0.2
    small = 2 * np.pi * np.sqrt(length / GRAVITY)
    angle = np.radians(degrees)
    arc = np.linspace(0, length, points)[:, None]
    settings = undamped(dt=small / 200)
    settings.gravity = (0.0, -GRAVITY, 0.0)
    line = arc * np.array([np.sin(angle), -np.cos(angle), 0])
    rod = Rod(line[None], [HEAD] + [0] * (points - 1), settings, bending=0.0, twisting=0.0)
    masses = np.full(points, 1e-10)
    masses[-1] = 1e-5
    rod.rest.mass = masses[None]
    return float(4 * first_crossing(rod.trace(80, -1, 0)) * settings.dt / small)


def swing(model: Model, theta: float, dt: float) -> tuple[float, float]:
    """Energy that an undamped strand of 10 cm gains at most and loses by the end of 2 s, over its largest kinetic energy.

    It is clamped 30 degrees off the direction of gravity and let go.
    """
    settings = undamped(model, dt, theta)
    settings.gravity = (GRAVITY * float(np.cos(np.pi / 6)), -GRAVITY / 2, 0.0)
    rod = Rod(straight(0.1, 32), clamped(32), settings)
    energies = []
    for _ in range(100):
        rod.advance(round(0.02 / dt))
        energies.append(kernels.energies(rod.state, rod.rest, settings)[0])
    total = np.sum(energies, axis=1) - Rod(rod.points, clamped(32), settings).energy()
    kinetic = max(energy[2] for energy in energies)
    return float(max(0.0, total.max()) / kinetic), float(-total[-1] / kinetic)


def energy_gain(model: Model, theta: float) -> float:
    """Energy gained at the default step of 1/240 s."""
    return swing(model, theta, 1 / 240)[0]


def energy_drift(model: Model) -> float:
    """Energy lost with theta = 0.5 and a step of 0.25 ms."""
    return swing(model, 0.5, 0.25e-3)[1]


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
                f"energy gained by a swing, theta {theta}",
                "rotor",
                partial(energy_gain, "rotor", theta),
                0.0,
                1e-6,
            )
            for theta in (0.6, 1.0)
        ],
        Case("energy lost by a swing, theta 0.5", "rotor", partial(energy_drift, "rotor"), 0.0, 0.01),
    ]
