"""Pictures of what a validation measured, one for a law; drawn when matplotlib is installed (extra `plots`)."""

from collections.abc import Callable, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.cache import replacing
from pipeline.errors import InputError
from pipeline.validation.case import CaseResult, Model
from pipeline.validation.curls import BEND_TWIST
from pipeline.validation.statics import CANTILEVER, TIP_LOAD

COLOURS: dict[Model, str] = {
    "kirchhoff": "#1b6ca8",
    "rotor": "#c0392b",
    "frenet": "#e08e0b",
    "none": "#5f6a6a",
}
_MARKS: dict[Model, tuple[str, int]] = {
    "kirchhoff": ("o", 11),
    "rotor": ("s", 8),
    "frenet": ("^", 6),
    "none": (".", 5),
}


def need_matplotlib(command: str = "ringlet validate") -> None:
    """Raise InputError when matplotlib is missing."""
    if find_spec("matplotlib") is None:
        raise InputError(f'{command}: pictures need matplotlib: pip install "ringlet[plots]"')


def draw(results: Sequence[CaseResult], folder: Path) -> dict[str, str]:
    """Draw a picture for every law that has one; their file names in the folder. Raises InputError as above."""
    need_matplotlib()
    from matplotlib.figure import Figure

    folder.mkdir(parents=True, exist_ok=True)
    drawn = {}
    for name, paint in _PICTURES.items():
        found = [result for result in results if result.name == name and result.outcome.curves]
        if found:
            figure = Figure(figsize=(8, 4), dpi=100, layout="constrained")
            paint(figure, found)
            drawn[name] = name.replace(" ", "_") + ".png"
            with replacing(folder / drawn[name]) as temporary:
                figure.savefig(temporary, format="png", metadata={"Software": None})
    return drawn


def _points(axes: Any, result: CaseResult, x: str, y: str, label: str = "") -> None:
    mark, size = _MARKS[result.model]
    curves, colour = result.outcome.curves, COLOURS[result.model]
    axes.plot(curves[x], curves[y], mark, ms=size, mfc="none", mec=colour, mew=1.4, label=label)


def _legend(axes: Any, **labels: Any) -> None:
    axes.set(**labels)
    axes.grid(alpha=0.25)
    axes.legend(frameon=False, fontsize="small")


def _legend_below(figure: Any, axes: Any, columns: int) -> None:
    figure.legend(
        *axes.get_legend_handles_labels(),
        loc="outside lower center",
        ncols=columns,
        frameon=False,
        fontsize="x-small",
    )


def _cantilever(figure: Any, results: Sequence[CaseResult]) -> None:
    axes = figure.add_subplot()
    gammas, ratios = [*CANTILEVER], [*CANTILEVER.values()]
    fine = np.geomspace(gammas[0], gammas[-1], 200)
    line = np.exp(np.interp(np.log(fine), np.log(gammas), np.log(ratios)))
    axes.loglog(fine, line, color="black", lw=1, label="rod equations")
    for result in results:
        _points(axes, result, "gamma", "ratio", result.model)
    _legend(axes, xlabel="Γ = w L³/B", ylabel="H/W", title="Drooping cantilever: drop over reach of the tip")


def _order(figure: Any, results: Sequence[CaseResult]) -> None:
    axes = figure.add_subplot()
    for result in results:
        curves = result.outcome.curves
        for name in curves:
            if name != "points":
                _points(axes, result, "points", name, result.model if name == "Gamma 10" else "")
    points = results[0].outcome.curves["points"]
    for name, error in results[0].outcome.curves.items():
        if name != "points":
            slope = error[-1] * ((points - 1.5) / (points[-1] - 1.5)) ** -2.0
            axes.plot(points, slope, color="black", lw=0.8)
            axes.annotate(
                name, (points[-1], error[-1]), xytext=(8, -3), textcoords="offset points", fontsize="small"
            )
    axes.set(xscale="log", yscale="log")
    axes.set_xticks(points, [f"{p:g}" for p in points], minor=False)
    axes.minorticks_off()
    _legend(
        axes,
        xlabel="points",
        ylabel="error of H/W",
        title="Cantilever: second order (lines)",
        xlim=(None, points[-1] * 1.35),
    )


