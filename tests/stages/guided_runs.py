"""Runs of the simulate stage: a groom's file that holds nothing but guides, and a run that is taken up again."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipeline import cache
from pipeline.config.schema import Simulate
from pipeline.simulate import stage
from pipeline.simulate.stepper import Guides, Simulation

Saved = dict[str, NDArray[np.generic]]


def experiment_with_groom(folder: Path, guides: Guides) -> cache.Experiment:
    """An experiment whose groom has these guides and no other strands."""
    experiment = cache.Experiment(folder)
    with cache.create(experiment.groom, kind="groom", key="groom") as writer:
        writer.write("strands/points", guides.points)
        writer.write("strands/held", guides.held)
        writer.write("guides/strand", np.arange(len(guides.points), dtype=np.uint32))
        writer.write("guides/offset", guides.offset)
    return experiment


def simulated(simulate: Simulate, guides: Guides) -> list[cache.Frame]:
    """All frames."""
    return interrupted(simulate, guides, simulate.frames)[0]


def interrupted(simulate: Simulate, guides: Guides, after: int) -> tuple[list[cache.Frame], Saved]:
    """All frames, and what the simulation saves after so many of them."""
    simulation = Simulation(simulate, 3, guides)
    simulation.settle()
    frames, saved = [], {}
    for frame in stage.run(simulation):
        frames.append(frame)
        if len(frames) == after:
            saved = {name: array.copy() for name, array in simulation.save().items()}
    return frames, saved


def resumed(simulate: Simulate, guides: Guides, after: int, saved: Saved) -> list[cache.Frame]:
    """The frames after those, by a simulation that begins with what was saved."""
    simulation = Simulation(simulate, 3, guides)
    simulation.restore(saved)
    return list(stage.run(simulation, start=after))
