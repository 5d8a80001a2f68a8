"""Strands against what the mechanics of rods says: closed forms and high-accuracy references.

Planar cases hold for every torsion model. Bend-twist and lateral buckling are not here: they need a material
frame, which the models "rotor" and "frenet" do not have: a curl that hangs from its root turns three-dimensional
too early with both.
"""

from pipeline.validation import dynamics, friction, statics
from pipeline.validation.case import Case, CaseResult

__all__ = ["Case", "CaseResult", "all_cases", "run_cases"]


def all_cases() -> list[Case]:
    """Every case there is."""
    return [*statics.cases(), *dynamics.cases(), *friction.cases()]


def run_cases(quick: bool) -> list[CaseResult]:
    """Run every case, or only the quick ones: those take less than a minute on two cores."""
    return [case.run() for case in all_cases() if case.quick or not quick]
