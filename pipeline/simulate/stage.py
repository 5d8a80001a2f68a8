"""Stage 2, the guides in motion: reads groom.h5, writes guides.h5, goes on from the last checkpoint."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline import cache
from pipeline.cache.expansion import body_frames, distance_field, placement
from pipeline.config import Config, provenance
from pipeline.progress import say, track
from pipeline.simulate.diagnostics import draw, lines
from pipeline.simulate.sag_free import tip_drift
from pipeline.simulate.stepper import Guides, Simulation, SimulationDiverged

CHECKPOINT_FRAMES = 8


def execute(config: Config, experiment: cache.Experiment, key: str) -> None:
    """Simulate the guides of groom.h5 and write guides.h5; a run that was killed goes on bit by bit.

    Raises SimulationDiverged, Missing or Damaged (all InputErrors).
    """
    guides, strand = read_guides(experiment)
    simulation = Simulation(config.simulate, config.seed, guides)
    jumps = [1 + round(start * config.simulate.fps) for start in simulation.head.starts[1:]]
    if jumps:
        say("simulate", f"the head jumps at frame {', '.join(map(str, jumps))}; hair is carried along")
    segments = cache.Segments(experiment.guides, key)
    kept = experiment.folder / "diverged.h5"
    kept.unlink(missing_ok=True)
    try:
        _fill(segments, simulation)
    except SimulationDiverged as error:
        _keep(simulation, kept, key)
        detail = f" (strand {strand[error.guide]} of the groom; its state is in {kept})"
        raise SimulationDiverged(error.guide, error.frame, detail) from error
    record = {"sag_free": _sag_free(simulation, segments, guides)} if simulation.sag_free else {}
    segments.merge(provenance(config, "simulate") | record, config.simulate.fps)
    with cache.open_guides(experiment.guides) as written:
        for line in lines(written.diagnostics, config.simulate):
            say("simulate", line)
        draw(experiment.folder / "diagnostics.png", written.diagnostics, config.simulate)


def run(simulation: Simulation, start: int = 0) -> Iterator[cache.Frame]:
    """Yield the frames from `start` on; the simulation stands at the frame before it, or at the first one."""
    for index in range(start, simulation.simulate.frames):
        if index > 0:
            simulation.next_frame()
        yield simulation.frame()


def read_guides(experiment: cache.Experiment) -> tuple[Guides, NDArray[np.uint32]]:
    """The guides of groom.h5 and the strands that they are, (G,) uint32."""
    with cache.open(experiment.groom, kind="groom") as groom:
        strand = groom["guides/strand"][:]
        guides = Guides(
            points=groom["strands/points"][strand],
            held=groom["strands/held"][strand],
            offset=groom["guides/offset"][:],
            field=distance_field(groom),
            body=body_frames(groom),
            head=placement(groom),
            strands=len(groom["strands/points"]),
        )
    return guides, strand


def _fill(segments: cache.Segments, simulation: Simulation) -> None:
    done, saved = segments.resume()
    if saved is not None:
        simulation.restore(saved)
        say("simulate", f"going on after frame {done}")
    else:
        with track("settle", simulation.settling_steps, "step") as bar:
            simulation.settle(bar.advance)
    frames: list[cache.Frame] = []
    with track("simulate", simulation.simulate.frames - done) as bar:
        for index, frame in enumerate(run(simulation, done), start=done + 1):
            frames.append(frame)
            bar.advance()
            if len(frames) == CHECKPOINT_FRAMES or index == simulation.simulate.frames:
                segments.append(frames, simulation.save())
                frames = []
    if simulation.neighbours is not None:
        say("simulate", simulation.cost.line(simulation.simulate.hair_contact.method))


def _sag_free(simulation: Simulation, segments: cache.Segments, guides: Guides) -> dict[str, Any]:
    """What it took to hold the groom, and how far the tips have drifted from it at the first frame."""
    first = next(segments.frames())
    drift = float(tip_drift(guides.points, first.points, first.pose).max(initial=0.0))
    report = simulation.sag_free
    assert report is not None
    for line in report.lines():
        say("simulate", line)
    say(
        "simulate",
        f"sag-free: after {simulation.simulate.settle:g} s tips are off by {100 * drift:.2g} % of length",
    )
    return report.record() | {"drift": drift, "drift_after_s": simulation.simulate.settle}


def _keep(simulation: Simulation, path: Path, key: str) -> None:
    with cache.create(path, kind="state", key=key) as writer:
        for name, array in simulation.save().items():
            writer.write(name, array)