def _tip_loads(figure: Any, results: Sequence[CaseResult]) -> None:
    axes = figure.add_subplot()
    loads = [*TIP_LOAD]
    for index, what in enumerate(("drop", "reach")):
        axes.plot(
            loads,
            [pair[index] for pair in TIP_LOAD.values()],
            "x-",
            color="black",
            lw=0.8,
            label="" if index else "elliptic integrals",
        )
        for result in results:
            _points(axes, result, "load", what, "" if index else result.model)
    axes.annotate("reach/L", (2, 0.86))
    axes.annotate("drop/L", (2, 0.40))
    _legend(axes, xlabel="P L²/B", ylabel="tip", title="Cantilever with a load at its tip")


def _bend_twist(figure: Any, results: Sequence[CaseResult]) -> None:
    for column, (result, axes) in enumerate(
        zip(results, figure.subplots(1, len(results), sharey=True, squeeze=False)[0], strict=True)
    ):
        curves = result.outcome.curves
        for gamma, aside in zip(curves["gamma"], curves["aside"], strict=True):
            out = aside > 1e-3
            axes.plot(curves["x"][out], np.full(out.sum(), gamma), "o", ms=4, color=COLOURS[result.model])
            axes.plot(
                curves["x"][~out],
                np.full((~out).sum(), gamma),
                "o",
                ms=4,
                mfc="none",
                mec=COLOURS[result.model],
            )
        axes.plot([*BEND_TWIST.values()], [*BEND_TWIST], "k--", lw=1)
        axes.set(yscale="log", xlabel="x = Γ^(1/3)/(κₙL)", title=result.model, ylabel="" if column else "Γ")
    figure.suptitle(
        "Hanging curls: out of the plane (full) or in it (open); rod equations dashed", fontsize="medium"
    )


def _energy(figure: Any, results: Sequence[CaseResult]) -> None:
    titles = [*results[0].outcome.curves]
    for column, (title, axes) in enumerate(
        zip(titles, figure.subplots(1, len(titles), sharey=True, squeeze=False)[0], strict=True)
    ):
        time, bending, torsion, kinetic, gravity, _ = results[0].outcome.curves[title]
        for values, label, colour in (
            (kinetic, "kinetic", "#7f8c8d"),
            (bending + torsion, "elastic", "#27ae60"),
            (gravity, "weight", "#8e44ad"),
        ):
            axes.plot(time, values, color=colour, lw=1, label=label)
        for result in results:
            curve = result.outcome.curves[title]
            axes.plot(curve[0], curve[5], color=COLOURS[result.model], lw=1.6, label=f"sum, {result.model}")
        axes.set(xlabel="time [s]", title=title, ylabel="" if column else "energy / largest kinetic energy")
        axes.title.set_fontsize("medium")
        axes.grid(alpha=0.25)
    _legend_below(figure, axes, columns=7)


def _vibration(figure: Any, results: Sequence[CaseResult]) -> None:
    names = [*results[0].outcome.curves]
    for name, axes in zip(
        names, figure.subplots(len(names), 1, sharex=True, squeeze=False)[:, 0], strict=True
    ):
        for result in results:
            time, height = result.outcome.curves[name]
            axes.plot(time, height, color=COLOURS[result.model], lw=1, label=result.model)
        axes.plot(time, np.cos(2 * np.pi * time), "k:", lw=1, label="Euler & Bernoulli")
        axes.set(ylabel="tip height", title=name)
        axes.grid(alpha=0.25)
    axes.set(xlabel="time [periods of the reference]")
    _legend_below(figure, axes, columns=5)


def _push(figure: Any, results: Sequence[CaseResult]) -> None:
    left, right = figure.subplots(1, 2)
    for result in results:
        time, shortening, load, energy = result.outcome.curves["push"]
        left.plot(100 * shortening, load, color=COLOURS[result.model], lw=1.4, label=result.model)
        right.plot(time, energy, color=COLOURS[result.model], lw=1.4, label=result.model)
    left.axhline(20.19, color="black", ls="--", lw=1, label="Euler, 20.19")
    _legend(left, xlabel="shortening [%]", ylabel="P L²/B", title="Load")
    _legend(right, xlabel="time [s]", ylabel="E L/B", title="Bending energy")


_PICTURES: dict[str, Callable[[Any, Sequence[CaseResult]], None]] = {
    "cantilever": _cantilever,
    "cantilever order": _order,
    "cantilever tip load": _tip_loads,
    "bend-twist": _bend_twist,
    "energy of an undamped swing": _energy,
    "vibration": _vibration,
    "buckling under compression": _push,
}
