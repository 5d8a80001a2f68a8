"""The step: what it conserves, what it may not depend on, and how it holds points."""

from typing import Any

import numpy as np
import pytest
from named_strands import helix
from numpy.typing import NDArray
from strand_scenes import (
    FREE,
    STILL,
    copy,
    curly_head,
    drive,
    roots,
    rotation,
    same,
    settings,
    shake,
    shape,
    sphere,
    turned,
)

from pipeline import kernels

Points = NDArray[np.float64]
every_model = pytest.mark.parametrize("torsion", ["kirchhoff", "rotor"])


@every_model
@pytest.mark.parametrize("precision", [np.float32, np.float64])
def test_result_does_not_depend_on_the_number_of_threads(precision: type, torsion: str) -> None:
    results = []
    for threads in (1, 2):
        kernels.set_threads(threads)
        rest, state = curly_head(70, precision)
        kernels.advance(state, rest, sphere(), drive(60, shake(1 / 240)), settings(torsion=torsion))
        results.append(state)
    assert same(*results)


@pytest.mark.parametrize(
    ("relaxation", "torsion", "look_ahead"),
    [
        ("newton", "rotor", 0.0),
        ("sweep", "rotor", 0.0),
        ("newton", "kirchhoff", 0.0),
        ("newton", "kirchhoff", 0.3),
    ],
)
def test_a_strand_moves_the_same_alone_and_among_others(
    relaxation: str, torsion: str, look_ahead: float
) -> None:
    """Long undamped steps, so that lanes converge in different rounds (for halving, see the strand given up alone)."""
    step = settings(
        dt=1 / 60, relaxation=relaxation, torsion=torsion, look_ahead=look_ahead, **STILL, damping=0.0
    )
    rest, state = curly_head(19)
    alone_points = np.ascontiguousarray(rest.points[7:8])
    alone_rest, alone = shape(alone_points), kernels.at_rest(alone_points.astype(np.float32))
    report = kernels.advance(state, rest, sphere(), drive(60, shake(1 / 60)), step)
    kernels.advance(alone, alone_rest, sphere(), drive(60, shake(1 / 60)), step)
    print(f"{relaxation}, {torsion}: {report.halvings} halvings, up to {report.rounds_max} rounds")
    assert report.rounds_max > 2
    for name in ("points", "directors", "twist"):
        assert getattr(alone, name).tobytes() == getattr(state, name)[7:8].tobytes()


@every_model
def test_saved_arrays_resume_bit_by_bit(torsion: str) -> None:
    step = settings(torsion=torsion)
    rest, through = curly_head(16)
    kernels.advance(through, rest, sphere(), drive(20, shake(1 / 240)), step)
    resumed = copy(through)
    for state in (through, resumed):
        kernels.advance(state, rest, sphere(), drive(20, shake(1 / 240, 20)), step)
    assert same(through, resumed)


@every_model
def test_one_long_call_equals_many_short_ones(torsion: str) -> None:
    step = settings(torsion=torsion)
    rest, whole = curly_head(16)
    parts = copy(whole)
    kernels.advance(whole, rest, sphere(), drive(40, shake(1 / 240)), step)
    for first in range(0, 40, 5):
        kernels.advance(parts, rest, sphere(), drive(5, shake(1 / 240, first)), step)
    assert same(whole, parts)


@every_model
def test_float32_agrees_with_float64(torsion: str) -> None:
    ends = {}
    for precision in (np.float32, np.float64):
        rest, state = curly_head(16, precision)
        kernels.advance(state, rest, sphere(), drive(120, shake(1 / 240)), settings(torsion=torsion))
        ends[precision] = state.points.astype(float)
    difference = np.median(np.abs(ends[np.float32] - ends[np.float64]).max((1, 2)))
    print(
        f"{torsion}: float32 against float64 after half a second of shake: median of the worst point {difference * 1e3:.1e} mm"
    )
    assert difference < 1e-4


@pytest.mark.parametrize("torsion", ["kirchhoff", "rotor", "frenet", "none"])
def test_a_free_strand_keeps_its_momentum_and_falls_with_gravity(torsion: str, curl: Points) -> None:
    rest = shape(curl[None], held=np.zeros((1, 32), np.uint8))
    state = kernels.at_rest(curl[None])
    state.velocity[...] = np.random.default_rng(0).normal(size=state.velocity.shape) * 0.3
    mass = rest.mass[0][:, None]
    before = (mass * state.velocity[0]).sum(0)
    kernels.advance(state, rest, None, drive(24), settings(**STILL, torsion=torsion))
    expected = before + mass.sum() * np.array([0, -9.81, 0]) * 24 / 240
    error = np.abs((mass * state.velocity[0]).sum(0) - expected).max() / np.abs(expected).max()
    print(f"{torsion}: momentum error {error:.1e}")
    assert error <= 1e-9


