"""Motion: vibrating and swinging strands, the energy of what nothing damps, and a root that spins."""

import numpy as np

from pipeline import kernels
from pipeline.validation.case import CURLY, Law, Model, Outcome, Reading
from pipeline.validation.rod import (
    BENDING,
    GRAVITY,
    HEAD,
    MASS_PER_LENGTH,
    TWISTING,
    Array,
    Rod,
    clamped,
    first_crossing,
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


def vibration(mode: int, model: Model = "none", steps: int = 400, points: int = 64) -> tuple[float, Array]:
    """Omega = 2 pi f L^2 sqrt(rho A / B) of a small vibration without gravity, and the height of the tip over time.

    The curve (2, T) has time [periods] and height over the first height; a period takes so many steps.
    """
    length = 0.1
    scale = length**2 * np.sqrt(MASS_PER_LENGTH / BENDING)
    expected = 2 * np.pi * scale / OMEGA[mode]
    line = straight(length, points)
    k = WAVENUMBERS[mode]
    s = k * np.maximum(line[0, :, 0], 0) / length
    sigma = (np.cosh(k) + np.cos(k)) / (np.sinh(k) + np.sin(k))
    shape = np.cosh(s) - np.cos(s) - sigma * (np.sinh(s) - np.sin(s))
    bent = line.copy()
    bent[0, 2:, 1] = 1e-3 * length * shape[2:] / shape[-1]
    rod = Rod(line, clamped(points), undamped(model, dt=expected / steps), start=bent)
    trace = rod.trace(9 * steps // 2, -1, 1)
    omega = 2 * np.pi * scale / period(trace, rod.settings.dt)
    return float(omega), np.stack([np.arange(len(trace)) / steps, trace / trace[0]])


def vibrations(model: Model, quick: bool) -> Outcome:
    """The first two modes."""
    found = {mode: vibration(mode, model, 200 if quick else 400) for mode in OMEGA}
    readings = [Reading(f"Omega_{m}", omega, OMEGA[m], 5e-3) for m, (omega, _) in found.items()]
    return Outcome(tuple(readings), {f"mode {mode}": curve for mode, (_, curve) in found.items()})


def pendulum(degrees: float, model: Model = "none", points: int = 16) -> float:
    """Period over 2 pi sqrt(L/g) of a bob on a light strand without stiffness, let go at an angle.

    Four times the first quarter, at T/200: carrying the tension over a step damps a swing by O(dt), which
    later quarters would show.
    """
    length = 0.2
    small = 2 * np.pi * np.sqrt(length / GRAVITY)
    angle = np.radians(degrees)
    arc = np.linspace(0, length, points)[:, None]
    settings = undamped(model, dt=small / 200)
    settings.gravity = (0.0, -GRAVITY, 0.0)
    line = arc * np.array([np.sin(angle), -np.cos(angle), 0])
    rod = Rod(line[None], [HEAD] + [0] * (points - 1), settings, bending=0.0, twisting=0.0)
    masses = np.full(points, 1e-10)
    masses[-1] = 1e-5
    rod.rest.mass = masses[None]
    return float(4 * first_crossing(rod.trace(80, -1, 0)) * settings.dt / small)


def pendulums(model: Model, _quick: bool) -> Outcome:
    """Small and large swings."""
    return Outcome(
        tuple(Reading(f"{d} degrees, T/T0", pendulum(d, model), ratio, 1e-3) for d, ratio in PENDULUM.items())
    )


def swing(model: Model, theta: float, dt: float, seconds: float = 2.0) -> Array:
    """Energies of an undamped strand over time, (6, T): time [s], bending, torsion, kinetic, gravity, their sum.

    The strand of 10 cm is clamped 30 degrees off the direction of gravity and let go. The sum starts at 0; all are
    over the largest kinetic energy.
    """
    settings = undamped(model, dt, theta)
    settings.gravity = (GRAVITY * float(np.cos(np.pi / 6)), -GRAVITY / 2, 0.0)
    rod = Rod(straight(0.1, 32), clamped(32), settings)
    energies = [kernels.energies(rod.state, rod.rest, settings)[0]]
    steps = max(1, round(0.02 / dt))
    for _ in range(round(seconds / (steps * dt))):
        rod.advance(steps)
        energies.append(kernels.energies(rod.state, rod.rest, settings)[0])
    each = np.array(energies).T
    each[3] -= each[3, 0]
    times = np.arange(each.shape[1]) * steps * dt
    return np.concatenate([times[None], np.vstack([each, each.sum(axis=0)]) / each[2].max()])


def energy(model: Model, quick: bool) -> Outcome:
    """Energy gained at most and lost in the end, over the largest kinetic energy."""
    readings, curves = [], {}
    for theta, dt, tolerance in ((0.5, 0.25e-3, 0.01), (0.6, 1 / 240, 1e-6), (1.0, 1 / 240, 1e-6)):
        curve = swing(model, theta, dt, 2.0 if quick else 5.0)
        title = f"theta {theta}, dt {1e3 * dt:.3g} ms"
        readings.append(Reading(f"{title}, gain", float(max(curve[5].max(), 0)), 0.0, max(tolerance, 1e-6)))
        curves[title] = curve
        if theta == 0.5:
            after = curve[0] <= 2.0
            readings.append(Reading(f"{title}, loss in 2 s", float(-curve[5][after][-1]), 0.0, tolerance))
    return Outcome(tuple(readings), curves)


def spin(model: Model, quick: bool, points: int = 32) -> Outcome:
    """A root that turns about its own direction ten times in a second and stops: what a strand keeps of it.

    A straight strand only rolls; a curl turns with its root and is in its rest shape 3 s after the stop.
    """
    length, turns = 0.1, 2.0 if quick else 10.0
    strands = np.concatenate([straight(length, points), helix(0.006, 0.02, length, points)])
    strands[1] -= (strands[1, 0] + strands[1, 1]) / 2
    axis = strands[1, 1] - strands[1, 0]
    strands[1] = strands[1] @ _turn_to_x(axis / np.linalg.norm(axis)).T
    settings = undamped(model, 1 / 240, 0.6)
    settings.damping, settings.drag = 3e-3, 3.3
    rod = Rod(
        strands, clamped(points), settings, twisting=(TWISTING if model == "kirchhoff" else 0.0, TWISTING)
    )
    angles = np.concatenate([2 * np.pi * turns * np.arange(241) / 240, np.full(720, 2 * np.pi * turns)])
    head = np.tile(np.eye(4), (len(angles), 1, 1))
    head[:, 1, 1] = head[:, 2, 2] = np.cos(angles)
    head[:, 2, 1], head[:, 1, 2] = np.sin(angles), -np.sin(angles)
    rod.advance(240, head=head[:241])
    lateral = float(np.abs(rod.state.points[0, :, 1:]).max() / length)
    rod.advance(720, head=head[240:])
    returned = float(np.abs(rod.state.points[1] - strands[1]).max() / length)
    readings = [Reading("straight, lateral/L while it spins", lateral, 0.0, 1e-9)]
    readings += [Reading("curl, off its rest shape/L after 3 s", returned, 0.0, 1e-3)]
    if model == "kirchhoff":
        readings += [Reading("twist left [rad]", float(np.abs(rod.state.twist).max()), 0.0, 1e-2)]
    return Outcome(tuple(readings))


def _turn_to_x(direction: Array) -> Array:
    """The smallest rotation (3, 3) that brings a unit vector to x."""
    x, y, z = direction
    return np.array(
        [[x, y, z], [-y, 1 - y * y / (1 + x), -y * z / (1 + x)], [-z, -y * z / (1 + x), 1 - z * z / (1 + x)]]
    )


def laws() -> list[Law]:
    """The laws of this file."""
    return [
        Law(
            "vibration",
            "A clamped strand without gravity is let go in the shape of a mode, with an amplitude of 1e-3 L; "
            "Omega = 2 pi f L^2 sqrt(rho A/B). Reference: the clamped-free beam of Euler & Bernoulli.",
            vibrations,
        ),
        Law(
            "pendulum",
            "A bob on a strand without weight and stiffness, dt = T/200. Reference: T/T0 = 2/pi K(sin(amplitude/2)).",
            pendulums,
        ),
        Law(
            "energy of an undamped swing",
            "A strand clamped 60 degrees off the vertical is let go. With theta = 0.5 energy is bounded and does not "
            "drift, with theta > 0.5 it never grows. Figures are over the largest kinetic energy.",
            energy,
        ),
        Law(
            "root spin",
            "The root turns about its own direction for a second, twice (quick) or ten times, and stops. A straight "
            "strand only rolls, a curl is back in its rest shape 3 s later, and no twist is left.",
            spin,
            CURLY,
        ),
    ]
