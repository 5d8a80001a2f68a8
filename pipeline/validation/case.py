"""A physical law as cases, one for each torsion model: what is measured, what the law says, how far they may differ."""

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Model = Literal["kirchhoff", "rotor", "frenet", "none"]
MODELS: tuple[Model, ...] = ("kirchhoff", "rotor", "frenet", "none")
CURLY: tuple[Model, ...] = ("kirchhoff", "rotor", "frenet")

Verdict = Literal["met", "NOT MET", "not met (expected)", "met, not expected"]
Curves = Mapping[str, NDArray[np.float64]]


@dataclass(frozen=True)
class Reading:
    """One measured number. The tolerance is relative to the reference, and absolute where that is zero."""

    what: str
    measured: float
    reference: float
    tolerance: float

    @property
    def error(self) -> float:
        """The difference that is compared with the tolerance."""
        difference = abs(self.measured - self.reference)
        return difference / abs(self.reference) if self.reference else difference

    @property
    def passed(self) -> bool:
        """Whether the law holds; false when the measured value is not a number."""
        return self.error <= self.tolerance


@dataclass(frozen=True)
class Outcome:
    """What a law reads off its strands, and curves (name -> array) for its picture."""

    readings: tuple[Reading, ...]
    curves: Curves = field(default_factory=dict)


@dataclass(frozen=True)
class Law:
    """A law: how it is measured with a torsion model, in a short version or in full, and what it rests on."""

    name: str
    about: str
    """Protocol and source of the reference, a paragraph of Markdown."""
    measure: Callable[[Model, bool], Outcome]
    """Of a model, and whether the short version is enough."""
    models: tuple[Model, ...] = MODELS
    unmet: Mapping[Model, str] = field(default_factory=dict)
    """Models that cannot meet the law, and why."""


@dataclass(frozen=True)
class CaseResult:
    """What a case measured, and how long that took [s]."""

    name: str
    model: Model
    outcome: Outcome
    unmet: str = ""
    seconds: float = 0.0

    @property
    def passed(self) -> bool:
        """Whether no reading is wrong that should be right."""
        return bool(self.unmet) or all(reading.passed for reading in self.outcome.readings)

    def verdict(self, reading: Reading) -> Verdict:
        """What to say of a reading; a case that meets its law in all readings although it was said not to is named."""
        if not self.unmet:
            return "met" if reading.passed else "NOT MET"
        if all(other.passed for other in self.outcome.readings):
            return "met, not expected"
        return "met" if reading.passed else "not met (expected)"


@dataclass(frozen=True)
class Case:
    """A law with one torsion model."""

    law: Law
    model: Model
    quick: bool

    @property
    def title(self) -> str:
        """Name and model, which `ringlet validate WORD` looks into."""
        return f"{self.law.name}, {self.model}"

    def run(self) -> CaseResult:
        """Measure."""
        start = time.perf_counter()
        outcome = self.law.measure(self.model, self.quick)
        reason = self.law.unmet.get(self.model, "")
        return CaseResult(self.law.name, self.model, outcome, reason, time.perf_counter() - start)
