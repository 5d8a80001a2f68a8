"""The results of a validation as rows, as a sentence, and as a Markdown page with pictures."""

import math
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pipeline.cache import replacing
from pipeline.validation.case import CaseResult, Verdict
from pipeline.validation.plots import draw

_HEAD = """\
# Validation

What `ringlet validate{option}` measured; this page is written by `make validate`. Each law runs with every torsion model to which it
applies. Planar laws hold for all; those in which a strand bends and twists need the material frames of `kirchhoff`. Where a model
cannot meet a law, its figures are shown all the same, with the reason.

The test hair is that of Romero et al., *Physical validation of simulators in computer graphics* (2021), and of Daviet,
*Interactive hair simulation on the GPU using ADMM* (2023): radius 50 µm, 1300 kg/m³, E = 3 GPa, ν = 0.45, everything in float64. w is the
weight per length, B = EI, C = GJ, Γ = w L³/B; L counts from the clamp, the middle of segment 0.

**{summary}**
"""
_SIGNS: dict[Verdict, str] = {
    "met": "met",
    "NOT MET": "**NOT MET**",
    "not met (expected)": "not met (expected)",
    "met, not expected": "**met, not expected**",
}


def rows(results: Sequence[CaseResult]) -> list[dict[str, Any]]:
    """One row for each reading."""
    return [
        {
            "name": result.name,
            "model": result.model,
            "what": reading.what,
            "measured": reading.measured,
            "reference": reading.reference,
            "error": reading.error,
            "tolerance": reading.tolerance,
            "verdict": result.verdict(reading),
            "reason": result.unmet,
        }
        for result in results
        for reading in result.outcome.readings
    ]


def summary(results: Sequence[CaseResult]) -> str:
    """How many readings have which verdict; which cases do better than they were said to."""
    counts = Counter(result.verdict(reading) for result in results for reading in result.outcome.readings)
    parts = [f"{counts[verdict]} {verdict}" for verdict in _SIGNS if counts[verdict]]
    better = [
        f"{r.name}, {r.model}" for r in results if r.unmet and all(x.passed for x in r.outcome.readings)
    ]
    note = f"; no longer unmet, remove the mark: {'; '.join(better)}" if better else ""
    return f"{len(results)} cases, {sum(counts.values())} figures: {', '.join(parts)}{note}."


def write_page(results: Sequence[CaseResult], path: Path, quick: bool) -> None:
    """Write the page, and its pictures to pictures/<name of the page>/ beside it."""
    from pipeline.validation import all_laws

    folder = path.parent / "pictures" / path.stem
    pictures = draw(results, folder)
    parts = [_HEAD.format(option=" --quick" if quick else "", summary=summary(results))]
    for law in all_laws():
        found = [result for result in results if result.name == law.name]
        if found:
            parts.append(f"## {law.name[0].upper()}{law.name[1:]}\n\n{law.about}\n")
            if law.name in pictures:
                parts.append(f"![{law.name}](pictures/{path.stem}/{pictures[law.name]})\n")
            parts.append(_section(found))
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as temporary:
        temporary.write_text("\n".join(parts), "utf-8")


def _section(results: Sequence[CaseResult]) -> str:
    lines = ["| model | what | measured | reference | error | tolerance | |", "|---|---|---|---|---|---|---|"]
    for result in results:
        for reading in result.outcome.readings:
            cells = [result.model, reading.what, _number(reading.measured), _number(reading.reference)]
            cells += [
                _percent(reading.error, reading.reference),
                _percent(reading.tolerance, reading.reference),
            ]
            lines.append(f"| {' | '.join(cells)} | {_SIGNS[result.verdict(reading)]} |")
    reasons = [f"* {result.model}: {result.unmet}." for result in results if result.unmet]
    return "\n".join([*lines, *(["", *reasons] if reasons else []), ""])


def _number(value: float) -> str:
    if not math.isfinite(value):
        return "none"
    return f"{value:.6g}" if abs(value) >= 1e-4 or value == 0 else f"{value:.1e}"


def _percent(value: float, reference: float) -> str:
    if not math.isfinite(value):
        return "none"
    return f"{100 * value:.2g} %" if reference else f"{value:.1e}"
