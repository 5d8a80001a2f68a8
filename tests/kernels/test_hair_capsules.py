"""Hair-hair contact by capsules: opposite forces, Coulomb's law, nothing passes through, and hair comes to rest."""

from typing import Any

import numpy as np
import pytest
from named_strands import helix
from numpy.typing import NDArray
from strand_scenes import (
    STILL,
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
RADIUS, STIFFNESS, FRICTION, SPEED = 1.5e-3, 0.005, 0.3, 0.2
FROM_THE_SIDE = turned((0, 0, 1), np.pi / 2)


def capsules(rest: kernels.RestShape, **values: float) -> kernels.HairCapsules:
    """Capsules with the defaults of the config."""
    chosen = {"radius": RADIUS, "stiffness": STIFFNESS, "friction": FRICTION, "speed": SPEED} | values
    return kernels.HairCapsules(rest, **chosen)


def forces(state: kernels.State, rest: kernels.RestShape, **values: float) -> Points:
    """(S, P, 3) [N] on the points, of capsules that are where the points are."""
    still = settings(dt=1e-9)
    a = kernels.neighbour_acceleration(state, rest, capsules(rest, **values), np.eye(4), still)
    return np.asarray(a * rest.mass[..., None])


def cross(distance: float, count: int = 16) -> tuple[kernels.RestShape, kernels.State]:
    """Two free strands at right angles, groomed far apart, at a distance: the second one lies above the first."""
    ends = [([-0.1, 0, 0], [0.1, 0, 0]), ([0, 0.05, -0.1], [0, 0.05, 0.1])]
    points = np.array([np.linspace(*end, count) for end in ends], float)
    rest = shape(points, held=np.zeros((2, count), np.uint8))
    points[1, :, 1] = distance
    return rest, kernels.at_rest(points)


def test_two_rods_push_each_other_apart_by_their_depth() -> None:
    for distance, depth in ((0.5e-3, 2.5e-3), (2.5e-3, 0.5e-3), (3.1e-3, 0.0)):
        rest, state = cross(distance)
        found = forces(state, rest).sum(1)
        expected = STIFFNESS * depth
        print(f"{distance * 1e3} mm apart: {found[1, 1]:.4e} N, expected {expected:.4e}")
        assert found[1] == pytest.approx([0, expected, 0], rel=1e-5, abs=1e-12)
        assert found[0] == pytest.approx(-found[1], abs=1e-12)


def test_rods_rub_as_coulomb_says_and_are_damped() -> None:
    rest, state = cross(2e-3)
    state.velocity[1] = [1.0, 0.0, 0.0]
    found = forces(state, rest).sum(1)[1]
    assert found == pytest.approx([-FRICTION * STIFFNESS * 1e-3, STIFFNESS * 1e-3, 0], rel=1e-5, abs=1e-12)
    state.velocity[1] = [0.0, -0.1, 0.0]
    damping = 0.5 * np.sqrt(STIFFNESS * rest.mass.mean())
    assert forces(state, rest).sum(1)[1, 1] == pytest.approx(STIFFNESS * 1e-3 + damping * 0.1, rel=1e-5)


def test_rods_part_no_faster_than_their_speed() -> None:
    """What is 2.9 mm deep in another comes out at the speed; the step's theta of 0.6 overshoots it once."""
    rest, state = cross(0.1e-3)
    fastest = 0.0
    for _ in range(24):
        kernels.advance(
            state, rest, None, drive(1), settings(**STILL, gravity=(0, 0, 0)), capsules(rest, speed=0.05)
        )
        middle = state.velocity[1, 7:9, 1].mean() - state.velocity[0, 7:9, 1].mean()
        fastest = max(fastest, middle)
    apart = state.points[1, 7:9, 1].mean() - state.points[0, 7:9, 1].mean()
    print(f"fastest {fastest:.4f} m/s, {apart * 1e3:.2f} mm apart after 0.1 s")
    assert 0.02 < fastest <= 0.05 / 0.6 + 1e-4
    assert apart > 1.5e-3


@pytest.mark.parametrize("precision", [np.float32, np.float64])
def test_forces_of_many_contacts_cancel(precision: type) -> None:
    rest, state = bundle(np.linspace([0.0, 0, 0], [0.25, 0, 0], 32), precision)
    state.points[..., [0, 2]] *= 0.3
    state.velocity[...] = np.random.default_rng(0).normal(size=state.velocity.shape) * 0.1
    found = forces(state, rest)
    net = np.abs(found.sum((0, 1))).max() / np.abs(found).sum()
    touching = (np.abs(found).sum(-1) > 0).mean()
    print(f"{precision.__name__}: net force {net:.1e} of the sum of all, {touching:.0%} of the points touch")
    assert touching > 0.5
    assert net < 1e-8


def test_the_push_is_the_gradient_of_an_energy() -> None:
    """E = sum k (D - d)^2 / 2 over pairs of segments, by dense sampling: frictionless contacts feed nothing in."""
    rng = np.random.default_rng(2)
    points = rng.normal(scale=0.002, size=(4, 8, 3)) + np.linspace([0.0, 0, 0], [0.04, 0, 0], 8)
    spread = points + np.array([0, 0.05, 0]) * np.arange(4)[:, None, None]
    rest, state = shape(spread, held=np.zeros((4, 8), np.uint8)), kernels.at_rest(points)
    found = forces(state, rest, friction=0.0)

    def energy(x: Points) -> float:
        s = np.linspace(0, 1, 401)
        total = 0.0
        for a in range(4):
            for b in range(a):
                for i in range(7):
                    p = x[a, i] + s[:, None] * (x[a, i + 1] - x[a, i])
                    for j in range(7):
                        e = x[b, j + 1] - x[b, j]
                        t = np.clip((p - x[b, j]) @ e / (e @ e), 0, 1)
                        d = np.linalg.norm(p - x[b, j] - t[:, None] * e, axis=1).min()
                        total += STIFFNESS * max(0.0, 2 * RADIUS - d) ** 2 / 2
        return total

    scale = np.abs(found).max()
    for strand, i, axis in ((0, 3, 1), (2, 5, 2), (3, 1, 0)):
        sides = []
        for step in (2e-6, -2e-6):
            x = points.copy()
            x[strand, i, axis] += step
            sides.append(energy(x))
        expected = -(sides[0] - sides[1]) / 4e-6
        print(f"force {found[strand, i, axis]:.4e} N, gradient {expected:.4e} N")
        assert found[strand, i, axis] == pytest.approx(expected, abs=0.01 * scale)


def falling_on_a_wire(friction: float) -> tuple[Points, float]:
    """A short strand falls across a taut one, off its middle; its points after a second, and the wire's height."""
    wire = np.linspace([-0.1, 0, 0], [0.1, 0, 0], 16)
    fallen = np.linspace([0, 0.05, -0.02], [0, 0.05, 0.02], 16)
    held = np.zeros((2, 16), np.uint8)
    held[0] = 1
    rest = shape(np.array([wire, fallen]), held=held)
    points = np.array([wire, fallen])
    points[1, :, 1] = 4e-3
    state = kernels.at_rest(points)
    step = settings(drag=20.0)
    kernels.advance(
        state, rest, None, drive(240, lambda _: np.eye(4)), step, capsules(rest, friction=friction)
    )
    return state.points[1], float(np.linalg.norm(state.velocity[1], axis=1).max())


def test_a_strand_that_falls_on_another_does_not_pass_through_and_stays() -> None:
    """It balances on the wire: symmetric, and held by nothing but contact."""
    points, speed = falling_on_a_wire(FRICTION)
    middle = points[7:9, 1].mean()
    print(f"rests {middle * 1e3:.2f} mm above the wire, speed {speed * 1e3:.2f} mm/s")
    assert 1e-3 < middle < 3e-3
    assert speed < 5e-3


def slide_on_a_ramp(slope: float) -> float:
    """Way [m] that a short strand slides in 0.5 s down two inclined wires, which it lies across."""
    down = np.array([np.cos(slope), -np.sin(slope), 0])
    wires = [np.linspace(-0.1, 0.1, 16)[:, None] * down + [0, 0, z] for z in (-0.01, 0.01)]
    short = np.linspace([0, 0, -0.02], [0, 0, 0.02], 16)
    held = np.array([[1] * 16, [1] * 16, [0] * 16], np.uint8)
    rest = shape(np.array([*wires, short + np.array([0, 0.05, 0])]), held=held)
    above = 2.4e-3 * np.array([np.sin(slope), np.cos(slope), 0])
    state = kernels.at_rest(np.array([*wires, short + above]))
    still = drive(60)
    kernels.advance(state, rest, None, still, settings(drag=30.0), capsules(rest))
    before = state.points[2].mean(0) @ down
    kernels.advance(state, rest, None, drive(120), settings(), capsules(rest))
    return float(state.points[2].mean(0) @ down - before)


def test_crossing_strands_stick_below_the_friction_angle_and_slide_above() -> None:
    """Regularised below 5 mm/s: a stick creeps at tan(slope) / mu of that."""
    ways = {part: slide_on_a_ramp(float(np.arctan(FRICTION * part))) for part in (0.3, 2.5)}
    print("slid in 0.5 s:", {part: f"{way * 1e3:.2f} mm" for part, way in ways.items()})
    assert 0 <= ways[0.3] < 0.5 * 5e-3 * 0.5
    assert ways[2.5] > 0.02


@pytest.mark.parametrize("hair", ["straight", "curly"])
def test_a_bundle_from_the_side_is_wider_and_comes_to_rest(hair: str) -> None:
    strand = helix(0.008, 0.02, 0.25, 32) if hair == "curly" else np.linspace([0.0, 0, 0], [0.25, 0, 0], 32)
    found, step = {}, settings(drag=11.0, drag_speed=15.0)
    for name in ("none", "capsule"):
        rest, _ = bundle(strand)
        state = kernels.at_rest(np.ascontiguousarray(rest.points @ FROM_THE_SIDE[:3, :3].T))
        neighbours = capsules(rest, radius=2e-3) if name == "capsule" else None
        kernels.advance(state, rest, None, drive(1440, lambda _: FROM_THE_SIDE), step, neighbours)
        speed = np.sqrt((state.velocity**2).sum(-1).mean())
        found[name] = width(state)
        print(f"{hair}, {name}: width {found[name] * 1e3:.1f} mm, rms speed {speed * 1e3:.2f} mm/s")
        assert speed < 2e-3
    assert found["capsule"] > found["none"] + 1e-3


def test_what_is_groomed_together_stays() -> None:
    """Strands that run through each other at rest are not pushed; a neighbour that comes from afar is."""
    points = np.repeat(helix(0.008, 0.02, 0.25, 32)[None], 3, axis=0)
    points[1] += [0, 1e-3, 0]
    points[2] += [0, 0.03, 0]
    rest = shape(points)
    state = kernels.at_rest(points)
    assert np.abs(forces(state, rest)).max() == 0
    state.points[2] = points[0] + [0, 0, 1e-3]
    pushed = np.abs(forces(state, rest)).max((1, 2))
    assert pushed[0] > 1e-6
    assert pushed[2] > 1e-6
    kernels.advance(
        state := kernels.at_rest(points), rest, None, drive(48), settings(gravity=(0, 0, 0)), capsules(rest)
    )
    assert np.abs(state.points - points).max() < 1e-6


@pytest.mark.parametrize("precision", [np.float32, np.float64])
def test_result_depends_neither_on_threads_nor_on_the_split_of_the_steps(precision: type) -> None:
    rest, first = curly_head(200, precision)
    states = []
    for threads, chunk in ((1, 24), (2, 24), (3, 8)):
        kernels.set_threads(threads)
        state = copy(first)
        for begin in range(0, 24, chunk):
            kernels.advance(
                state, rest, sphere(), drive(chunk, shake(1 / 240, begin)), settings(), capsules(rest)
            )
        states.append(state)
    assert same(states[0], states[1])
    assert same(states[0], states[2])


def test_bad_numbers_do_not_reach_the_neighbours() -> None:
    rest, state = curly_head(40, np.float64)
    state.points[9, 12, 1] = np.nan
    report = kernels.advance(state, rest, sphere(), drive(24), settings(), capsules(rest))
    assert report.bad_strand == 9
    assert np.isfinite(state.points[np.arange(40) != 9]).all()


def test_bad_capsules_are_refused(straight: Points) -> None:
    bad: dict[str, Any]
    for bad in ({"radius": 0.0}, {"stiffness": -1.0}, {"friction": np.inf}, {"speed": 0.0}):
        with pytest.raises(ValueError, match="HairCapsules"):
            capsules(shape(straight[None]), **bad)
