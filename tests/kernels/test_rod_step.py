"""The step of "kirchhoff" strands: twist that is driven, kept and let go; loads."""

from typing import Any

import numpy as np
import pytest
from strand_scenes import BENDING, FREE, STILL, TWISTING, Points, drive, roots, settings, shape, turned

from pipeline import kernels

ROD: dict[str, Any] = {"torsion": "kirchhoff"}
CALM: dict[str, Any] = {"theta": 1.0, "drag": 20.0, "tolerance": 1e-10, **ROD}
every_model = pytest.mark.parametrize("torsion", ["kirchhoff", "rotor"])


@pytest.mark.parametrize(("turns", "rate"), [(2.0, 240), (10.0, 240), (10.0, 60)])
def test_a_straight_strand_rolls_with_its_root(turns: float, rate: int, straight: Points) -> None:
    """The root spins about its tangent: the strand stays on its line, and its directors go along."""
    rest, state = shape(straight[None]), kernels.at_rest(straight[None])
    step = settings(**{**FREE, **CALM}, dt=1 / rate)
    poses = drive(rate, lambda k: turned((1, 0, 0), 2 * np.pi * turns * k / rate))
    kernels.advance(state, rest, None, poses, step)
    aside = np.abs(state.points[0] - straight).max() / 0.25
    along = (state.directors * rest.directors).sum(-1).min()
    print(f"{turns} turns a second at 1/{rate} s: moved {aside:.1e} L, directors agree to {1 - along:.1e}")
    assert aside <= 1e-15
    assert along >= 0.99
    assert np.abs(state.twist).max() <= 0.05


@pytest.mark.parametrize("rate", [240, 60])
def test_a_curl_spun_at_its_root_keeps_no_twist(rate: int, curl: Points) -> None:
    """After ten turns in a second and a rest it hangs as one that was never spun."""
    axis = tuple(curl[1] - curl[0])
    ends = []
    for turns in (0, 10):
        rest, state = shape(curl[None]), kernels.at_rest(curl[None])
        step = settings(dt=1 / rate, **CALM)
        spin = 2 * np.pi * turns / rate
        spun = drive(rate, lambda k, spin=spin: turned(axis, spin * k))  # type: ignore[misc]
        kernels.advance(state, rest, None, spun, step)
        kernels.advance(state, rest, None, drive(10 * rate), step)
        ends.append((state.points[0], kernels.energies(state, rest, step)[0]))
    (still, energy), (spun_points, after) = ends
    print(
        f"1/{rate} s: tip off by {np.abs(spun_points - still).max():.1e} m, elastic energies {energy[:2]}, {after[:2]}"
    )
    assert spun_points == pytest.approx(still, abs=1e-6)
    assert after[:2] == pytest.approx(energy[:2], rel=1e-4)


def test_a_hand_winds_up_a_strand(straight: Points) -> None:
    """A hand that holds two points turns their director too: 5 half turns of twist, evenly, C phi^2 / (2 L) of energy."""
    held = roots(1, 32)
    held[0, -2:] = 2
    rest, state = shape(straight[None], held), kernels.at_rest(straight[None])
    phi = 5 * np.pi
    step = settings(**{**FREE, **CALM}, dt=1 / 240)

    def hand(k: int) -> Points:
        return turned((1, 0, 0), phi * min(k, 480) / 480)

    kernels.advance(state, rest, None, drive(960, hand=hand), step)
    between = 30 * rest.length.mean()  # from the middle of the first segment to that of the last
    energy = kernels.energies(state, rest, step)[0, 1]
    print(
        f"twist {state.twist.sum() / phi:.12f} of the hand's, energy {energy / (TWISTING * phi**2 / (2 * between)):.9f}"
    )
    assert state.twist[0] == pytest.approx(phi / 30, rel=1e-6)
    assert energy == pytest.approx(TWISTING * phi**2 / (2 * between), rel=1e-6)
    assert np.abs(state.points[0] - straight).max() <= 1e-12


def test_a_wound_up_strand_unwinds_when_its_tip_is_let_go(straight: Points) -> None:
    held = roots(1, 32)
    held[0, -2:] = 2
    rest, state = shape(straight[None], held), kernels.at_rest(straight[None])
    step = settings(**{**FREE, **CALM}, dt=1 / 240)
    kernels.advance(state, rest, None, drive(240, hand=lambda k: turned((1, 0, 0), 10 * k / 240)), step)
    wound = kernels.energies(state, rest, step)[0, 1]
    kernels.advance(state, shape(straight[None]), None, drive(240), step)
    left = kernels.energies(state, rest, step)[0, 1]
    print(f"energy of twist {wound:.2e} J, a second after letting go {left:.2e} J")
    assert left <= 1e-6 * wound


