"""The test hair of all cases, and how it is stepped.

The protocol is that of Romero et al., "Physical validation of simulators in computer graphics" (SIGGRAPH 2021),
and its rerun for hair by Daviet (SIGGRAPH 2023): R = 50 um, rho = 1300 kg/m^3, E = 3 GPa, nu = 0.45.
Everything is float64. Holding points 0 and 1 clamps a strand at the middle of segment 0: lengths count from there.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pipeline import kernels
from pipeline.validation.case import Model

Array = NDArray[np.float64]

RADIUS, DENSITY, YOUNG, POISSON = 50e-6, 1300.0, 3e9, 0.45
GRAVITY = 9.81
MASS_PER_LENGTH = DENSITY * np.pi * RADIUS**2
WEIGHT = MASS_PER_LENGTH * GRAVITY
BENDING = YOUNG * np.pi * RADIUS**4 / 4
TWISTING = BENDING / (1 + POISSON)

HEAD, HAND = 1, 2


def gravito_length(gamma: float) -> float:
    """The length [m] of test hair with Gamma = w L^3 / B."""
    return float((gamma * BENDING / WEIGHT) ** (1 / 3))


def straight(length: float, points: int, direction: tuple[float, float, float] = (1, 0, 0)) -> Array:
    """A straight strand (1, P, 3) [m] whose clamp, the middle of segment 0, is at the origin."""
    spacing = length / (points - 1.5)
    arc = spacing * (np.arange(points) - 0.5)
    return np.asarray((arc[:, None] * np.array(direction))[None])


def helix(radius: float, pitch: float, length: float, points: int) -> Array:
    """A helix about x of equal chords, (1, P, 3) [m], from the origin."""
    rise = pitch / (2 * np.pi)
    angle = np.linspace(0, length, points) / np.hypot(radius, rise)
    curl = [rise * angle, radius * np.cos(angle) - radius, radius * np.sin(angle)]
    return np.stack(curl, axis=-1)[None]


def clamped(points: int, tip: int = 0) -> list[int]:
    """Holds of a strand: the first two points by the head, the last `tip` by the hand."""
    return [HEAD] * 2 + [0] * (points - 2 - tip) + [HAND] * tip


def leaning(strands: Array, axis: int, tip: float) -> Array:
    """Strands (S, P, 3) [m] pushed off along a coordinate axis by a parabola: the two first points not, the tip by `tip`."""
    aside = tip * np.linspace(0, 1, strands.shape[1]) ** 2
    aside[:2] = 0
    pushed = strands.copy()
    pushed[:, :, axis] += aside
    return pushed


def undamped(model: Model = "none", dt: float = 1 / 240, theta: float = 0.5) -> kernels.StepSettings:
    """Steps in vacuum without internal damping and without gravity."""
    settings = kernels.StepSettings()
    settings.torsion = model
    settings.dt, settings.theta = dt, theta
    settings.gravity = (0.0, 0.0, 0.0)
    settings.damping = settings.drag = settings.drag_speed = 0.0
    settings.friction = 0.0
    settings.tolerance = 1e-10
    return settings


def settling(model: Model = "none", dt: float = 4e-3, drag: float = 10.0) -> kernels.StepSettings:
    """Heavily damped steps under gravity: where they end does not depend on how."""
    settings = undamped(model, dt, theta=1.0)
    settings.gravity = (0.0, -GRAVITY, 0.0)
    settings.drag = drag
    return settings


class Rod:
    """Strands of test hair, stepped as they are."""

    def __init__(
        self,
        points: Array,
        holds: list[int],
        settings: kernels.StepSettings,
        *,
        bending: ArrayLike = BENDING,
        twisting: ArrayLike = TWISTING,
        start: Array | None = None,
        surface: kernels.DistanceField | None = None,
    ) -> None:
        """Strands of rest shape `points` (S, P, 3) [m] that stand at `start`, which has the same root segments."""
        self.points, self.settings, self.surface = np.ascontiguousarray(points), settings, surface
        count = len(points)
        self.rest = kernels.rest_shape(
            self.points,
            np.full(count, MASS_PER_LENGTH),
            np.array(np.broadcast_to(bending, count), float),
            np.array(np.broadcast_to(twisting, count), float),
            np.tile(np.array(holds, np.uint8), (count, 1)),
            np.zeros(points.shape[:2]),
        )
        self.state = kernels.at_rest(self.points if start is None else np.ascontiguousarray(start))

    def advance(self, steps: int, hand: Array | None = None, head: Array | None = None) -> kernels.Report:
        """Take steps; `head` and `hand` (steps + 1, 4, 4) move what they hold, else the head stands still."""
        heads = np.tile(np.eye(4), (steps + 1, 1, 1)) if head is None else head
        drive = kernels.Drive(heads, np.zeros((steps, 3)), hand)
        return kernels.advance(self.state, self.rest, self.surface, drive, self.settings)

    def to_rest(self, limit: float = 60.0, still: float = 1e-9) -> Array:
        """Step until nothing moves faster than `still` [m/s], for `limit` [s] of simulated time at most; the points."""
        chunk = 50
        for _ in range(int(limit / (chunk * self.settings.dt)) + 1):
            self.advance(chunk)
            if np.abs(self.state.velocity).max() < still:
                break
        return np.asarray(self.state.points)

    def trace(self, steps: int, point: int, axis: int) -> Array:
        """One coordinate of one point of the first strand after every step, (steps + 1,) [m]."""
        values = [float(self.state.points[0, point, axis])]
        for _ in range(steps):
            self.advance(1)
            values.append(float(self.state.points[0, point, axis]))
        return np.array(values)

    def energy(self) -> float:
        """Total energy [J] of all strands."""
        return float(kernels.energies(self.state, self.rest, self.settings).sum())


def first_crossing(trace: Array) -> float:
    """Steps until a positive signal crosses 0, by linear interpolation; nan when it never does."""
    below = np.flatnonzero(trace < 0)
    if len(below) == 0:
        return float("nan")
    before = int(below[0]) - 1
    return float(before + trace[before] / (trace[before] - trace[before + 1]))


def period(trace: Array, dt: float) -> float:
    """Mean period [s] of an oscillation about 0, from the first to the last upward crossing; nan without two."""
    before = np.flatnonzero((trace[:-1] < 0) & (trace[1:] >= 0))
    if len(before) < 2:
        return float("nan")
    crossing = before + trace[before] / (trace[before] - trace[before + 1])
    return float((crossing[-1] - crossing[0]) / (len(crossing) - 1) * dt)
