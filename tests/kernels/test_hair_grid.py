"""Hair-hair contact by the density grid: it conserves momentum, leaves the groom alone, and makes a bundle wider."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from named_strands import helix
from numpy.typing import NDArray
from strand_scenes import (
    bundle,
    copy,
    curly_head,
    drive,
    same,
    settings,
    shake,
    shape,
    sphere,
    turned,
    width,
)

from pipeline import kernels

Points = NDArray[np.float64]
Head = tuple[kernels.RestShape, kernels.State]


def grid(rest: kernels.RestShape, hold: int = 1, **values: float) -> kernels.HairGrid:
    """The grid with the parameters of the table that `test_a_bundle_keeps_its_width` compares with."""
    chosen = {"cell": 8e-3, "density": 0.15, "pressure": 0.05, "drag": 3.0, "limit": 50.0} | values
    return kernels.HairGrid(rest, **chosen, hold=hold)


def stirred(count: int, precision: type) -> Head:
    """A head of curls drawn together to half the distance from the axis, with random velocities."""
    rest, state = curly_head(count, precision)
    state.points[..., [0, 2]] *= 0.5
    state.velocity[...] = np.random.default_rng(0).normal(size=state.velocity.shape)
    return rest, state


@pytest.mark.parametrize(("precision", "rounding"), [(np.float64, 1e-15), (np.float32, 1e-7)])
def test_blending_velocities_conserves_momentum(precision: type, rounding: float) -> None:
    rest, state = stirred(70, precision)
    blending = grid(rest, density=0.01, pressure=0.0)
    a = kernels.neighbour_acceleration(state, rest, blending, turned((1, 2, 3), 0.7), settings())
    force = rest.mass[..., None] * a
    net = np.abs(force.sum((0, 1))).max() / np.abs(force).sum()
    print(f"{precision.__name__}: net force {net:.1e} of the sum of all, up to {np.abs(a).max():.1f} m/s^2")
    assert np.abs(a).max() > 1
    assert net <= rounding


def energy(points: Points, rest: kernels.RestShape, density: float, cell: float, pressure: float) -> float:
    """sum h^3 k_p max(0, rho - L)^2 / (2 L) over the nodes, written anew with numpy."""
    low = np.floor(np.minimum(points, rest.points).min((0, 1)) / cell).astype(int)
    high = np.floor(np.maximum(points, rest.points).max((0, 1)) / cell).astype(int) + 2

    def densities(at: Points) -> Points:
        rho = np.zeros(high - low)
        place = at.reshape(-1, 3) / cell - low
        first, mass = np.floor(place).astype(int), rest.mass.ravel() / cell**3
        for corner in np.ndindex(2, 2, 2):
            weight = np.abs(1 - np.array(corner) - (place - first)).prod(-1)
            np.add.at(rho, tuple((first + corner).T), weight * mass)
        return rho

    allowed = np.maximum(densities(rest.points), density)
    over = np.maximum(densities(points) - allowed, 0)
    return float((pressure * over**2 / (2 * allowed)).sum() * cell**3)


def test_the_push_is_the_gradient_of_an_energy_and_nearly_keeps_momentum() -> None:
    rest, state = stirred(70, np.float64)
    values = {"density": 0.01, "cell": 8e-3, "pressure": 0.05}
    a = kernels.neighbour_acceleration(
        state, rest, grid(rest, drag=0.0, limit=1e9, **values), np.eye(4), settings()
    )
    errors = []
    for s, i, axis in [(3, 10, 0), (20, 20, 1), (51, 5, 2), (69, 31, 0), (33, 16, 2)]:
        sides = []
        for step in (1e-7, -1e-7):
            moved = state.points.copy()
            moved[s, i, axis] += step
            sides.append(energy(moved, rest, **values))
        expected = -(sides[0] - sides[1]) / 2e-7 / rest.mass[s, i]
        errors.append(abs(a[s, i, axis] - expected) / np.abs(a).max())
    force = rest.mass[..., None] * a
    net = np.abs(force.sum((0, 1))).max() / np.abs(force).sum()
    print(f"force against gradient: {max(errors):.1e} of the largest; net force {net:.1e} of the sum of all")
    assert np.abs(a).max() > 10
    assert max(errors) < 1e-5
    assert net < 0.03


def test_hair_is_pushed_from_where_it_is_dense_to_where_it_is_not(straight: Points) -> None:
    """A sheet of strands side by side parts in its middle plane, and only there."""
    points = np.repeat(straight[None], 40, axis=0)
    points[:, :, 1] += np.linspace(-0.02, 0.02, 40)[:, None] + 1e-4
    rest = shape(points * [1, 3, 1])
    state = kernels.at_rest(points)
    a = kernels.neighbour_acceleration(state, rest, grid(rest, drag=0.0, density=0.02), np.eye(4), settings())
    upper, lower = a[points[:, 16, 1] > 0.01, 16, 1], a[points[:, 16, 1] < -0.01, 16, 1]
    print(f"pushed up {upper.mean():.2f}, down {lower.mean():.2f} m/s^2")
    assert upper.mean() > 0.5
    assert lower.mean() == pytest.approx(-upper.mean(), rel=0.2)
    assert np.abs(a[:, 4:-4, 0]).max() < 0.05 * np.abs(a).max()


def test_velocities_blend_at_the_rate_of_the_drag(straight: Points) -> None:
    """Two strands at one place, of which one moves: each takes on the mean velocity."""
    points = np.repeat(straight[None], 2, axis=0)
    state = kernels.at_rest(points)
    state.velocity[0] = [0.0, 0.0, 1.0]
    rest = shape(points)
    a = kernels.neighbour_acceleration(state, rest, grid(rest, drag=3.0), np.eye(4), settings())
    assert a[0, :, 2] == pytest.approx(-1.5, rel=1e-9)
    assert a[1, :, 2] == pytest.approx(1.5, rel=1e-9)


@pytest.mark.parametrize("pose", [np.eye(4), turned((1, 2, 3), 0.8)])
def test_the_groomed_pose_is_not_pushed(pose: Points) -> None:
    """Whatever its density: at the head's pose the pressure of the groom vanishes."""
    rest, _ = curly_head(200)
    state = kernels.at_rest(np.ascontiguousarray(rest.points @ pose[:3, :3].T))
    dense = kernels.neighbour_acceleration(state, rest, grid(rest, density=1e-3), pose, settings())
    state.points[..., :] *= 0.8
    denser = kernels.neighbour_acceleration(state, rest, grid(rest, density=1e-3), pose, settings())
    print(f"push at the groom {np.abs(dense).max():.1e} m/s^2, 20 % smaller {np.abs(denser).max():.1f}")
    assert np.abs(dense).max() < 1e-9
    assert np.abs(denser).max() > 1


