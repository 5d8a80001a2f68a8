"""What a run was like, from the figures of its frames in guides.h5: log lines, and outputs/<name>/diagnostics.png.

Energies over time; strain and penetration beside what they may be; contacts and iterations. The picture is drawn when
matplotlib is installed (extra `plots`).
"""

from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.cache import replacing
from pipeline.config.schema import Simulate
from pipeline.progress import say

PENETRATION_LIMIT = 1e-4  # [m] below its contact offset; what a frame shows of less is nothing

_ENERGIES = {"bending": "#c0392b", "torsion": "#2471a3", "kinetic": "#7f8c8d", "gravity": "#8e44ad"}
_SNAP = 0.04  # part of the largest elastic energy that a collapse frees within two frames
_CALM = 1e-9  # [J] elastic energy in which nothing collapses

Figures = Mapping[str, NDArray[np.floating]]


def lines(figures: Figures, simulate: Simulate) -> list[str]:
    """The run in words: (F,) figures of the frames."""
    worst = {name: float(np.max(values)) for name, values in figures.items()}
    said = [
        f"worst strain {worst['strain']:.1e} (tolerance {simulate.tolerance:.0e}), "
        f"penetration {1e3 * worst['penetration']:.3f} mm, {worst['contacts']:.0f} contacts at most",
        f"relaxation by {simulate.relaxation}: {np.mean(figures['rounds']):.2f} rounds a step, "
        f"{worst['rounds_worst']:.0f} at most; {np.mean(figures['solves']):.2f} solves a step, "
        f"{np.sum(figures['halvings']):.0f} steps halved",
    ]
    snaps = collapses(figures) / simulate.fps
    if len(snaps) and driven(simulate):
        first = f"; the first at {snaps[0]:.2f} s" + _shortening(simulate, snaps[0])
        said.append(f"{len(snaps)} sudden collapse{'' if len(snaps) == 1 else 's'}{first}")
    return said


def driven(simulate: Simulate) -> bool:
    """Whether tips are moved, so that strands are pulled and compressed."""
    return len(simulate.tips) > 1


def collapses(figures: Figures) -> NDArray[np.intp]:
    """Frames after which elastic energy is set free at once: it falls within two frames by a part of its largest value."""
    elastic = np.asarray(figures["bending"]) + np.asarray(figures["torsion"])
    if len(elastic) < 3 or elastic.max() < _CALM:
        return np.zeros(0, np.intp)
    sudden = elastic[:-2] - elastic[2:] > _SNAP * elastic.max()
    return np.flatnonzero(sudden & ~np.concatenate([[False], sudden[:-1]]))


def draw(path: Path, figures: Figures, simulate: Simulate) -> bool:
    """Draw the picture of a run, (F,) figures of its frames; False when matplotlib is missing."""
    if find_spec("matplotlib") is None:
        say("simulate", f'{path.name} is not drawn without matplotlib: pip install "ringlet[plots]"')
        return False
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8, 8), dpi=110, layout="constrained")
    top, middle, bottom = figure.subplots(3, 1, sharex=True, height_ratios=(2, 1, 1))
    time = np.arange(len(figures["bending"])) / simulate.fps
    _energies(top, time, figures, simulate)
    _limits(middle, time, figures, simulate)
    _work(bottom, time, figures)
    with replacing(path) as temporary:
        figure.savefig(temporary, format="png", metadata={"Software": None})
    return True


def _energies(axes: Any, time: NDArray[np.floating], figures: Figures, simulate: Simulate) -> None:
    weighty = any(simulate.gravity)
    for name, colour in _ENERGIES.items():
        energy = np.asarray(figures[name]) * 1e6
        if name == "gravity":
            energy = energy - energy[0]
        if weighty or name != "gravity":
            label = {"gravity": "gravity, from the first frame", "torsion": _twist(simulate)}.get(name, name)
            axes.plot(time, energy, color=colour, label=label, linewidth=1.6)
    if driven(simulate):
        for index, frame in enumerate(collapses(figures)):
            note = "" if index else f"collapse{_shortening(simulate, time[frame])}"
            axes.axvline(time[frame], color="black", linestyle=":", linewidth=1, label=note)
    axes.set(ylabel="energy [µJ]", title="Energy of the guides")
    axes.grid(alpha=0.25)
    axes.legend(frameon=False, fontsize="small")


def _twist(simulate: Simulate) -> str:
    return "twist" if simulate.torsion == "kirchhoff" else "torsion"


def _limits(axes: Any, time: NDArray[np.floating], figures: Figures, simulate: Simulate) -> None:
    strain = np.asarray(figures["strain"]) / simulate.tolerance
    depth = np.asarray(figures["penetration"]) / PENETRATION_LIMIT
    axes.plot(time, strain, color="#16a085", linewidth=1.2, label=f"strain / {simulate.tolerance:.0e}")
    if depth.any():
        axes.plot(time, depth, color="#d35400", linewidth=1.2, label="penetration / 0.1 mm")
    axes.axhline(1, color="black", linestyle="--", linewidth=0.8)
    axes.set(ylabel="worst / limit", ylim=(0, None))
    axes.grid(alpha=0.25)
    axes.legend(frameon=False, fontsize="small")


def _work(axes: Any, time: NDArray[np.floating], figures: Figures) -> None:
    names = {
        "rounds": "rounds, mean",
        "rounds_worst": "rounds, worst",
        "solves": "solves",
        "halvings": "halved",
    }
    for (name, label), colour in zip(
        names.items(), ("#2c3e50", "#95a5a6", "#27ae60", "#c0392b"), strict=True
    ):
        if name == "rounds" or np.any(figures[name]):
            axes.plot(time, figures[name], color=colour, linewidth=1.2, label=label)
    axes.set(xlabel="time [s]", ylabel="a step (halved: a frame)", ylim=(0, None))
    axes.grid(alpha=0.25)
    axes.legend(frameon=False, fontsize="small", loc="upper left")
    if np.any(figures["contacts"]):
        right = axes.twinx()
        right.plot(time, figures["contacts"], color="#8e44ad", linewidth=1.2, label="contacts")
        right.set(ylabel="points in contact", ylim=(0, None))
        right.legend(frameon=False, fontsize="small", loc="upper right")


def _shortening(simulate: Simulate, time: float) -> str:
    """How far the tips have been moved by then, in words."""
    times = [key.time for key in simulate.tips]
    moved = [
        float(np.linalg.norm(np.subtract(key.position, simulate.tips[0].position))) for key in simulate.tips
    ]
    return f", tips moved by about {100 * float(np.interp(time, times, moved)):.1f} cm"
