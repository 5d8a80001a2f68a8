"""Head contact: nothing below its offset, lengths kept, Coulomb's law, and equilibria that do not depend on dt."""

from typing import Any

import numpy as np
import pytest
from named_strands import helix
from numpy.typing import NDArray
from strand_scenes import (
    STILL,
    Report,
    copy,
    drive,
    field,
    ground,
    hairy_sphere,
    settings,
    shake,
    shape,
    sphere,
)

from pipeline import kernels

Points = NDArray[np.float64]
HAIR = {
    "straight": np.linspace([0.0, 0, 0], [0.25, 0, 0], 32),
    "wavy": helix(0.005, 0.06, 0.25, 32),
    "curly": helix(0.008, 0.02, 0.25, 32),
}
every_hair = pytest.mark.parametrize("kind", HAIR)


def run_shake(kind: str, dt: float, precision: type, **values: Any) -> tuple[kernels.State, list[Report]]:
    """16 strands on a shaken sphere: a second of shake, half a second after."""
    points = hairy_sphere(HAIR[kind], 16)
    rest, state, head = shape(points), kernels.at_rest(points.astype(precision)), sphere()
    step, chunk = settings(dt=dt, **values), round(1 / 24 / dt)
    reports = [
        kernels.advance(state, rest, head, drive(chunk, shake(dt, first)), step)
        for first in range(0, round(1.5 / dt), chunk)
    ]
    return state, reports


@every_hair
@pytest.mark.parametrize("precision", [np.float32, np.float64])
def test_shaken_hair_never_enters_the_head_and_keeps_its_length(kind: str, precision: type) -> None:
    state, reports = run_shake(kind, 1 / 240, precision)
    depth, strain = max(r.depth for r in reports), max(r.strain for r in reports)
    print(f"{kind} {precision.__name__}: depth {depth * 1e3:.4f} mm, strain {strain:.1e}")
    assert sum(r.contacts for r in reports) > 0
    assert depth <= 1e-4
    assert strain <= 1.001e-4
    assert all(r.bad_strand == -1 for r in reports)
    # and by a look at the points themselves
    below = 1e-3 + 0.09 - np.linalg.norm(state.points[:, 2:].astype(float), axis=2).min()
    lengths = np.linalg.norm(np.diff(state.points.astype(float), axis=1), axis=2)
    assert below <= 1e-4
    assert np.abs(lengths / lengths[:, :1] - 1).max() <= 3e-4


@pytest.mark.parametrize("dt", [1 / 120, 1 / 48])
def test_undamped_hair_survives_long_steps_by_halving_them(dt: float) -> None:
    _, reports = run_shake("wavy", dt, np.float64, **STILL, damping=0.0)
    halvings = sum(r.halvings for r in reports)
    print(f"dt 1/{1 / dt:.0f}: {halvings} halvings, strain {max(r.strain for r in reports):.1e}")
    assert max(r.strain for r in reports) <= 1.001e-4
    assert max(r.depth for r in reports) <= 1e-4
    assert all(r.bad_strand == -1 for r in reports)
    if dt > 1 / 100:
        assert halvings > 0


@pytest.mark.parametrize("torsion", ["frenet", "none"])
def test_other_torsion_models_survive_the_shake(torsion: str) -> None:
    """The lecture's torsion, regularised, is stable for curls at 1/240 s."""
    _, reports = run_shake("curly", 1 / 240, np.float32, torsion=torsion)
    assert max(r.strain for r in reports) <= 1.001e-4
    assert max(r.depth for r in reports) <= 1e-4
    assert all(r.bad_strand == -1 for r in reports)


def test_a_strand_that_cannot_leave_the_head_is_given_up_cheaply_and_alone() -> None:
    """Roots 2 cm deep with segments of 8 mm: no step converges, and halving all the way would cost 127 attempts."""
    points = hairy_sphere(HAIR["wavy"], 12)
    stuck = points.copy()
    stuck[5] -= 0.02 * stuck[5, 0] / np.linalg.norm(stuck[5, 0])
    states = []
    for groom in (points, stuck):
        state = kernels.at_rest(groom)
        report = kernels.advance(state, shape(groom), sphere(), drive(12, shake(1 / 240)), settings())
        states.append(state)
    print(f"{report.halvings / 12:.1f} halvings a step, depth {report.depth * 1e3:.1f} mm")
    others = np.arange(12) != 5
    assert report.depth > 5e-4
    assert report.halvings <= 7 * 12
    assert np.isfinite(states[1].points).all()
    assert (states[0].points[others] == states[1].points[others]).all()