def test_the_groom_is_not_inflated() -> None:
    """Without gravity the groom stays as it is, however dense it is."""
    rest, state = curly_head(70, np.float64)
    step = settings(gravity=(0, 0, 0))
    kernels.advance(state, rest, sphere(), drive(240), step, grid(rest, density=1e-3))
    alone = kernels.at_rest(rest.points)
    kernels.advance(alone, rest, sphere(), drive(240), step)
    moved = np.abs(state.points - alone.points).max()
    print(f"the groom moved by {moved * 1e3:.1e} mm in 1 s")
    assert moved < 1e-6


def test_the_push_has_a_limit() -> None:
    rest, state = stirred(70, np.float64)
    pushes = [
        np.abs(
            kernels.neighbour_acceleration(
                state, rest, grid(rest, drag=0.0, density=1e-4, limit=limit), np.eye(4), settings()
            )
        ).max()
        for limit in (5.0, 50.0, 1e9)
    ]
    print("largest push with limits 5, 50, none:", pushes)
    assert pushes[0] <= 5 * 3**0.5
    assert pushes[0] < pushes[1] <= 50 * 3**0.5
    assert pushes[1] < pushes[2]


@pytest.mark.parametrize("hair", ["curly, hanging", "straight, from the side"])
def test_a_bundle_keeps_its_width(hair: str) -> None:
    """37 guides from roots 7 mm apart come to rest, and wider than without neighbours.

    However often they are looked at: a push that is late by a step, instead of in time, keeps them at 18 mm/s.
    """
    strand = helix(0.008, 0.02, 0.25, 32) if "curly" in hair else np.linspace([0.0, 0, 0], [0.25, 0, 0], 32)
    head = np.eye(4) if "hanging" in hair else turned((0, 0, 1), np.pi / 2)
    found = {}
    for name, hold in (("none", 0), ("grid", 1), ("held", 4)):
        rest, _ = bundle(strand)
        state = kernels.at_rest(np.ascontiguousarray(rest.points @ head[:3, :3].T))
        neighbours = grid(rest, hold) if hold else None
        kernels.advance(state, rest, None, drive(960, lambda _: head), settings(), neighbours)
        found[name] = width(state)
        speed = np.sqrt((state.velocity**2).sum(-1).mean())
        print(f"{hair}, {name}: width {found[name] * 1e3:.1f} mm, rms speed {speed * 1e3:.2f} mm/s")
        assert speed < 1e-3
    assert found["grid"] > found["none"] + 6e-3
    assert found["held"] > found["none"] + 6e-3


