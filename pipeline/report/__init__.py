"""Reports on experiments that were run: the page of one run, the page of a sweep, what differs between two runs."""

from pipeline.report.diff import Difference, diff
from pipeline.report.run import run_page, write_run_page
from pipeline.report.sweep import write_sweep_page

__all__ = ["Difference", "diff", "run_page", "write_run_page", "write_sweep_page"]
