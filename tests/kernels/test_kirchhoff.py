"""The energy of "kirchhoff" strands: exact gradients, balance of forces and torques, and what it tells apart."""

import numpy as np
import pytest
import rod_twin
from hypothesis import given, settings
from hypothesis import strategies as st
from named_strands import helix
from rod_twin import Frame
from strand_scenes import BENDING, TWISTING, Points, rotation, shape

from pipeline import kernels


def random_rod(seed: int, points: int = 16, bend: float = 0.6, twist: float = 0.5) -> Frame:
    """Uneven segments, random bends, and directors that are off those without twist by random turns."""
    rng = np.random.default_rng(seed)
    directions = np.array([3.0, 0, 0]) + np.cumsum(rng.normal(size=(points - 1, 3)) * bend, axis=0)
    tangents = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    steps = tangents * rng.uniform(0.004, 0.009, (points - 1, 1))
    x = np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])
    m = kernels.untwisted_directors(x[None])[0]
    angle = rng.normal(size=(points - 1, 1)) * twist
    m = np.cos(angle) * m + np.sin(angle) * np.cross(tangents, m)
    return Frame(x, m, np.zeros(points - 2))


def rest_of(seed: int, ratio: float = 1.0, points: int = 16) -> kernels.RestShape:
    """A curled, twisted rest shape with B2 = ratio B1."""
    rest = shape(random_rod(seed, points).points[None])
    rest.bending_2 = ratio * rest.bending
    rest.strain[...] += np.random.default_rng(seed).normal(size=rest.strain.shape) * 0.2
    return rest


def measured(at: Frame, rest: kernels.RestShape) -> tuple[float, Points, Points]:
    """Energy, dE/dx and dE/dtheta of the kernel."""
    energy, force, turning = kernels.kirchhoff(at.points[None], at.directors[None], rest, at.twist[None])
    return float(energy[0]), -force[0], turning[0]


@pytest.mark.parametrize("ratio", [1.0, 0.5, 3.0])
def test_gradients_agree_with_complex_step(ratio: float) -> None:
    worst = 0.0
    for seed in range(12):
        at, rest = random_rod(seed, bend=(1e-6, 0.01, 0.6, 1.0)[seed % 4]), rest_of(seed + 100, ratio)
        energy, by_x, by_theta = measured(at, rest)
        expected_x, expected_theta = rod_twin.gradients(at, rest)
        expected = rod_twin.energy(at.points, np.zeros(15), at, rest).real
        assert energy == pytest.approx(expected, rel=1e-12)
        for got, wanted in ((by_x, expected_x), (by_theta, expected_theta)):
            worst = max(worst, float(np.abs(got - wanted).max() / np.abs(wanted).max()))
    print(f"B2/B1 = {ratio}: gradients against complex step {worst:.1e}")
    assert worst <= 1e-13


def test_forces_have_no_net_force_and_with_the_moments_of_the_directors_no_net_torque() -> None:
    """A rigid turn about an axis w moves x by w x x and turns director j about its tangent by w.t_j."""
    worst_force = worst_torque = 0.0
    for seed in range(50):
        at, rest = random_rod(seed), rest_of(seed + 100, 0.5)
        _, by_x, by_theta = measured(at, rest)
        t = np.diff(at.points, axis=0)
        t /= np.linalg.norm(t, axis=1, keepdims=True)
        moments = np.cross(at.points, by_x)
        torque = moments.sum(0) + (by_theta[:, None] * t).sum(0)
        worst_force = max(worst_force, float(np.abs(by_x.sum(0)).max() / np.abs(by_x).max()))
        worst_torque = max(worst_torque, float(np.abs(torque).max() / np.abs(moments).max()))
    print(f"net force {worst_force:.1e}, net torque {worst_torque:.1e}")
    assert max(worst_force, worst_torque) <= 1e-13


@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10_000), angle=st.floats(-3, 3), shift=st.floats(-1, 1))
def test_energy_is_invariant_under_rotation_and_translation(seed: int, angle: float, shift: float) -> None:
    at, rest = random_rod(seed), rest_of(seed + 1, 0.5)
    R = rotation(tuple(np.random.default_rng(seed).normal(size=3)), angle)
    moved = Frame(at.points @ R.T + shift, at.directors @ R.T, at.twist)
    assert measured(moved, rest)[0] == pytest.approx(measured(at, rest)[0], rel=1e-9)


@pytest.mark.parametrize("wind", [-3, -2, -1, 1, 2])
def test_whole_turns_of_twist_count(wind: int) -> None:
    """Twist is remembered: the same directors, reached by turning through whole turns, hold more energy."""
    at, rest = random_rod(3), rest_of(4)
    twisted = Frame(at.points, at.directors, np.full(14, 2 * np.pi * wind))
    energy, by_x, by_theta = measured(twisted, rest)
    expected_x, expected_theta = rod_twin.gradients(twisted, rest)
    assert energy == pytest.approx(rod_twin.energy(at.points, np.zeros(15), twisted, rest).real, rel=1e-12)
    assert energy > 2 * measured(at, rest)[0]
    assert by_x == pytest.approx(expected_x, abs=1e-12 * np.abs(expected_x).max())
    assert by_theta == pytest.approx(expected_theta, abs=1e-12 * np.abs(expected_theta).max())


