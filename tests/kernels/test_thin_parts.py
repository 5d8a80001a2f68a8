"""Thin parts: no point passes through what is thinner than its way in a step, and none is stopped that goes round."""

from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from strand_scenes import FREE, drive, field, settings, shape, sphere, turned

from pipeline import kernels

Points = NDArray[np.float64]
THICKNESS, OFFSET = 4e-3, 1e-3


@cache
def plate() -> kernels.DistanceField:
    """4 mm thick across x, on cells of 3 mm."""

    def distance(x: Points) -> Points:
        beyond = np.abs(x) - [THICKNESS / 2, 0.07, 0.07]
        outside = np.linalg.norm(np.maximum(beyond, 0), axis=1)
        return np.asarray(outside + np.minimum(beyond.max(axis=1), 0))

    return field(distance, half=0.09, spacing=0.003)


def free_strands(x: float, precision: type) -> tuple[kernels.RestShape, kernels.State]:
    """Four straight strands of 8 cm beside the plate, held by nobody."""
    points = np.zeros((4, 16, 3))
    points[..., 0] = x + 0.004 * np.arange(4)[:, None]
    points[..., 1] = np.linspace(-0.04, 0.04, 16)
    points[..., 2] = np.linspace(-0.02, 0.02, 4)[:, None]
    return shape(points, held=np.zeros((4, 16), np.uint8), offset=OFFSET), kernels.at_rest(
        points.astype(precision)
    )


@pytest.mark.parametrize("precision", [np.float32, np.float64])
@pytest.mark.parametrize("dt", [1 / 24, 1 / 60, 1 / 120, 1 / 240])
def test_no_strand_is_thrown_through_a_thin_plate(dt: float, precision: type) -> None:
    lowest = {}
    for speed in (2.0, 6.0, 20.0):
        rest, state = free_strands(0.03, precision)
        state.velocity[..., 0] = -speed
        lowest[speed] = np.inf
        for _ in range(round(0.15 / dt)):
            kernels.advance(state, rest, plate(), drive(1), settings(dt=dt, **FREE))
            lowest[speed] = min(lowest[speed], float(state.points[..., 0].min()))
    ways = ", ".join(f"{v * dt * 1e3:.0f} mm: {x * 1e3:.2f} mm" for v, x in lowest.items())
    print(f"lowest x by way in a step, dt 1/{1 / dt:.0f}: {ways}")
    assert min(lowest.values()) > THICKNESS / 2 + OFFSET - 1e-4


@pytest.mark.parametrize("dt", [1 / 24, 1 / 240])
def test_a_thin_plate_that_is_moved_takes_strands_along(dt: float) -> None:
    rest, state = free_strands(0.02, np.float64)
    speed, steps = 6.0, round(0.1 / dt)

    def pose(k: int) -> Points:
        moved = np.eye(4)
        moved[0, 3] = speed * k * dt
        return moved

    kernels.advance(state, rest, plate(), drive(steps, pose), settings(dt=dt, **FREE))
    gap = float(state.points[..., 0].min()) - pose(steps)[0, 3] - THICKNESS / 2
    print(f"plate moves {speed * dt * 1e3:.0f} mm a step; gap to the nearest point {gap * 1e3:.2f} mm")
    assert gap > OFFSET - 1e-4


def around(radius: float) -> tuple[kernels.RestShape, kernels.State]:
    """Strands that stand still beside a sphere, along its axis."""
    angle = np.linspace(0, 2 * np.pi, 8, endpoint=False)
    points = np.zeros((8, 16, 3))
    points[..., 0], points[..., 2] = radius * np.cos(angle)[:, None], radius * np.sin(angle)[:, None]
    points[..., 1] = np.linspace(-0.005, 0.005, 16)
    return shape(points, held=np.zeros((8, 16), np.uint8), offset=OFFSET), kernels.at_rest(points)


@pytest.mark.parametrize("degrees", [10.0, 45.0])
def test_hair_beside_a_head_that_turns_goes_round_it_and_not_through(degrees: float) -> None:
    """The straight line from place to place, seen from the head, would cut 7 mm deep at 45 degrees."""
    rest, state = around(0.0925)
    before = state.points.copy()
    report = kernels.advance(
        state,
        rest,
        sphere(),
        drive(4, lambda k: turned((0, 1, 0), np.radians(degrees * k))),
        settings(**FREE),
    )
    chord = 0.0925 * (1 - np.cos(np.radians(degrees) / 2))
    print(f"{degrees:.0f} degrees a step, chord {chord * 1e3:.1f} mm deep: {report.contacts:.0f} contacts")
    assert report.contacts == 0
    assert np.abs(state.points - before).max() == 0


def run(count: int) -> tuple[kernels.State, kernels.Report]:
    """The first strands of a throw at the plate, some of them far and slow."""
    points = np.ascontiguousarray(free_strands(0.03, np.float64)[1].points[:count])
    points[1:2, :, 0] += 0.03
    alone = kernels.at_rest(points)
    alone.velocity[..., 0] = -np.array([9.0, 3.0, 1.0, 0.5])[:count, None]
    held: Any = np.zeros((count, 16), np.uint8)
    report = kernels.advance(alone, shape(points, held=held), plate(), drive(20), settings(dt=1 / 60, **FREE))
    return alone, report


def test_strands_that_are_followed_do_not_disturb_those_beside_them() -> None:
    together, _ = run(4)
    for count in (1, 2, 3):
        alone, _ = run(count)
        assert alone.points.tobytes() == together.points[:count].tobytes()