def test_looking_less_often_errs_less_than_the_steps_do() -> None:
    """Curls that fall and are shaken: looks while pressure crosses a quarter of a cell, against steps half as long."""
    ends = []
    for hold, finer in ((1, 1), (4, 1), (1, 2)):
        rest, state = curly_head(200, np.float64)
        wide = grid(rest, hold, cell=16e-3, density=0.02)
        kernels.advance(state, rest, sphere(), drive(120), settings(), grid(rest, cell=16e-3, density=0.02))
        dt = 1 / 240 / finer
        kernels.advance(state, rest, sphere(), drive(48 * finer, shake(dt)), settings(dt=dt), wide)
        ends.append(state.points)
    held, step = (np.sqrt(((end - ends[0]) ** 2).sum(-1).mean()) for end in ends[1:])
    print(f"held for four steps: {held * 1e3:.2f} mm rms; steps half as long: {step * 1e3:.2f} mm rms")
    assert 0 < held < 0.8 * step


@pytest.mark.parametrize("precision", [np.float32, np.float64])
def test_result_does_not_depend_on_the_number_of_threads(precision: type) -> None:
    results = []
    for threads in (1, 2, 3):
        kernels.set_threads(threads)
        rest, state = curly_head(200, precision)
        kernels.advance(
            state, rest, sphere(), drive(48, shake(1 / 240)), settings(), grid(rest, density=0.02)
        )
        results.append(state)
    assert same(results[0], results[1])
    assert same(results[0], results[2])


@pytest.mark.parametrize("hold", [1, 5])
def test_one_long_call_equals_many_short_ones(hold: int) -> None:
    """Each beginning where one looks."""
    rest, whole = curly_head(37)
    parts, neighbours = copy(whole), grid(rest, hold, density=0.02)
    kernels.advance(whole, rest, sphere(), drive(40, shake(1 / 240)), settings(), neighbours)
    for first in range(0, 40, 5):
        resumed = copy(parts)
        kernels.advance(
            resumed,
            rest,
            sphere(),
            drive(5, shake(1 / 240, first)),
            settings(),
            grid(rest, hold, density=0.02),
        )
        kernels.advance(parts, rest, sphere(), drive(5, shake(1 / 240, first)), settings(), neighbours)
        assert same(resumed, parts)
    assert same(whole, parts)


def test_strands_without_neighbours_move_as_alone() -> None:
    """Nothing to push and nothing to blend with: equal to the steps of a block by itself, to rounding."""
    rest, state = curly_head(3, np.float64)
    alone = copy(state)
    kernels.advance(state, rest, sphere(), drive(60), settings(), grid(rest, drag=0.0, density=1e3))
    kernels.advance(alone, rest, sphere(), drive(60), settings())
    assert same(state, alone)


def test_held_points_follow_the_head_among_neighbours() -> None:
    rest, state = curly_head(70, np.float64)
    pose: Callable[[int], Points] = shake(1 / 240)
    kernels.advance(state, rest, sphere(), drive(30, pose), settings(), grid(rest, density=0.01))
    expected = rest.points[:, :2] @ pose(30)[:3, :3].T
    assert state.points[:, :2] == pytest.approx(expected, abs=1e-12)


def test_bad_numbers_do_not_reach_the_neighbours() -> None:
    rest, state = curly_head(40, np.float64)
    for name, place in (("points", (9, 12, 1)), ("velocity", (11, 3, 0))):
        getattr(state, name)[place] = np.nan
    report = kernels.advance(state, rest, sphere(), drive(24), settings(), grid(rest, density=0.01))
    others = np.setdiff1d(np.arange(40), [9, 11])
    assert report.bad_strand == 9
    assert np.isfinite(state.points[others]).all()


def test_bad_grids_are_refused(straight: Points) -> None:
    rest = shape(straight[None])
    bad: dict[str, Any]
    for bad in (
        {"cell": 0.0},
        {"density": -1.0},
        {"limit": 0.0},
        {"pressure": -1.0},
        {"drag": np.inf},
        {"hold": 0},
    ):
        with pytest.raises(ValueError, match="HairGrid"):
            grid(rest, **bad)
    with pytest.raises(ValueError, match="too small"):
        grid(rest, cell=1e-5)
    with pytest.raises(ValueError, match="another rest shape"):
        kernels.advance(
            kernels.at_rest(straight[None]),
            rest,
            None,
            drive(1),
            settings(),
            grid(shape(np.repeat(straight[None], 2, 0))),
        )