@pytest.mark.parametrize("torsion", ["kirchhoff", "rotor", "frenet"])
def test_a_helix_in_its_rest_shape_stays(torsion: str, curl: Points) -> None:
    state = kernels.at_rest(curl[None])
    kernels.advance(state, shape(curl[None]), None, drive(1200), settings(**FREE, torsion=torsion))
    drift = np.abs(state.points[0] - curl).max() / 0.25
    print(f"{torsion}: drift in 5 s without gravity {drift:.1e} L")
    assert drift <= 1e-6


@pytest.mark.parametrize("torsion", ["kirchhoff", "rotor", "frenet"])
def test_an_equilibrium_is_one_for_every_dt(torsion: str, curl: Points) -> None:
    """Because the tension is carried. (From rest, "frenet" may snap into another coil at another dt.)"""
    rest = shape(curl[None], roots(1, 32, 3))
    calm: dict[str, Any] = {"damping": 0.01, "drag": 20.0, "tolerance": 1e-10, "torsion": torsion}
    hanging = kernels.at_rest(curl[None])
    kernels.advance(hanging, rest, None, drive(16 * 240), settings(dt=1 / 240, **calm))
    assert np.abs(hanging.velocity).max() < 1e-6
    for rate in (1000, 60, 24):
        state = copy(hanging)
        kernels.advance(state, rest, None, drive(2 * rate), settings(dt=1 / rate, **calm))
        drift = np.abs(state.points - hanging.points).max() / 0.25
        print(f"{torsion}: equilibrium of dt 1/240 kept at 1/{rate} for 2 s to {drift:.1e} L")
        assert drift <= 1e-6


def test_a_strand_held_at_both_ends_hangs_as_a_catenary() -> None:
    """Sag over length at span/length = 0.9 is 0.190709 for a rope."""
    P, length = 64, 0.25
    bow = np.linspace(-1, 1, P)
    points = np.stack([0.9 * length / 2 * bow, -0.19 * length * (1 - bow**2), 0 * bow], -1)[None]
    held = np.zeros((1, P), np.uint8)
    held[0, [0, -1]] = 1
    rest, state = shape(points, held, bending=1e-16, twisting=0.0), kernels.at_rest(points)
    rest.length[...] = length / (P - 1)
    rest.mass[...] = rest.mass.mean()
    kernels.advance(
        state, rest, None, drive(4800), settings(drag=20.0, damping=0.0, torsion="none", tolerance=1e-10)
    )
    sag = -state.points[0, :, 1].min() / length
    print(f"catenary: sag {sag:.6f} L, rope 0.190709 L")
    assert sag == pytest.approx(0.190709, rel=1e-3)
    assert (state.points[0, [0, -1]] == points[0, [0, -1]]).all()


def test_points_held_by_the_hand_follow_it_and_the_others_follow_the_head(curl: Points) -> None:
    held = roots(1, 32)
    held[0, -2:] = 2
    rest, state = shape(curl[None], held), kernels.at_rest(curl[None])

    def hand(k: int) -> Points:
        pose = turned((1, 0, 0), 0.01 * k)
        pose[0, 3] = -1e-4 * k
        return pose

    def head(k: int) -> Points:
        return turned((0, 1, 0), 0.002 * k)

    report = kernels.advance(state, rest, None, drive(50, head, hand), settings())
    last = hand(50)
    assert state.points[0, -2:] == pytest.approx(curl[-2:] @ last[:3, :3].T + last[:3, 3], abs=1e-12)
    assert state.points[0, :2] == pytest.approx(curl[:2] @ head(50)[:3, :3].T, abs=1e-12)
    assert report.strain <= 1.001e-4


