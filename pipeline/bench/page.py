"""What the benchmarks found as a Markdown page, and as JSON beside it."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pipeline.bench.performance import Figures, Section
from pipeline.cache import replacing

_HEAD = """\
# Performance

What `ringlet bench page{option}` measured; this page is written by `make performance`, and [performance.json]({json}) beside it holds every figure.
Each command ran alone, in a process of its own, and repeats its row.

| | |
|---|---|
"""
_MACHINE = {
    "processor": "processor",
    "processors": "processors used",
    "instruction_set": "instruction set of the kernels",
    "peak_gflops_float32": "peak of one processor, float32 [GFLOP/s]",
    "peak_gflops_float64": "peak of one processor, float64 [GFLOP/s]",
    "memory_gb": "memory [GB]",
    "system": "system",
    "python": "Python",
    "numpy": "NumPy",
    "vtk": "VTK",
    "ringlet": "ringlet",
    "date": "date",
    "load_before": "load average before",
}
_PARTS = ("part_of_peak",)  # told in per cent


def write_page(report: Figures, tables: Sequence[Section], path: Path) -> Path:
    """Write the page and, with the suffix .json, the report; returns the path of the latter."""
    beside = path.with_suffix(".json")
    option = " --quick" if report["quick"] else ""
    machine = "".join(f"| {text} | {_cell(report['machine'][name])} |\n" for name, text in _MACHINE.items())
    parts = [_HEAD.format(option=option, json=beside.name) + machine]
    found = {measured["command"]: measured["figures"] for measured in report["measured"]}
    parts += [_table(table, found) for table in tables]
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as temporary:
        temporary.write_text("\n".join(parts), encoding="utf-8")
    with replacing(beside) as temporary:
        temporary.write_text(json.dumps(report, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
    return beside


def _table(table: Section, found: dict[str, Figures]) -> str:
    own = len(table.tasks) > 1  # a command for each row
    head = ["", *table.columns.values(), *(["command"] if own else [])]
    lines = [f"## {table.title}\n", table.about, ""]
    if not own:
        lines += [f"    {table.tasks[0].command}", ""]
    lines += [_line(head), _line(["---"] * len(head))]
    for task in table.tasks:
        for what, figures in task.unfold(found[task.command]):
            cells = [_cell(figures.get(name), name) for name in table.columns]
            lines.append(_line([what or task.what, *cells, *([f"`{task.command}`"] if own else [])]))
    return "\n".join([*lines, ""])


def _line(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"


def _cell(value: Any, name: str = "") -> str:
    if value is None:
        return ""
    if name in _PARTS:
        return f"{100 * value:.1f} %"
    if isinstance(value, float):
        return f"{value:.4g}"
    return f"{value:,}" if isinstance(value, int) else str(value)
