"""How far strands that follow guides are from where they would be, had every one of them been simulated."""

from pipeline.validation.interpolation.report import FULL, QUICK, Plan, Report, measure, merged

__all__ = ["FULL", "QUICK", "Plan", "Report", "measure", "merged"]