@every_model
@pytest.mark.parametrize("count", [0, 1, 2, 3])
def test_lanes_with_different_held_points_do_not_disturb_each_other(
    count: int, torsion: str, curl: Points
) -> None:
    """A strand held at `count` points moves the same beside strands that are held elsewhere."""
    points = np.repeat(curl[None], 5, axis=0)
    held = np.concatenate([roots(1, 32, n) for n in (count, 2, 0, 4, 1)])
    held[3, -1] = 1
    state = kernels.at_rest(points)
    kernels.advance(state, shape(points, held), None, drive(48), settings(torsion=torsion))
    alone = kernels.at_rest(points[:1])
    kernels.advance(alone, shape(points[:1], held[:1]), None, drive(48), settings(torsion=torsion))
    difference = np.abs(alone.points - state.points[:1]).max()
    print(f"{torsion}, {count} held points: difference {difference:.1e} m")
    assert difference <= 1e-12


@every_model
def test_internal_damping_does_not_drag_a_strand_that_turns_rigidly(torsion: str, curl: Points) -> None:
    """beta K is zero for a rigid rotation: with it a turning strand loses no speed of turning."""
    speeds = []
    for damping in (0.0, 3e-3):
        rest = shape(curl[None] - curl.mean(0), held=np.zeros((1, 32), np.uint8))
        state = kernels.at_rest(rest.points)
        state.velocity[...] = np.cross([0, 0, 0.5], rest.points)
        kernels.advance(
            state, rest, None, drive(120), settings(**{**FREE, "damping": damping}, torsion=torsion)
        )
        L = np.cross(state.points, rest.mass[..., None] * state.velocity).sum((0, 1))
        speeds.append(L[2])
    print(f"{torsion}: angular momentum kept with damping over without: {speeds[1] / speeds[0]:.6f}")
    assert speeds[1] == pytest.approx(speeds[0], rel=0.01)


def test_wind_carries_a_free_strand_and_air_stops_it(straight: Points) -> None:
    """Across the wind a free strand takes the speed of the air: its drag is relative."""
    rest = shape(straight[None], held=np.zeros((1, 32), np.uint8))
    state = kernels.at_rest(straight[None])
    wind = np.tile([0.0, 0.0, 2.0], (480, 1))
    still = np.tile(np.eye(4), (481, 1, 1))
    kernels.advance(state, rest, None, kernels.Drive(still, wind), settings(gravity=(0, 0, 0)))
    print(f"speed in a wind of 2 m/s after 2 s: {state.velocity[0, :, 2].mean():.4f} m/s")
    assert state.velocity[0, :, 2] == pytest.approx(2.0, rel=0.01)


def test_terminal_fall_of_an_isolated_fibre(straight: Points) -> None:
    """g = (11 + 15 u) u: about half a metre per second for a level fibre."""
    rest = shape(straight[None], held=np.zeros((1, 32), np.uint8))
    state = kernels.at_rest(straight[None])
    kernels.advance(state, rest, None, drive(480), settings(drag=11.0, drag_speed=15.0))
    expected = (-11 + np.sqrt(11**2 + 4 * 15 * 9.81)) / 30
    print(f"terminal fall {-state.velocity[0, :, 1].mean():.4f} m/s, balance of forces {expected:.4f}")
    assert -state.velocity[0, :, 1] == pytest.approx(expected, rel=0.005)


@every_model
def test_energy_of_an_undamped_strand_never_grows_at_theta_one(torsion: str, curl: Points) -> None:
    rest, state = shape(curl[None]), kernels.at_rest(curl[None])
    step = settings(**STILL, damping=0.0, theta=1.0, torsion=torsion)
    totals = [kernels.energies(state, rest, step).sum()]
    for _ in range(48):
        kernels.advance(state, rest, None, drive(5), step)
        totals.append(kernels.energies(state, rest, step).sum())
    growth = np.diff(totals).max() / (max(totals) - min(totals))
    print(f"{torsion}: largest growth of the energy in 5 steps: {growth:.1e} of its range")
    assert growth <= 1e-3


def test_energies_are_those_of_the_formulas(curl: Points, kinked: Points) -> None:
    rest, state = shape(curl[None]), kernels.at_rest(kinked[None])
    state.velocity[...] = 0.5
    bending, torsion, kinetic, gravity = kernels.energies(state, rest, settings())[0]
    assert bending == pytest.approx(kernels.bending(kinked[None], rest)[0][0], rel=1e-12)
    assert torsion == pytest.approx(
        kernels.torsion_rotor(kinked[None], rest, state.directors)[0][0], rel=1e-12
    )
    assert kinetic == pytest.approx(0.5 * rest.mass.sum() * 0.75, rel=1e-12)
    assert gravity == pytest.approx(9.81 * (rest.mass[0] * kinked[:, 1]).sum(), rel=1e-12)
    bending, twisting, _, _ = kernels.energies(state, rest, settings(torsion="kirchhoff"))[0]
    untwisted = kernels.kirchhoff(kinked[None], state.directors, rest)[0][0]
    assert twisting == pytest.approx(0, abs=1e-12 * bending)
    assert bending == pytest.approx(untwisted, rel=1e-12)


