"""Every validation case as a test, in its short version; what a case means by passing; where references come from."""

import math

import numpy as np
import pytest

from pipeline.validation import Case, CaseResult, Outcome, Reading, all_cases, all_laws, curls, statics
from pipeline.validation.page import rows, summary, write_page
from pipeline.validation.plots import draw
from pipeline.validation.rod import BENDING, TWISTING, period
from pipeline.validation.rod_equations import DOWN, ElasticRod


@pytest.mark.parametrize("case", all_cases(quick=True), ids=lambda case: case.title)
def test_strands_obey_the_law_of(case: Case) -> None:
    result = case.run()
    for reading in result.outcome.readings:
        print(
            f"{reading.what}: {reading.measured:.6g} against {reading.reference:.6g}: "
            f"{reading.error:.1e} of {reading.tolerance:.1e}, {result.verdict(reading)}"
        )
    assert result.passed
    if result.unmet:
        assert not all(reading.passed for reading in result.outcome.readings), "met: remove the mark"


def test_every_law_runs_with_material_frames_and_says_what_it_rests_on() -> None:
    laws = all_laws()
    assert len({law.name for law in laws}) == len(laws)
    for law in laws:
        assert law.models[0] == "kirchhoff"
        assert "kirchhoff" not in law.unmet
        assert set(law.unmet) <= set(law.models)
        assert len(law.about) > 80


def test_the_master_curve_solves_the_rod_equations() -> None:
    level = ElasticRod((0, 0, 0), np.array([[0, 0, 1.0], [1, 0, 0], [0, 1, 0]]), 1.0)
    for gamma in (0.1, 1, 10, 100):
        tip = level.tip(gamma)
        error = abs(-tip[1] / tip[0] / statics.CANTILEVER[gamma] - 1)
        print(f"Gamma {gamma}: H/W {-tip[1] / tip[0]:.7f}, off the table by {error:.1e}")
        assert error < 5e-5  # the digits of the table


def test_tip_loads_solve_the_rod_equations() -> None:
    level = ElasticRod((0, 0, 0), np.array([[0, 0, 1.0], [1, 0, 0], [0, 1, 0]]), 1.0)
    for load in (1, 10):
        tip = level.tip(force=(0, -load, 0))
        error = np.abs(np.array([-tip[1], tip[0]]) - statics.TIP_LOAD[load]).max()
        print(f"P L^2/B {load}: drop {-tip[1]:.7f}, reach {tip[0]:.7f}, off by {error:.1e}")
        assert error < 2e-6


def test_helices_solve_the_rod_equations() -> None:
    """Gamma = 5000 takes half a minute and is left out."""
    kappa, tau = curls.helix_curvature()
    rate, normal = np.hypot(kappa, tau), np.array([1.0, 0, 0])
    aside = np.cross(normal, DOWN)
    frame = np.stack(
        [normal, (kappa * DOWN - tau * aside) / rate, (tau * DOWN + kappa * aside) / rate], axis=1
    )
    rod = ElasticRod((0, kappa, tau), frame, TWISTING / BENDING)
    for force in (1, 100):
        drop = -rod.tip(force=(0, -force, 0))[1]
        print(f"F L^2/B {force}: {drop:.7f}")
        assert drop == pytest.approx(curls.PULLED_HELIX[force], abs=2e-6)
    drop = -rod.tip(1000)[1]
    print(f"Gamma 1000: {drop:.7f}")
    assert drop == pytest.approx(curls.HEAVY_HELIX[1000], abs=2e-6)


def reading(measured: float, reference: float = 1.0, tolerance: float = 0.01) -> Reading:
    return Reading("a figure", measured, reference, tolerance)


def result(*readings: Reading, unmet: str = "") -> CaseResult:
    return CaseResult("a law", "rotor", Outcome(readings), unmet)


def test_readings_pass_inside_their_tolerance_only() -> None:
    assert reading(1.009).passed
    assert not reading(1.011).passed
    assert reading(1e-7, 0.0, 1e-6).passed
    assert not reading(math.nan, 1.0, 0.5).passed


def test_what_cannot_be_met_does_not_fail_and_what_is_met_after_all_is_named() -> None:
    right, wrong = reading(1.0), reading(2.0)
    assert not result(right, wrong).passed
    assert result(right, wrong).verdict(wrong) == "NOT MET"
    expected = result(right, wrong, unmet="it cannot")
    assert expected.passed
    assert [expected.verdict(right), expected.verdict(wrong)] == ["met", "not met (expected)"]
    better = result(right, unmet="it cannot")
    assert better.passed
    assert better.verdict(right) == "met, not expected"
    assert "remove the mark: a law, rotor" in summary([better])


def test_the_page_shows_every_figure_and_reason_and_a_picture_of_each_curve(tmp_path) -> None:
    """The laws whose short versions keep curves; the pictures have the same bytes when they are drawn again."""
    pytest.importorskip("matplotlib")
    names = ("cantilever", "cantilever order", "cantilever tip load", "bend-twist", "vibration",
             "energy of an undamped swing", "buckling under compression")  # fmt: skip
    results = [case.run() for case in all_cases(quick=True) if case.law.name in names]
    write_page(results, tmp_path / "docs" / "laws.md", quick=True)
    page = (tmp_path / "docs" / "laws.md").read_text()
    assert page.count("\n| ") == len(rows(results)) + len(names)
    again = draw(results, tmp_path / "again")
    assert sorted(again) == sorted(names)
    for name in names:
        picture = tmp_path / "docs" / "pictures" / "laws" / f"{name.replace(' ', '_')}.png"
        assert picture.read_bytes().startswith(b"\x89PNG")
        assert picture.read_bytes() == (tmp_path / "again" / again[name]).read_bytes()
        assert f"(pictures/laws/{picture.name})" in page


def test_period_of_a_cosine() -> None:
    trace = np.cos(2 * np.pi * np.arange(1000) / 137.3)
    assert period(trace, 0.5) == pytest.approx(137.3 / 2, rel=1e-4)
    assert math.isnan(period(np.ones(10), 0.5))