def slide(slope: float, friction: float, seconds: float, precision: type = np.float64) -> tuple[float, float]:
    """Way and speed of a free straight strand on a slope, lying along it."""
    points = np.zeros((1, 16, 3))
    points[0, :, 0] = np.linspace(-0.1, 0.02, 16)
    points[0, :, 1] = 1e-3
    rest = shape(points, held=np.zeros((1, 16), np.uint8))
    gravity = (9.81 * np.sin(slope), -9.81 * np.cos(slope), 0.0)
    step = settings(friction=friction, gravity=gravity, **STILL)
    state = kernels.at_rest(points.astype(precision))
    kernels.advance(state, rest, ground(), drive(round(seconds * 240)), step)
    return float((state.points - points)[0, :, 0].mean()), float(state.velocity[0, :, 0].mean())


@pytest.mark.parametrize("precision", [np.float32, np.float64])
def test_friction_sticks_while_the_slope_is_below_mu(precision: type) -> None:
    for part in (0.5, 0.9, 0.98):
        way, speed = slide(float(np.arctan(0.3 * part)), 0.3, 1.0, precision)
        print(f"tan/mu {part}: slid {way * 1e3:.1e} mm in 1 s, speed {speed:.1e} m/s")
        assert abs(way) <= 1e-9
    way, _ = slide(float(np.arctan(0.3 * 1.02)), 0.3, 0.25, precision)
    assert way > 1e-3


@pytest.mark.parametrize("friction", [0.1, 0.3])
def test_a_sliding_strand_accelerates_as_coulomb_says(friction: float) -> None:
    """a = g (sin - mu cos): a/g = 0.413397 (mu 0.1) and 0.240192 (mu 0.3) at 30 degrees."""
    slope, seconds = np.pi / 6, 0.1
    a = slide(slope, friction, seconds)[1] / seconds / 9.81
    expected = np.sin(slope) - friction * np.cos(slope)
    print(f"mu {friction}: a/g {a:.6f}, Coulomb {expected:.6f}")
    assert a == pytest.approx(expected, rel=0.01)


def rest_on_sphere(dt: float) -> Points:
    """A frictionless straight strand, draped over a sphere, at rest."""
    points = hairy_sphere(HAIR["straight"], 8)
    rest, state = shape(points), kernels.at_rest(points)
    kernels.advance(
        state, rest, sphere(), drive(round(8 / dt)), settings(dt=dt, friction=0.0, damping=0.02, drag=10.0)
    )
    assert np.abs(state.velocity).max() < 3e-5  # contacts come and go by a tenth of a micron a step
    return state.points


def test_a_strand_at_rest_on_the_head_does_not_depend_on_dt() -> None:
    fine, coarse = rest_on_sphere(1 / 480), rest_on_sphere(1 / 120)
    difference = np.median(np.abs(fine - coarse).max((1, 2)))
    print(f"rest on the head, dt 1/480 against 1/120: median difference {difference * 1e3:.1e} mm")
    assert difference <= 1e-5  # a row gives way by N dt^2 / (1e3 m): microns at 1/120 s


def test_contact_keeps_each_point_at_its_own_offset() -> None:
    """A straight strand on the ground: points with 1 mm offset lie lower than those with 3 mm."""
    points = np.zeros((1, 16, 3))
    points[0, :, 0] = np.linspace(-0.1, 0.02, 16)
    points[0, :, 1] = 4e-3
    rest = shape(points, held=np.zeros((1, 16), np.uint8), bending=1e-12, twisting=0.0)
    rest.offset[0, 8:] = 3e-3
    state = kernels.at_rest(points)
    kernels.advance(state, rest, ground(), drive(480), settings())
    assert state.points[0, 1, 1] == pytest.approx(1e-3, abs=1e-5)
    assert state.points[0, 14, 1] == pytest.approx(3e-3, abs=1e-5)
    assert state.contact[0, 1] == 1