def test_implicit_step_converges_to_the_explicit_one(straight: Points) -> None:
    """Symplectic Euler at 20 us as reference: a straight strand falls from the horizontal for 0.1 s."""
    exact: dict[str, Any] = {**STILL, "damping": 0.0, "tolerance": 1e-10, "theta": 0.5}
    points, reference = straight[None], kernels.at_rest(straight[None])
    rest = shape(points)
    kernels.advance(reference, rest, None, drive(5000), settings(dt=2e-5, integrator="explicit", **exact))
    errors = []
    for dt in (1 / 240, 1 / 480, 1 / 960):
        state = kernels.at_rest(points)
        kernels.advance(state, rest, None, drive(round(0.1 / dt)), settings(dt=dt, **exact))
        errors.append(np.abs(state.points - reference.points).max())
    print("implicit against explicit:", " ".join(f"{e * 1e3:.3f} mm" for e in errors))
    assert errors[2] < errors[1] < errors[0] < 2e-3


@every_model
def test_rotated_scene_gives_the_rotated_motion(torsion: str, curl: Points) -> None:
    turn = rotation((1, 2, 3), 0.8)
    ends = []
    for R in (np.eye(3), turn):
        points = np.ascontiguousarray(curl[None] @ R.T)
        rest, state = shape(points), kernels.at_rest(points)
        step = settings(gravity=tuple(R @ [0, -9.81, 0]), torsion=torsion)
        kernels.advance(state, rest, None, drive(60), step)
        ends.append(state.points[0])
    error = np.abs(ends[1] - ends[0] @ turn.T).max()
    print(f"{torsion}: rotated scene: difference {error:.1e} m after 60 steps")
    assert error <= 1e-9


@every_model
def test_bad_numbers_are_reported_and_stay_in_their_strand(torsion: str) -> None:
    rest, state = curly_head(12, np.float64)
    clean = copy(state)
    state.points[9, 12, 1] = np.nan
    report = kernels.advance(state, rest, sphere(), drive(24), settings(torsion=torsion))
    kernels.advance(clean, rest, sphere(), drive(24), settings(torsion=torsion))
    assert report.bad_strand == 9
    assert (state.points[:9] == clean.points[:9]).all()


@pytest.mark.parametrize("points", [8, 256])
def test_shortest_and_longest_strands_step(points: int) -> None:
    strand = helix(0.008, 0.02, 0.25, points)[None]
    for torsion in ("kirchhoff", "rotor", "frenet"):
        state = kernels.at_rest(strand.astype(np.float32))
        report = kernels.advance(state, shape(strand), None, drive(24), settings(torsion=torsion))
        assert report.bad_strand == -1
        assert report.strain <= 2e-4


@pytest.mark.parametrize(
    ("name", "value"),
    [("dt", 0.0), ("theta", 0.4), ("tolerance", 0.0), ("friction", -1.0), ("drag", -1.0)],
)
def test_settings_outside_their_range_are_refused(name: str, value: float, curl: Points) -> None:
    state, rest = kernels.at_rest(curl[None]), shape(curl[None])
    with pytest.raises(ValueError, match=name):
        kernels.advance(state, rest, None, drive(1), settings(**{name: value}))


def test_states_that_do_not_fit_are_refused(curl: Points) -> None:
    state = kernels.at_rest(curl[None])
    with pytest.raises(ValueError, match="different numbers"):
        kernels.advance(state, shape(curl[None, :16].copy()), None, drive(1), settings())
    with pytest.raises(ValueError, match="one precision"):
        kernels.State(
            state.points,
            state.velocity.astype(np.float32),
            state.tension,
            state.contact,
            state.directors,
            state.twist,
        )
    with pytest.raises(ValueError, match="torsion"):
        settings(torsion="helix")
    with pytest.raises(ValueError, match="wind"):
        kernels.Drive(np.tile(np.eye(4), (3, 1, 1)), np.zeros((3, 3)))
