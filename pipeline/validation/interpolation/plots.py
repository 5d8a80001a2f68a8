"""Pictures of the report; drawn when matplotlib is installed (extra `plots`)."""

from pathlib import Path
from typing import Any

import numpy as np

from pipeline.cache import replacing
from pipeline.validation.interpolation.report import CHOICES, METHODS, OURS, Report
from pipeline.validation.plots import need_matplotlib

_COLOURS = ("#1b6ca8", "#e08e0b", "#5f6a6a", "#c0392b", "#2e8b57")
_LINES = {"none": "--", "grid": "-"}


def draw(report: Report, folder: Path) -> None:
    """Draw methods.png and guides.png into a folder. Raises InputError when matplotlib is missing."""
    need_matplotlib("ringlet bench interpolation-error")
    from matplotlib.figure import Figure

    folder.mkdir(parents=True, exist_ok=True)
    for name, paint, height in (("methods", _methods, 4.0), ("guides", _guides, 5.5)):
        figure = Figure(figsize=(9, height), dpi=100, layout="constrained")
        paint(figure, report)
        with replacing(folder / f"{name}.png") as temporary:
            figure.savefig(temporary, format="png", metadata={"Software": None})


def _methods(figure: Any, report: Report) -> None:
    axes = figure.add_subplot()
    kinds, count = [kind.name for kind in report.plan.kinds], report.plan.guides[-1]
    width = 0.8 / len(METHODS)
    for i, (method, colour) in enumerate(zip(METHODS, _COLOURS, strict=True)):
        rows = report.find(choice="ours", hair_on_hair="none", guides=count, method=method)
        at = np.arange(len(kinds)) + (i - (len(METHODS) - 1) / 2) * width
        axes.bar(at, [100 * row.error.mean for row in rows], width, color=colour, label=method)
    axes.set_xticks(np.arange(len(kinds)), [name.replace(", ", "\n") for name in kinds], fontsize="small")
    axes.set(ylabel="mean error [% of length]", title=f"{count:,} guides of {report.plan.strands:,} strands")
    axes.legend(frameon=False, fontsize="small")
    axes.grid(alpha=0.25, axis="y")


def _guides(figure: Any, report: Report) -> None:
    kinds = report.plan.kinds
    columns = min(4, len(kinds))
    grid = figure.subplots(
        -(-len(kinds) // columns), columns, sharex=True, sharey=True, squeeze=False
    ).ravel()
    for axes, kind in zip(grid, kinds, strict=False):
        for hair, line in _LINES.items():
            for choice, colour in zip(CHOICES if hair == "none" else CHOICES[:1], _COLOURS, strict=False):
                rows = report.find(groom=kind.name, hair_on_hair=hair, choice=choice, method=OURS)
                errors = [100 * row.error.mean for row in rows]
                label = f"{choice}, {'hair on hair' if hair == 'grid' else 'without'}"
                axes.loglog(report.plan.guides, errors, line, marker="o", ms=3, color=colour, label=label)
        axes.set_title(kind.name, fontsize="small")
        axes.set_xlabel("guides", fontsize="x-small")
        axes.set_xticks(report.plan.guides, [f"{count}" for count in report.plan.guides], fontsize="x-small")
        axes.yaxis.set_major_formatter("{x:g}")
        axes.yaxis.set_minor_formatter("{x:g}")
        axes.tick_params(axis="y", which="both", labelsize="x-small")
        axes.xaxis.minorticks_off()
        axes.grid(alpha=0.25, which="both")
    for axes in grid[len(kinds) :]:
        axes.set_axis_off()
    grid[0].set_ylabel("mean error [% of length]")
    handles = grid[0].get_legend_handles_labels()
    figure.legend(*handles, loc="outside lower center", ncols=4, frameon=False, fontsize="small")