def test_stuck_hair_turns_with_the_head() -> None:
    """A strand pressed on a slowly turning ground goes along without slipping."""
    points = np.zeros((1, 16, 3))
    points[0, :, 0] = np.linspace(0.0, 0.05, 16)
    points[0, :, 1] = 1e-3
    rest = shape(points, held=np.zeros((1, 16), np.uint8))
    state, rate, steps = kernels.at_rest(points), 0.5, 120

    def pose(k: int) -> Points:
        angle = rate * k / 240
        return np.array(
            [
                [np.cos(angle), 0, np.sin(angle), 0],
                [0, 1, 0, 0],
                [-np.sin(angle), 0, np.cos(angle), 0],
                [0, 0, 0, 1],
            ]
        )

    kernels.advance(state, rest, ground(), drive(steps, pose), settings(**STILL, friction=1.0))
    expected = points[0] @ pose(steps)[:3, :3].T
    slipped = np.abs(state.points[0] - expected).max()
    print(f"slipped {slipped * 1e3:.1e} mm on {np.abs(expected - points[0]).max() * 1e3:.1f} mm")
    assert slipped < 2e-4


def test_distance_is_trilinear_inside_and_clamped_outside() -> None:
    head = field(lambda x: x @ np.array([0.6, 0.0, 0.8]) - 0.01)
    points = np.random.default_rng(0).uniform(-0.12, 0.12, (37, 3))
    values, normals = kernels.distance(head, points)
    assert values == pytest.approx(points @ [0.6, 0, 0.8] - 0.01, abs=1e-7)
    assert normals == pytest.approx(np.tile([0.6, 0, 0.8], (37, 1)), abs=1e-4)
    outside, _ = kernels.distance(head, np.array([[5.0, 0, 0], [np.nan, 0, 0]]))
    assert outside[0] == pytest.approx(0.6 * 0.128 - 0.01, abs=1e-4)
    assert np.isfinite(outside[1])


def test_distance_field_refuses_bad_grids() -> None:
    with pytest.raises(ValueError, match="2 nodes"):
        kernels.DistanceField(np.zeros((1, 4, 4), np.float32), np.zeros(3), 0.01)
    with pytest.raises(ValueError, match="spacing"):
        kernels.DistanceField(np.zeros((4, 4, 4), np.float32), np.zeros(3), 0.0)
    with pytest.raises(ValueError, match="finite"):
        kernels.DistanceField(np.full((4, 4, 4), np.nan, np.float32), np.zeros(3), 0.01)


@pytest.mark.parametrize("torsion", ["none", "frenet", "kirchhoff"])
@pytest.mark.parametrize(("precision", "tolerance"), [(np.float64, 1e-15), (np.float32, 1e-9)])
def test_contacts_that_pull_leave_the_step_as_if_they_had_never_been(
    torsion: str, precision: type, tolerance: float
) -> None:
    """Waves of 0.2 to 2 mm that lie on the ground on their crests; then all points near it are told to have touched."""
    x = np.linspace(0, 0.25, 32)
    points = np.zeros((11, 32, 3))
    points[:, :, 0] = x
    points[:, :, 1] = 1.01e-3 + 1e-4 * np.arange(1, 12)[:, None] * (1 - np.cos(2 * np.pi * x / 0.04))
    rest, start, step = shape(points), kernels.at_rest(points.astype(precision)), settings(torsion=torsion)
    kernels.advance(start, rest, ground(), drive(40), step)
    start.contact[:] = start.points[:, :, 1] - rest.offset < 3e-5
    tried, without = copy(start), copy(start)
    report = kernels.advance(tried, rest, ground(), drive(1), step)
    without.contact[:] = start.contact * (tried.contact == 1)
    kernels.advance(without, rest, ground(), drive(1), step)
    kept, apart = (without.contact == 1).sum(), np.abs(tried.points - without.points).max()
    print(f"{start.contact.sum()} contacts tried, {kept} press; {apart:.1e} m apart")
    assert report.solves == 1
    assert 0 < kept < start.contact.sum()
    assert apart < tolerance
