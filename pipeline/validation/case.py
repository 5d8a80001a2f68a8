"""A physical law as a case: what is measured, what the law says, how far they may differ."""

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class CaseResult:
    """What a case measured. The tolerance is relative to the reference, and absolute where that is zero."""

    name: str
    model: str
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
class Case:
    """A case that can be run: its torsion model, and how to measure what the reference says."""

    name: str
    model: str
    measure: Callable[[], float]
    reference: float
    tolerance: float
    quick: bool = True

    def run(self) -> CaseResult:
        """Measure."""
        return CaseResult(self.name, self.model, self.measure(), self.reference, self.tolerance)
