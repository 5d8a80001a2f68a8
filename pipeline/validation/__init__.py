"""Strands against what the mechanics of rods says: closed forms and high-accuracy references.

Every law runs for every torsion model to which it applies. Planar laws hold for all of them. Those in which a strand
bends and twists need material frames, which only "kirchhoff" has: the others are shown with what they do instead.
"""

from pipeline.validation import buckling, curls, dynamics, friction, ribbons, statics
from pipeline.validation.case import Case, CaseResult, Law, Outcome, Reading

__all__ = ["Case", "CaseResult", "Law", "Outcome", "Reading", "all_cases", "all_laws"]


def all_laws() -> list[Law]:
    """Every law there is."""
    rooms = (statics, dynamics, friction, buckling, ribbons, curls)
    return [law for room in rooms for law in room.laws()]


def all_cases(quick: bool = False, word: str = "") -> list[Case]:
    """Every law with every model to which it applies, those with a word in their title; `quick` is less than a minute."""
    cases = [Case(law, model, quick) for law in all_laws() for model in law.models]
    return [case for case in cases if word.lower() in case.title.lower()]