@every_model
def test_a_load_of_the_weight_is_gravity(torsion: str, curl: Points) -> None:
    g = np.array([0, -9.81, 0])
    ends = []
    for loaded in (False, True):
        rest, state = shape(curl[None]), kernels.at_rest(curl[None])
        rest.load = rest.mass[..., None] * g * loaded
        step = settings(torsion=torsion, gravity=(0, 0, 0) if loaded else tuple(g))
        kernels.advance(state, rest, None, drive(48), step)
        ends.append((state.points, kernels.energies(state, rest, step)))
    assert ends[1][0] == pytest.approx(ends[0][0], abs=1e-12)
    assert ends[1][1] == pytest.approx(ends[0][1], rel=1e-9)


def test_a_load_at_the_tip_bends_as_bisshopp_and_drucker_say(straight: Points) -> None:
    """P L^2 / B = 1: tip drop 0.301721 L (Bisshopp and Drucker 1945); the clamp is the middle of segment 0."""
    points = straight * 0.1 / 0.25
    length = 0.1 * 30.5 / 31
    rest, state = shape(points[None]), kernels.at_rest(points[None])
    rest.load[0, -1] = (0, -BENDING / length**2, 0)
    kernels.advance(state, rest, None, drive(3000), settings(**{**FREE, **CALM}, dt=1 / 240))
    drop = -state.points[0, -1, 1] / length
    print(f"tip drop {drop:.6f} L, elastica 0.301721 L")
    assert drop == pytest.approx(0.301721, rel=2e-3)


@every_model
def test_a_free_curl_keeps_its_angular_momentum(torsion: str, curl: Points) -> None:
    """Quasi-static twist carries no momentum and, balanced, exerts no net torque."""
    rest = shape(curl[None], held=np.zeros((1, 32), np.uint8))
    state = kernels.at_rest(curl[None])
    state.velocity[...] = np.cross([3.0, 1.0, -2.0], curl)

    def momentum() -> Points:
        return np.asarray((rest.mass[0][:, None] * np.cross(state.points[0], state.velocity[0])).sum(0))

    before = momentum()
    step = settings(**FREE, theta=0.5, dt=1 / 1920, torsion=torsion, tolerance=1e-9)
    kernels.advance(state, rest, None, drive(384), step)
    error = np.linalg.norm(momentum() - before) / np.linalg.norm(before)
    print(f"{torsion}: angular momentum changes by {error:.1e} in 0.2 s")
    assert error <= 3e-4


@pytest.mark.parametrize("precision", [np.float32, np.float64])
@pytest.mark.parametrize("ratio", [0.1, 1.0, 10.0])
def test_wildly_bent_and_elliptic_strands_come_back(precision: type, ratio: float, curl: Points) -> None:
    """Random joints of up to 179 degrees, released: finite, lengths kept, back at the energy of rest."""
    rng = np.random.default_rng(5)
    rest = shape(np.repeat(curl[None], 16, axis=0))
    rest.bending_2 = ratio * rest.bending
    bend = np.radians(np.where(rng.random((16, 30)) < 0.3, 179, rng.uniform(0, 179, (16, 30))))
    axes = rng.normal(size=(16, 30, 3))
    tangents = np.empty((16, 31, 3))
    tangents[:, 0] = (curl[1] - curl[0]) / np.linalg.norm(curl[1] - curl[0])
    for j in range(30):
        axis = np.cross(tangents[:, j], axes[:, j])
        axis /= np.linalg.norm(axis, axis=1, keepdims=True)
        tangents[:, j + 1] = np.cos(bend[:, j, None]) * tangents[:, j] + np.sin(bend[:, j, None]) * np.cross(
            axis, tangents[:, j]
        )
    steps = rest.length[..., None] * tangents
    points = np.concatenate([np.zeros((16, 1, 3)), np.cumsum(steps, axis=1)], axis=1)
    points[:, :2] = rest.points[:, :2]
    state = kernels.at_rest(points.astype(precision))
    step = settings(**{**STILL, "drag": 5.0}, theta=1.0, dt=1 / 240, **ROD, gravity=(0, 0, 0))
    kernels.advance(state, rest, None, drive(240 * 8), step)
    energy = kernels.energies(state, rest, step)[:, :2].sum(1)
    unit = BENDING / rest.length.mean()
    print(f"B2/B1 = {ratio}: elastic energy at most {energy.max() / unit:.1e} B/l")
    assert np.isfinite(state.points).all()
    assert (energy <= 1e-3 * unit).mean() >= 0.9


@pytest.mark.parametrize("precision", [np.float32, np.float64])
def test_a_strand_without_stiffness_is_a_rope(precision: type, curl: Points) -> None:
    """Nothing holds its directors; it hangs straight down all the same."""
    rest = shape(curl[None], bending=0.0, twisting=0.0)
    state = kernels.at_rest(curl[None].astype(precision))
    kernels.advance(state, rest, None, drive(960), settings(**{**CALM, "tolerance": 1e-4}))
    reach = curl[1, 1] - state.points[0, -1, 1]
    assert np.isfinite(state.directors).all()
    assert reach == pytest.approx(rest.length[0, 1:].sum(), rel=1e-3)
