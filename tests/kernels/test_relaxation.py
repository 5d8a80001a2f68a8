"""Length relaxation: both methods reach the tolerance and move no momentum."""

import numpy as np
import pytest
from numpy.typing import NDArray
from strand_scenes import roots, shape

from pipeline import kernels

Points = NDArray[np.float64]
both_methods = pytest.mark.parametrize("method", ["newton", "sweep"])


def strain(points: Points, rest: kernels.RestShape) -> float:
    """Worst relative length error."""
    return float(np.abs(np.linalg.norm(np.diff(points, axis=1), axis=2) / rest.length - 1).max())


@both_methods
def test_relaxation_reaches_the_tolerance(
    method: str, curl: Points, kinked: Points, straight: Points
) -> None:
    rest = shape(np.stack([curl, straight, curl]))
    stretched = np.stack([kinked, straight * 1.02, curl * 0.99])
    stretched[:, :2] = rest.points[:, :2]  # held
    relaxed, iterations = kernels.relax(stretched, rest, method, 1e-4)
    print(
        f"{method}: strain {strain(stretched, rest):.1e} -> {strain(relaxed, rest):.1e}, {iterations} iterations"
    )
    assert strain(stretched, rest) > 0.01
    assert strain(relaxed, rest) <= 1.01e-4


def test_newton_needs_a_handful_of_iterations_where_the_sweep_needs_hundreds(straight: Points) -> None:
    rest, stretched = shape(straight[None]), 1.02 * straight[None]
    iterations = {m: kernels.relax(stretched, rest, m, 1e-4)[1] for m in ("newton", "sweep")}
    print(f"iterations: {iterations}")
    assert iterations["newton"] <= 4
    assert iterations["sweep"] > 100


@both_methods
def test_relaxation_conserves_the_momentum_of_a_free_strand(
    method: str, curl: Points, kinked: Points
) -> None:
    """Its corrections are along the edges and weighted by mass: centre of mass and angular momentum stay."""
    free = np.zeros((1, 32), np.uint8)
    rest = shape(curl[None], held=free)
    moved = rest.mass[0][:, None] * (kernels.relax(kinked[None], rest, method, 1e-6)[0][0] - kinked)
    shift = float(np.abs(moved.sum(0)).max() / np.abs(moved).sum())
    print(f"{method}: net shift of the mass {shift:.1e}")
    assert shift <= 1e-12


def test_one_newton_step_conserves_angular_momentum(curl: Points, kinked: Points) -> None:
    rest = shape(curl[None], held=np.zeros((1, 32), np.uint8))
    almost = curl + 1e-4 * (kinked - curl)
    relaxed, iterations = kernels.relax(almost[None], rest, "newton", 1e-5)
    assert iterations == 1
    torque = np.cross(almost, rest.mass[0][:, None] * (relaxed[0] - almost))
    assert np.abs(torque.sum(0)).max() <= 1e-10 * np.abs(torque).sum()


@both_methods
@pytest.mark.parametrize("count", [0, 1, 2, 5])
def test_held_points_stay(method: str, count: int, curl: Points, kinked: Points) -> None:
    held = roots(1, 32, count)
    held[0, 20] = held[0, 31] = 1
    rest = shape(curl[None], held=held)
    points = curl + 0.1 * (kinked - curl)
    points[held[0] > 0] = curl[held[0] > 0]
    relaxed = kernels.relax(points[None], rest, method, 1e-4)[0]
    assert (relaxed[0][held[0] > 0] == curl[held[0] > 0]).all()
    assert strain(relaxed, rest) <= 1.01e-4


def test_both_methods_find_nearly_the_same_points(curl: Points, kinked: Points) -> None:
    rest = shape(curl[None])
    points = curl + 0.02 * (kinked - curl)
    newton, sweep = (kernels.relax(points[None], rest, method, 1e-9)[0] for method in ("newton", "sweep"))
    moved = np.abs(newton - points).max()
    print(f"methods differ by {np.abs(newton - sweep).max() / moved:.1e} of the correction")
    assert np.abs(newton - sweep).max() < 0.05 * moved
