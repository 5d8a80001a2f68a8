"""Elliptic sections: what they weigh and resist, how they lie along a strand, and that they move as they should."""

import numpy as np
import pytest
from numpy.typing import NDArray

from pipeline import kernels
from pipeline.config.schema import Hair, Simulate
from pipeline.simulate.rest import rest_shape
from pipeline.simulate.section import bending_stiffness, lay_sections, mass_per_length, twisting_stiffness

Points = NDArray[np.float64]


def helix(radius: float, pitch: float, length: float, points: int) -> Points:
    rise = pitch / (2 * np.pi)
    angle = np.linspace(0, length, points) / np.hypot(radius, rise)
    return np.stack([rise * angle, radius * np.cos(angle) - radius, radius * np.sin(angle)], axis=-1)


def rest_of(points: Points, ellipticity: float, clamped: int = 2) -> kernels.RestShape:
    held = np.zeros((1, len(points)), np.uint8)
    held[:, :clamped] = 1
    return rest_shape(Hair(ellipticity=ellipticity), points[None], held, np.zeros((1, len(points))))


def test_round_sections_are_the_limit() -> None:
    hair = Hair()
    soft, stiff = bending_stiffness(hair)
    assert soft == stiff == pytest.approx(hair.young_modulus * np.pi * hair.radius**4 / 4)
    assert twisting_stiffness(hair) == pytest.approx(hair.shear_modulus * np.pi * hair.radius**4 / 2)


@pytest.mark.parametrize("ellipticity", [1.29, 1.66, 3.0])
def test_stiffness_is_that_of_the_second_moments_of_an_ellipse(ellipticity: float) -> None:
    """Integrated over the ellipse of the same area: the moments of inertia by sums over a fine grid."""
    hair = Hair(ellipticity=ellipticity)
    a, b = hair.radius * ellipticity**0.5, hair.radius / ellipticity**0.5
    y, z = np.meshgrid(a * np.linspace(-1, 1, 2001), b * np.linspace(-1, 1, 2001), indexing="ij")
    inside, cell = (y / a) ** 2 + (z / b) ** 2 <= 1, (a / 1000) * (b / 1000)
    soft, stiff = bending_stiffness(hair)
    print(f"{ellipticity}: stiff over soft {stiff / soft:.4f}")
    assert mass_per_length(hair) == pytest.approx(hair.density * inside.sum() * cell, rel=1e-3)
    assert soft == pytest.approx(hair.young_modulus * (z**2)[inside].sum() * cell, rel=2e-3)
    assert stiff == pytest.approx(hair.young_modulus * (y**2)[inside].sum() * cell, rel=2e-3)


def test_the_minor_axis_follows_the_curl() -> None:
    """A helix bends about one axis of its section only, and its rest twist is its torsion."""
    radius, pitch = 0.01, 0.02
    rest = rest_of(helix(radius, pitch, 0.25, 64), 1.66)
    k1, k2, twist = np.moveaxis(rest.strain[0, 2:-2], -1, 0)
    rise = pitch / (2 * np.pi)
    torsion = rise / (radius**2 + rise**2) * rest.length.mean()
    print(f"|k2/k1| at most {np.abs(k2 / k1).max():.3f}, twist {twist.mean():.4f}, torsion {torsion:.4f} rad")
    assert np.abs(k2).max() <= 0.05 * np.abs(k1).min()
    assert twist == pytest.approx(torsion, rel=0.05)


def test_sections_of_straight_hair_are_not_twisted() -> None:
    """Noise in the groom does not turn them."""
    points = np.linspace([0.0, 0, 0], [0.2, 0, 0], 64)
    points += np.random.default_rng(0).normal(size=points.shape) * 2e-6
    rest = rest_of(points, 1.66)
    print(f"rest twist at most {np.abs(rest.strain[..., 2]).max():.1e} rad")
    assert np.abs(rest.strain[..., 2]).max() <= 0.02


def test_turned_sections_are_the_same_strand_where_they_are_round() -> None:
    """For a round section any directors make the same rod."""
    points = helix(0.01, 0.02, 0.25, 32)
    plain, turned = rest_of(points, 1.0), rest_of(points, 1.0)
    lay_sections(turned, 20.0)
    ends = []
    for rest in (plain, turned):
        state = kernels.at_rest(points[None], np.ascontiguousarray(rest.directors))
        settings = kernels.StepSettings()
        settings.torsion = "kirchhoff"
        still = kernels.Drive(np.tile(np.eye(4), (241, 1, 1)), np.zeros((240, 3)))
        kernels.advance(state, rest, None, still, settings)
        ends.append(state.points.copy())
    difference, fall = np.abs(ends[1] - ends[0]).max(), np.abs(ends[0] - points).max()
    print(f"difference after a second {difference:.1e} m, fallen {fall:.1e} m")
    assert difference <= 1e-9
    assert fall > 1e-2


@pytest.mark.parametrize("axis", [(0.0, 1.0, 0.0), (0.0, 0.0, 1.0)])
def test_an_elliptic_cantilever_sags_as_its_axis_tells(axis: tuple[float, float, float]) -> None:
    """Small sag w L^4 / (8 E I) with the stiffness towards gravity: minor axis up or sideways."""
    ellipticity, count, hair = 1.66, 64, Hair(ellipticity=1.66)
    length = 0.01
    spacing = length / (count - 1.5)
    points = np.stack([spacing * (np.arange(count) - 0.5), np.zeros(count), np.zeros(count)], -1)
    rest = rest_of(points, ellipticity)
    rest.directors = np.tile(np.array(axis), (1, count - 1, 1))
    settings = kernels.StepSettings()
    settings.torsion, settings.theta, settings.drag, settings.tolerance = "kirchhoff", 1.0, 20.0, 1e-10
    state = kernels.at_rest(points[None], rest.directors.copy())
    still = kernels.Drive(np.tile(np.eye(4), (2001, 1, 1)), np.zeros((2000, 3)))
    kernels.advance(state, rest, None, still, settings)
    stiffness = bending_stiffness(hair)[0 if axis[1] else 1]
    expected = mass_per_length(hair) * 9.81 * length**4 / (8 * stiffness)
    sag = -state.points[0, -1, 1]
    print(f"minor axis {axis}: sag {sag:.4e} m, w L^4 / (8 E I) {expected:.4e} m")
    assert sag == pytest.approx(expected, rel=0.01)


def test_models_without_sections_refuse_elliptic_ones() -> None:
    with pytest.raises(ValueError, match="elliptic sections"):
        Simulate(torsion="rotor", hair=Hair(ellipticity=1.4))
    assert Simulate(torsion="kirchhoff", hair=Hair(ellipticity=1.4)).hair.ellipticity == 1.4
