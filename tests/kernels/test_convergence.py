"""What steps of different length have in common: one motion in the limit, and rest after a blow."""

from typing import Any

import numpy as np
import pytest
from named_strands import helix
from strand_scenes import Points, drive, hairy_sphere, settings, shape, turned

from pipeline import kernels

every_model = pytest.mark.parametrize("torsion", ["kirchhoff", "rotor"])


def swing(strand: Points, rate: int, torsion: str, **values: Any) -> Points:
    """Points after 0.2 s of fall and turn, with the default damping and drag."""
    rest, state = shape(strand[None]), kernels.at_rest(strand[None])
    poses = drive(rate // 5, lambda k: turned((0, 1, 0), 0.5 * np.sin(4 * np.pi * k / rate) ** 2))
    kernels.advance(
        state, rest, None, poses, settings(dt=1 / rate, torsion=torsion, tolerance=1e-8, **values)
    )
    return np.asarray(state.points[0])


@every_model
@pytest.mark.parametrize("hair", ["wavy", "curly"])
def test_the_motion_converges_with_damping(hair: str, torsion: str) -> None:
    """Steps of half the length have half the error: internal damping does not reach the lengths, which 1/dt^2 stiffens."""
    strand = {"wavy": helix(0.02, 0.12, 0.25, 32), "curly": helix(0.008, 0.02, 0.25, 32)}[hair]
    exact = swing(strand, 30720, torsion)
    errors = [np.linalg.norm(swing(strand, rate, torsion) - exact, axis=1).max() for rate in (480, 960, 1920)]
    order = np.log2(errors[0] / errors[2]) / 2
    print(f"{hair}, {torsion}: errors {', '.join(f'{e * 1e3:.2f} mm' for e in errors)}, order {order:.2f}")
    assert order == pytest.approx(1.0, abs=0.25)
    assert errors[2] < 1.2e-3


@every_model
@pytest.mark.parametrize(("rate", "theta"), [(60, 0.6), (240, 0.6)])
def test_tight_curls_come_to_rest_in_long_steps(rate: int, theta: float, torsion: str) -> None:
    """Hanging coils are struck: a second later the default drag and damping have stopped them."""
    points = hairy_sphere(helix(0.0025, 0.006, 0.12, 64), 8)
    rest, state = shape(points), kernels.at_rest(points)
    calm = settings(dt=1 / 60, theta=1.0, torsion=torsion, drag=20.0)
    kernels.advance(state, rest, None, drive(300), calm)
    blow = 0.3 * np.random.default_rng(0).normal(size=(8, 1, 3))
    state.velocity[:, 2:] += np.linspace(0, 1, 62)[None, :, None] * blow
    step = settings(dt=1 / rate, theta=theta, torsion=torsion)
    kernels.advance(state, rest, None, drive(3 * rate), step)
    speed = np.abs(state.velocity).max()
    print(f"{torsion}, 1/{rate} s, theta {theta}: fastest point after 3 s {speed:.1e} m/s")
    assert speed <= 1e-3


@every_model
def test_internal_damping_does_not_brake_a_swinging_rope(torsion: str) -> None:
    """A loaded strand swings by its root: what resists the turn of a pulled segment is no material."""
    strand = np.linspace([0.0, 0, 0], [0.0, -0.2, 0], 24)
    speeds = []
    for damping in (0.0, 0.02):
        held = np.zeros((1, 24), np.uint8)
        held[0, 0] = 1
        rest, state = shape(strand[None], held), kernels.at_rest(strand[None])
        rest.load[0, -1] = (0.0, -100 * rest.mass.sum() * 9.81, 0.0)
        state.tension[...] = -rest.load[0, -1, 1]
        state.velocity[0, :, 0] = -strand[:, 1]
        step = settings(dt=1 / 1920, theta=0.5, torsion=torsion, damping=damping, drag=0.0, drag_speed=0.0)
        fastest = 0.0
        for _ in range(96):
            kernels.advance(state, rest, None, drive(4), step)
            fastest = max(fastest, float(-state.velocity[0, 12, 0]))  # on the way back
        speeds.append(fastest)
    print(f"{torsion}: fastest swing back with damping over without {speeds[1] / speeds[0]:.4f}")
    assert speeds[1] == pytest.approx(speeds[0], rel=0.02)


@every_model
@pytest.mark.parametrize("hair", ["wavy", "curly"])
def test_looking_ahead_is_worth_shorter_steps(hair: str, torsion: str) -> None:
    """Linearised where it is expected to be, a step of 1/240 s is nearer to the limit than one of 1/960 s."""
    strand = {"wavy": helix(0.02, 0.12, 0.25, 32), "curly": helix(0.008, 0.02, 0.25, 32)}[hair]
    ahead = {"look_ahead": 0.3, "theta": 0.55}
    exact = swing(strand, 15360, torsion, look_ahead=0.3, theta=0.5)
    errors = {}
    for name, values in {"from the start": {"theta": 0.55}, "ahead": ahead}.items():
        errors[name] = [
            np.linalg.norm(swing(strand, rate, torsion, **values) - exact, axis=1).max()
            for rate in (60, 240, 960)
        ]
        print(f"{hair}, {torsion}, {name}: " + ", ".join(f"{e * 1e3:.2f}" for e in errors[name]) + " mm")
    assert errors["ahead"][1] < 0.3 * errors["from the start"][1]
    assert errors["ahead"][1] < errors["from the start"][2]


@every_model
def test_looking_ahead_does_not_change_what_rests(torsion: str) -> None:
    strand = helix(0.008, 0.02, 0.25, 32)
    ends = []
    for look_ahead in (0.0, 0.3):
        rest, state = shape(strand[None]), kernels.at_rest(strand[None])
        step = settings(torsion=torsion, look_ahead=look_ahead, drag=20.0, damping=0.01, tolerance=1e-10)
        kernels.advance(state, rest, None, drive(16 * 240), step)
        ends.append(state.points[0])
    difference = np.abs(ends[1] - ends[0]).max()
    print(f"{torsion}: shapes at rest differ by {difference:.1e} m")
    assert difference <= 1e-9
