"""Curvature and torsion of strands: both forms of the lecture."""

import numpy as np
import pytest
from named_strands import helix
from numpy.typing import NDArray
from strand_scenes import shape

from pipeline import kernels

Points = NDArray[np.float64]
RADIUS, PITCH, LENGTH = 0.01, 0.02, 0.25  # not 0.03: there the two leading errors of torsion almost cancel
RISE = PITCH / (2 * np.pi)
CURVATURE, TORSION = RADIUS / (RADIUS**2 + RISE**2), RISE / (RADIUS**2 + RISE**2)


def uneven(strand: Points, seed: int = 3) -> Points:
    """Points at uneven places of a straight strand."""
    places = np.sort(np.random.default_rng(seed).uniform(0, 1, len(strand)))
    return strand[0] + places[:, None] * (strand[-1] - strand[0])


@pytest.mark.parametrize("form", ["equal", "general"])
def test_curvature_and_torsion_converge_with_order_two_on_a_helix(form: str) -> None:
    counts = np.array([32, 64, 128, 256])
    errors = []
    for count in counts:
        points = helix(RADIUS, PITCH, LENGTH, count)[None]
        kappa, tau = kernels.curvature(points, form), kernels.torsion(points, form)
        errors.append((np.abs(kappa / CURVATURE - 1).max(), np.abs(tau / TORSION - 1).max()))
    order = -np.polyfit(np.log(counts - 1), np.log(errors), 1)[0]
    print(f"{form}: order of curvature {order[0]:.3f}, of torsion {order[1]:.3f}")
    assert order == pytest.approx([2.0, 2.0], abs=0.1)


def test_general_form_is_exact_on_an_unevenly_spaced_straight_strand(straight: Points) -> None:
    points = uneven(straight)[None]
    general, equal = kernels.curvature(points, "general"), kernels.curvature(points, "equal")
    print(f"straight, uneven: general {general.max():.1e}/m, equal {equal.max():.1e}/m")
    assert general.max() <= 1e-9
    assert equal.max() > 100  # why the general form must be used there


def test_general_form_holds_on_an_unevenly_spaced_circle() -> None:
    angle = np.sort(np.random.default_rng(5).uniform(0, 1.5 * np.pi, 64))
    points = 0.04 * np.stack([np.sin(angle), 1 - np.cos(angle), 0 * angle], -1)[None]
    general, equal = (
        np.abs(kernels.curvature(points, form) * 0.04 - 1).max() for form in ("general", "equal")
    )
    print(f"circle, uneven: worst error general {general:.1e}, equal {equal:.1e}")
    assert general < 0.02


def test_general_form_equals_the_simple_one_at_equal_spacing(curl: Points) -> None:
    for operator in (kernels.curvature, kernels.torsion):
        assert operator(curl[None], "general") == pytest.approx(operator(curl[None], "equal"), rel=1e-9)


def test_torsion_of_a_circle_is_zero_and_a_mirrored_curl_turns_the_other_way(
    circle: Points, curl: Points
) -> None:
    assert np.abs(kernels.torsion(circle[None], "equal")).max() <= 1e-9
    mirrored = curl * [1, 1, -1]
    assert kernels.torsion(mirrored[None], "equal") == pytest.approx(
        -kernels.torsion(curl[None], "equal"), rel=1e-12
    )


def test_operators_refuse_short_strands_and_unknown_forms(curl: Points) -> None:
    with pytest.raises(ValueError, match="5 points"):
        kernels.torsion(curl[None, :4].copy(), "equal")
    with pytest.raises(ValueError, match="equal"):
        kernels.curvature(curl[None], "simple")  # type: ignore[arg-type]


def test_the_energy_rests_at_the_general_curvature_and_torsion_of_uneven_strands() -> None:
    """What "frenet" keeps are the lecture's operators for unequal spacing, and there it stores no energy to speak of."""
    angle = np.sort(np.random.default_rng(5).uniform(0, 20, 48))
    curl = np.stack([RADIUS * np.cos(angle), RADIUS * np.sin(angle), RISE * angle], -1)[None]
    rest = shape(curl)
    curvature = np.abs(rest.curvature / kernels.curvature(curl, "general") - 1).max()
    torsion = np.abs(rest.torsion / kernels.torsion(curl, "general") - 1).max()
    print(f"uneven helix: rest curvature and torsion against the operators {curvature:.1e}, {torsion:.1e}")
    assert max(curvature, torsion) <= 1e-9
