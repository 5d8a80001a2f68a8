"""Energies over time as a picture: outputs/<name>/energy.png, drawn when matplotlib is installed (extra `plots`)."""

from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipeline.cache import replacing
from pipeline.progress import say

_LINES = {
    "bending": ("bending", "#c0392b"),
    "torsion": ("torsion", "#2471a3"),
    "kinetic": ("kinetic", "#7f8c8d"),
}
_MICROJOULE = 1e-6


def draw_energies(path: Path, diagnostics: Mapping[str, NDArray[np.floating]], fps: float) -> bool:
    """Draw bending, torsion and kinetic energy, (F,) [J] each, over time; False when matplotlib is missing."""
    if find_spec("matplotlib") is None:
        say("simulate", f'{path.name} is not drawn without matplotlib: pip install "ringlet[plots]"')
        return False
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8, 4.5), dpi=120, layout="constrained")
    axes = figure.add_subplot()
    for name, (label, colour) in _LINES.items():
        energy = np.asarray(diagnostics[name]) / _MICROJOULE
        axes.plot(np.arange(len(energy)) / fps, energy, color=colour, label=label, linewidth=1.8)
    axes.set(xlabel="time [s]", ylabel="energy [µJ]", ylim=(0, None), title="Energy of the guides")
    axes.grid(alpha=0.25)
    axes.legend(frameon=False)
    with replacing(path) as temporary:
        figure.savefig(temporary, format="png", metadata={"Software": None})
    return True
