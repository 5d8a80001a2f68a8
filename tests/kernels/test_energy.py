"""Energies of strands: exact gradients, no net force or torque, invariances, and what the torsion models tell apart."""

from typing import Any

import energy_twins
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from strand_scenes import BENDING, TWISTING, rotation, shape

from pipeline import kernels

Points = NDArray[np.float64]
MODELS = {
    "bending": (kernels.bending, energy_twins.bending),
    "rotor": (kernels.torsion_rotor, energy_twins.rotor),
    "frenet": (kernels.torsion_frenet, energy_twins.frenet),
}
every_model = pytest.mark.parametrize("model", MODELS)


def random_strand(seed: int, points: int = 12, turn: float = 0.6) -> Points:
    """A strand with uneven segments and random bends, none sharper than about 90 degrees."""
    rng = np.random.default_rng(seed)
    directions = np.array([3.0, 0, 0]) + np.cumsum(rng.normal(size=(points - 1, 3)) * turn, axis=0)
    steps = (
        directions
        / np.linalg.norm(directions, axis=1, keepdims=True)
        * rng.uniform(0.004, 0.009, (points - 1, 1))
    )
    return np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])


@every_model
def test_gradients_agree_with_complex_step(model: str, curl: Points, kinked: Points) -> None:
    kernel, twin = MODELS[model]
    worst = 0.0
    for rest_points, points in [(curl, kinked), (kinked, curl), (random_strand(1, 32), random_strand(2, 32))]:
        rest = shape(rest_points[None])
        energy, force = kernel(points[None], rest)
        expected = energy_twins.gradient(twin, points, rest)
        assert energy[0] == pytest.approx(twin(points, rest).real, rel=1e-12)
        worst = max(worst, float(np.abs(force[0] + expected).max() / np.abs(expected).max()))
    print(f"{model}: gradient against complex step {worst:.2e}")
    assert worst <= 1e-13


@every_model
def test_internal_forces_have_no_net_force_and_no_net_torque(
    model: str, curl: Points, kinked: Points
) -> None:
    force = MODELS[model][0](kinked[None], shape(curl[None]))[1][0]
    torque = np.cross(kinked, force)
    net_force = float(np.abs(force.sum(0)).max() / np.abs(force).max())
    net_torque = float(np.abs(torque.sum(0)).max() / np.abs(torque).max())
    print(f"{model}: net force {net_force:.1e}, net torque {net_torque:.1e}")
    assert max(net_force, net_torque) <= 1e-12


@every_model
@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10_000), angle=st.floats(-3, 3), shift=st.floats(-1, 1))
def test_energy_is_invariant_under_rotation_and_translation(
    model: str, seed: int, angle: float, shift: float
) -> None:
    points, rest = random_strand(seed), shape(random_strand(seed + 1)[None])
    axis = tuple(np.random.default_rng(seed).normal(size=3))
    moved = points @ rotation(axis, angle).T + shift
    before, after = (MODELS[model][0](x[None], rest)[0][0] for x in (points, moved))
    assert after == pytest.approx(before, rel=1e-9, abs=1e-20)


@every_model
@settings(max_examples=25, deadline=None)
@given(seed=st.integers(0, 10_000))
def test_energy_is_invariant_under_reversal(model: str, seed: int) -> None:
    points, groomed = random_strand(seed), random_strand(seed + 1)
    forwards = MODELS[model][0](points[None], shape(groomed[None]))[0][0]
    backwards = MODELS[model][0](np.ascontiguousarray(points[None, ::-1]), shape(groomed[None, ::-1]))[0][0]
    assert backwards == pytest.approx(forwards, rel=1e-9)


@every_model
def test_uniform_stretch_costs_nothing(model: str, curl: Points, kinked: Points) -> None:
    rest = shape(curl[None])
    energies = [MODELS[model][0](scale * kinked[None], rest)[0][0] for scale in (1.0, 1.3)]
    assert energies[1] == pytest.approx(energies[0], rel=1e-12)


def test_a_strand_in_its_rest_shape_feels_no_force(curl: Points, circle: Points, straight: Points) -> None:
    for name, points in {"curl": curl, "circle": circle, "straight": straight}.items():
        rest = shape(points[None])
        scale = BENDING / rest.length.mean() ** 2
        worst = max(
            float(np.abs(MODELS[m][0](points[None], rest)[1]).max()) / scale for m in ("bending", "rotor")
        )
        print(f"{name}: rest force over k_kappa/dl^2 {worst:.1e}")
        assert worst <= 1e-7


