"""What a run says about itself: figures of every frame, log lines, and where a strand gave way."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from pipeline import cache
from pipeline.config.schema import Config, Keyframe, Simulate
from pipeline.simulate import stage
from pipeline.simulate.diagnostics import collapses, draw, lines

FRAMES = 6
FIGURES = {
    "bending", "torsion", "kinetic", "gravity",
    "strain", "penetration", "contacts", "rounds", "rounds_worst", "solves", "halvings",
}  # fmt: skip


def run(folder: Path, relaxation: str, points: int = 16) -> dict[str, NDArray[np.float64]]:
    simulate = {"frames": FRAMES, "settle": 0.0, "substeps": 4, "relaxation": relaxation, "rest": "groom"}
    config = Config(name="a", scene={"head": "none"}, groom={"source": "swatch"}, simulate=simulate)
    experiment = cache.Experiment(folder)
    strands = np.zeros((2, points, 3), np.float32)
    strands[..., 0] = np.linspace(0, 0.2, points)
    with cache.create(experiment.groom, kind="groom", key="groom") as writer:
        writer.write("strands/points", strands)
        writer.write("strands/held", np.tile((np.arange(points) < 2).astype(np.uint8), (2, 1)))
        writer.write("guides/strand", np.arange(2, dtype=np.uint32))
        writer.write("guides/offset", np.zeros((2, points), np.float32))
    stage.execute(config, experiment, "key")
    with cache.open_guides(experiment.guides) as written:
        return dict(written.diagnostics)


@pytest.mark.parametrize("relaxation", ["newton", "sweep"])
def test_every_frame_has_its_figures_and_the_log_its_iterations(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], relaxation: str
) -> None:
    figures = run(tmp_path, relaxation)
    logged = capsys.readouterr().err
    print(logged)
    assert set(figures) == FIGURES
    assert all(len(values) == FRAMES for values in figures.values())
    assert np.isfinite([*figures.values()]).all()
    assert figures["rounds_worst"].max() >= figures["rounds"].max() > 0
    assert figures["solves"][1:].min() >= 1
    assert f"relaxation by {relaxation}: {figures['rounds'].mean():.2f} rounds a step" in logged
    assert f"worst strain {figures['strain'].max():.1e}" in logged


def snapping() -> dict[str, NDArray[np.float64]]:
    """Elastic energy that grows over 12 frames and falls by a third of its largest value at the next, and nothing else."""
    figures = {name: np.zeros(24) for name in FIGURES}
    figures["bending"] = 1e-6 * np.where(np.arange(24) < 13, np.arange(24), np.arange(24) - 4.0)
    return figures


def test_a_sudden_fall_of_elastic_energy_is_a_collapse() -> None:
    figures = snapping()
    assert collapses(figures).tolist() == [11]
    figures["bending"] = np.sort(figures["bending"])
    assert collapses(figures).tolist() == []


def test_collapses_are_told_with_how_far_tips_were_moved() -> None:
    tips = (Keyframe(time=0.0), Keyframe(time=1.0, position=(0.0, 0.08, 0.0)))
    told = lines(snapping(), Simulate(tips=tips))
    print(told[-1])
    assert told[-1] == "1 sudden collapse; the first at 0.46 s, tips moved by about 3.7 cm"
    assert not any("collapse" in line for line in lines(snapping(), Simulate()))


def test_a_run_without_contacts_or_energies_is_drawn_all_the_same(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    assert draw(tmp_path / "a.png", {name: np.zeros(3) for name in FIGURES}, Simulate())
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")
