"""Every validation case as a test, and what a case means by passing."""

import math

import numpy as np
import pytest

from pipeline.validation import Case, CaseResult, all_cases, statics
from pipeline.validation.rod import period


@pytest.mark.parametrize("case", all_cases(), ids=lambda case: f"{case.name}, {case.model}")
def test_strands_obey_the_law_of(case: Case) -> None:
    result = case.run()
    print(
        f"{result.measured:.6g} against {result.reference:.6g}: {result.error:.1e} of {result.tolerance:.1e}"
    )
    assert result.passed


def test_cantilever_converges_with_second_order() -> None:
    """Expected errors at Gamma = 10: -1.1, -.27, -.066 % with 16, 32, 64 points (validation.md)."""
    points = np.array([16, 32, 64])
    errors = np.array([abs(statics.cantilever(10, points=p) / statics.CANTILEVER[10] - 1) for p in points])
    order = -np.polyfit(np.log(points - 1.5), np.log(errors), 1)[0]
    print(f"errors {errors}, order {order:.3f}")
    assert order == pytest.approx(2.0, abs=0.1)


def test_results_pass_inside_their_tolerance_only() -> None:
    assert CaseResult("a", "none", 1.009, 1.0, 0.01).passed
    assert not CaseResult("a", "none", 1.011, 1.0, 0.01).passed
    assert CaseResult("a", "none", 1e-7, 0.0, 1e-6).passed
    assert not CaseResult("a", "none", math.nan, 1.0, 0.5).passed


def test_period_of_a_cosine() -> None:
    trace = np.cos(2 * np.pi * np.arange(1000) / 137.3)
    assert period(trace, 0.5) == pytest.approx(137.3 / 2, rel=1e-4)
    assert math.isnan(period(np.ones(10), 0.5))