def test_straight_strand_bends_harmonically(straight: Points) -> None:
    """Without a cusp at kappa = 0: energy grows with the square of the bend down to the smallest."""
    rest, bent = shape(straight[None]), []
    for height in (1e-3, 1e-5, 1e-7):
        points = straight.copy()
        points[:, 1] = height * (points[:, 0] / 0.25) ** 2
        bent.append(kernels.bending(points[None], rest)[0][0] / height**2)
    assert bent[1] == pytest.approx(bent[0], rel=1e-3)
    assert bent[2] == pytest.approx(bent[0], rel=1e-3)


def quarter_bends(phi: float, points: int = 8) -> Points:
    """Right-angled in spirit: equal bends of 0.5 rad, the dihedral about each edge phi."""
    frame, strand = np.eye(3), [np.zeros(3)]
    for _ in range(points - 1):
        strand.append(strand[-1] + 0.008 * frame[:, 0])
        frame = frame @ rotation((1, 0, 0), phi) @ rotation((0, 0, 1), 0.5)
    return np.array(strand)


def test_rotor_has_one_minimum_where_the_lecture_has_two() -> None:
    """The 5-point torsion sees the sine of the dihedral only: phi and pi - phi look the same to it."""
    phi = 0.7
    rest = shape(quarter_bends(phi)[None])
    wrong = quarter_bends(np.pi - phi)[None]
    frenet, rotor = kernels.torsion_frenet(wrong, rest)[0][0], kernels.torsion_rotor(wrong, rest)[0][0]
    print(f"wrong coil: frenet {frenet:.1e} J, rotor {rotor:.1e} J")
    assert frenet < 1e-3 * rotor
    angles = np.linspace(-np.pi, np.pi, 721)
    energies = np.array([kernels.torsion_rotor(quarter_bends(a)[None], rest)[0][0] for a in angles])
    minima = (energies[1:-1] < energies[:-2]) & (energies[1:-1] < energies[2:])
    assert angles[1:-1][minima] == pytest.approx([phi], abs=0.01)


def test_rotor_is_the_torsion_energy_near_rest() -> None:
    """A small change of every dihedral costs k_tau (tau - tau_r)^2 dl / 2 per edge."""
    phi, change, dl, points = 0.4, 1e-4, 0.008, 8
    rest = shape(quarter_bends(phi, points)[None])
    energy = kernels.torsion_rotor(quarter_bends(phi + change, points)[None], rest)[0][0]
    expected = (points - 3) * TWISTING * change**2 / (2 * dl)
    print(f"rotor over k_tau dtau^2 dl/2: {energy / expected:.4f}")
    assert energy == pytest.approx(expected, rel=0.02)


def test_rotor_weight_fades_on_straight_hair(straight: Points, curl: Points) -> None:
    rest = shape(np.stack([straight, curl]))
    limit = TWISTING / (rest.length[:, 1:-1] * (4.0 * rest.length[:, 1:-1]) ** 2)
    assert (rest.weight[0] == 0).all()
    assert (rest.weight * np.maximum(rest.ratio, 1 / rest.ratio) <= limit).all()
    assert (rest.weight[1] > 0).all()


def test_tip_and_root_carry_half_a_point_and_masses_add_up(kinked: Points) -> None:
    rest = shape(kinked[None])
    assert rest.mass.sum() == pytest.approx(1300 * np.pi * 40e-6**2 * rest.length.sum(), rel=1e-12)
    assert rest.mass[0, -1] / rest.mass[0, -2] == pytest.approx(0.5, rel=0.3)


def test_folded_and_collapsed_strands_stay_finite_or_are_refused(straight: Points, curl: Points) -> None:
    folded = straight.copy()
    folded[17:] = folded[15] - (folded[17:] - folded[15])
    for model in MODELS:
        energy, force = MODELS[model][0](folded[None], shape(curl[None]))
        assert np.isfinite(energy).all(), model
        assert np.isfinite(force).all(), model
    with pytest.raises(ValueError, match="zero length"):
        shape(np.repeat(straight[:1], 32, axis=0)[None])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"points": np.zeros((1, 7, 3))}, "8 to 256"),
        ({"mass_per_length": np.zeros(1)}, "mass_per_length"),
        ({"bending": np.full(1, np.nan)}, "finite"),
        ({"held": np.zeros((1, 31), np.uint8)}, "held"),
        ({"offset": np.zeros((2, 32))}, "offset"),
    ],
)
def test_rest_shape_refuses_what_does_not_fit(change: dict[str, Any], message: str, curl: Points) -> None:
    arguments: dict[str, Any] = {
        "points": curl[None],
        "mass_per_length": np.ones(1),
        "bending": np.ones(1),
        "twisting": np.ones(1),
        "held": np.zeros((1, 32), np.uint8),
        "offset": np.zeros((1, 32)),
    }
    with pytest.raises(ValueError, match=message):
        kernels.rest_shape(**{**arguments, **change})