def test_twist_of_an_isotropic_straight_rod_does_not_bend_it(straight: Points) -> None:
    """No bend-twist coupling: the bending energy of a bent, naturally straight rod does not see its twist."""
    rest = shape(straight[None])
    bent = helix(0.02, 0.03, 0.25, 32)
    t = np.diff(bent, axis=0) / np.linalg.norm(np.diff(bent, axis=0), axis=1, keepdims=True)
    m = kernels.untwisted_directors(bent[None])[0]
    bending = []
    for turn in (0.0, 0.3, 1.0):
        angle = (turn * np.arange(31))[:, None]
        directors = np.cos(angle) * m + np.sin(angle) * np.cross(t, m)
        energy = kernels.kirchhoff(bent[None], directors[None], rest)[0][0]
        bending.append(energy - 30 * TWISTING * turn**2 / (2 * rest.length.mean()))
    print("bending energy at twists of 0, 0.3 and 1 rad a joint:", bending)
    assert bending[1:] == pytest.approx([bending[0]] * 2, rel=1e-11)


def test_bending_energy_of_an_isotropic_rod_is_that_of_its_curvature(straight: Points) -> None:
    """2 tan(bend/2) is the lecture's kappa dl: straight rest, any shape, the same energy as `bending`."""
    rest, bent = shape(straight[None]), helix(0.02, 0.03, 0.25, 32)[None]
    energy = kernels.kirchhoff(bent, kernels.untwisted_directors(bent), rest)[0][0]
    assert energy == pytest.approx(kernels.bending(bent, rest)[0][0], rel=1e-12)


def test_rest_shape_has_no_force_and_no_twist(curl: Points, circle: Points, straight: Points) -> None:
    rest = shape(np.stack([curl, circle, straight]))
    force, turning = kernels.kirchhoff(rest.points, rest.directors, rest)[1:]
    scale = BENDING / rest.length.mean() ** 2
    print(
        f"rest force over B/dl^2 {np.abs(force).max() / scale:.1e}, rest twist {rest.strain[..., 2].max():.1e}"
    )
    assert np.abs(force).max() <= 1e-13 * scale
    assert np.abs(turning).max() <= 1e-13 * BENDING / rest.length.mean()
    assert np.abs(rest.strain[..., 2]).max() <= 1e-14


def test_strains_are_those_of_the_rest_shape_and_of_the_twin(kinked: Points) -> None:
    rest, at = shape(kinked[None]), random_rod(5)
    assert (kernels.strains(rest.points, rest.directors) == rest.strain).all()
    t = np.diff(at.points, axis=0) / np.linalg.norm(np.diff(at.points, axis=0), axis=1, keepdims=True)
    expected = np.stack([a.real for a in rod_twin.strains(t, at.directors, at.twist)], -1)
    assert kernels.strains(at.points[None], at.directors[None])[0] == pytest.approx(expected, abs=1e-13)


def test_directors_are_unit_square_to_the_segments_and_free_of_twist() -> None:
    points = np.stack([random_rod(seed).points for seed in range(40)])
    m = kernels.untwisted_directors(points)
    t = np.diff(points, axis=1) / np.linalg.norm(np.diff(points, axis=1), axis=2, keepdims=True)
    assert np.abs((m * m).sum(-1) - 1).max() <= 1e-14
    assert np.abs((m * t).sum(-1)).max() <= 1e-14
    assert np.abs(kernels.strains(points, m)[..., 2]).max() <= 1e-13


def test_folded_strands_stay_finite(straight: Points, curl: Points) -> None:
    folded = straight.copy()
    folded[17:] = folded[15] - (folded[17:] - folded[15])
    m = kernels.untwisted_directors(folded[None])
    assert np.isfinite(m).all()
    for values in kernels.kirchhoff(folded[None], m, shape(curl[None])):
        assert np.isfinite(values).all()


def test_arrays_that_do_not_fit_are_refused(curl: Points) -> None:
    rest = shape(curl[None])
    with pytest.raises(ValueError, match="directors"):
        kernels.kirchhoff(curl[None], rest.directors[:, 1:].copy(), rest)
    with pytest.raises(ValueError, match="twist"):
        kernels.kirchhoff(curl[None], rest.directors, rest, np.zeros((1, 31)))
    with pytest.raises(ValueError, match="directors"):
        kernels.strains(curl[None], rest.directors[:, 1:].copy())
    with pytest.raises(ValueError, match="another size"):
        rest.strain = np.zeros((1, 30))
