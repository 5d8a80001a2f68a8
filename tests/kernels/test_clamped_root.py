"""Roots that the head clamps with two points: a curl keeps its direction about its root in every torsion model."""

import numpy as np
import pytest
import rod_twin
from energy_twins import dot, unit_edges
from numpy.typing import NDArray
from strand_scenes import FREE, Points, drive, roots, rotation, settings, shape, turned

from pipeline import kernels

every_model = pytest.mark.parametrize("torsion", ["kirchhoff", "rotor", "frenet"])


def root_energy(x: NDArray[np.complex128], at: Points, rest: kernels.RestShape) -> complex:
    """G/2 |d_1 across segment 0, seen by the director, minus its rest value|^2; the director goes along with segment 0."""
    director = rest.directors[0, :1]
    m = rod_twin.transported(director, unit_edges(at)[:1], unit_edges(x)[:1])[0]
    result = 0j
    rest_edges = unit_edges(rest.points[0])
    for now, then in (
        (m, director[0]),
        (np.cross(unit_edges(x)[0], m), np.cross(rest_edges[0], director[0])),
    ):
        result += (dot(unit_edges(x)[1], now) - dot(rest_edges[1], then)) ** 2
    return complex(rest.root_weight[0] / 2 * result)


def test_gradient_at_the_root_agrees_with_complex_step(curl: Points, kinked: Points) -> None:
    """The director is square to the root that is held; the points beyond it are anywhere."""
    rest, points = shape(curl[None]), kinked.copy()
    points[:2] = curl[:2]
    whole = kernels.torsion_rotor(points[None], rest, rest.directors)
    energy, force = (a - b for a, b in zip(whole, kernels.torsion_rotor(points[None], rest), strict=True))
    expected = np.zeros_like(points)
    for index in np.ndindex(3, 3):
        x = points.astype(complex)
        x[index] += 1e-30j
        expected[index] = root_energy(x, points, rest).imag / 1e-30
    assert energy[0] == pytest.approx(root_energy(points.astype(complex), points, rest).real, rel=1e-9)
    error = np.abs(force[0] + expected).max() / np.abs(expected).max()
    print(f"gradient at the root against complex step {error:.1e}")
    assert error <= 1e-12


def test_a_clamped_root_at_rest_feels_no_force(curl: Points) -> None:
    rest = shape(curl[None])
    energy, force = kernels.torsion_rotor(curl[None], rest, rest.directors)
    without = kernels.torsion_rotor(curl[None], rest)
    assert rest.root_weight[0] > 0
    assert energy == pytest.approx(without[0], abs=1e-20)
    assert force == pytest.approx(without[1], abs=1e-16 * rest.bending[0] / rest.length[0, 0] ** 2)


def test_turning_the_first_bend_costs_the_torsion_of_the_first_segment(curl: Points) -> None:
    """A turn of the strand beyond point 1 about segment 0 by a costs k_tau a^2 / (2 l), where the hair curls."""
    rest, angle = shape(curl[None]), 1e-3
    axis = (curl[1] - curl[0]) / np.linalg.norm(curl[1] - curl[0])
    swivelled = curl.copy()
    swivelled[2:] = curl[1] + (curl[2:] - curl[1]) @ rotation(tuple(axis), angle).T
    energy = kernels.torsion_rotor(swivelled[None], rest, rest.directors)[0][0]
    expected = rest.twisting[0] * angle**2 / (2 * rest.length[0, 0])
    print(f"swivelling by {angle} rad: {energy / expected:.4f} k_tau a^2 / (2 l)")
    assert energy == pytest.approx(expected, rel=0.02)


def swivel(points: Points, torsion: str, weight: float) -> float:
    """Angle [rad] by which a curl turns about its first segment, pushed sideways with a fiftieth of its weight."""
    rest = shape(points[None], roots(1, len(points)))
    rest.root_weight[...] *= weight
    axis = (points[1] - points[0]) / np.linalg.norm(points[1] - points[0])

    def aside(x: Points) -> Points:
        middle = x.mean(0) - points[0]
        return np.asarray(middle - (middle @ axis) * axis)

    before = aside(points)
    sideways = np.cross(axis, before) / np.linalg.norm(before)
    step = settings(dt=1 / 60, theta=1.0, drag=4.0, gravity=tuple(0.02 * 9.81 * sideways), torsion=torsion)
    state = kernels.at_rest(points[None])
    kernels.advance(state, rest, None, drive(60 * 30), step)
    after = aside(state.points[0])
    return float(np.arctan2(after @ sideways, after @ before / np.linalg.norm(before)))


def test_a_clamped_root_does_not_swivel(curl: Points) -> None:
    """Without the torsion at its root a curl turns about it until it points where it is pushed to."""
    angles = {model: swivel(curl[:12].copy(), model, 1.0) for model in ("kirchhoff", "rotor")}
    loose = swivel(curl[:12].copy(), "rotor", 0.0)
    print(*(f"{model} {np.degrees(angle):.2f} degrees," for model, angle in angles.items()))
    print(f"rotor without the root's torsion {np.degrees(loose):.1f} degrees")
    assert loose > 1.0
    assert angles["rotor"] == pytest.approx(angles["kirchhoff"], rel=0.25)


def test_frenet_swivels_about_its_root(curl: Points) -> None:
    """It is blind to dihedrals that change by turns: for curls that must not swivel there are the other models."""
    assert swivel(curl[:12].copy(), "frenet", 1.0) > 1.0


@every_model
def test_a_clamped_root_does_not_drag_a_strand_that_turns_with_the_head(torsion: str, curl: Points) -> None:
    """Internal damping is zero for a rigid turn: the strand stays at rest in the turning head's frame."""
    rate, ends = 0.1, []
    for damping in (0.0, 0.05):
        rest, state = shape(curl[None]), kernels.at_rest(curl[None])
        state.velocity[...] = np.cross([rate, 0, 0], curl)
        step = settings(**{**FREE, "damping": damping}, torsion=torsion)
        poses = drive(240, lambda k: turned((1, 0, 0), rate * k / 240))
        kernels.advance(state, rest, None, poses, step)
        ends.append(state.points[0])
    expected = curl @ turned((1, 0, 0), 0.1)[:3, :3].T
    drag = np.abs(ends[1] - ends[0]).max() / np.abs(expected - curl).max()
    off = np.abs(ends[1] - expected).max() / np.abs(expected - curl).max()
    print(f"{torsion}: damping changes the turn by {drag:.1e} of it; off the rigid turn by {off:.1e}")
    assert drag <= 1e-2
