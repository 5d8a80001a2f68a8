"""Which stages are fresh, why the others are not, and how they are made."""

import importlib
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from pipeline import cache
from pipeline.config import STAGES, Config, explain, stage_inputs, stage_keys
from pipeline.progress import say

NEEDS = {
    "groom": (),
    "simulate": ("groom",),
    "interpolate": ("groom",),
    "render": ("groom", "simulate", "interpolate"),
}
KINDS = {"groom": "groom", "simulate": cache.guides.KIND, "interpolate": "strands"}


@dataclass(frozen=True)
class State:
    """Whether a stage's output fits the config; if not, the reason in a sentence."""

    name: str
    fresh: bool
    reason: str


Frames = tuple[int, int] | None


class Batch:
    """The stages of one config in one folder."""

    def __init__(self, config: Config, experiment: cache.Experiment) -> None:
        self.config, self.experiment = config, experiment
        self.keys, self.inputs = stage_keys(config), stage_inputs(config)

    def states(self) -> list[State]:
        """Examine every stage, in order; every file is read whole and verified."""
        return [self.state(stage) for stage in STAGES]

    def state(self, stage: str, frames: Frames = None) -> State:
        """Examine one stage; of the render, all frames or those from one number to another."""
        if stage == "render":
            return self._frames_state(frames)
        path = self.file(stage)
        try:
            with cache.open(path, KINDS[stage]) as reader:
                if reader.key == self.keys[stage]:
                    reader.verify()
                    return State(stage, True, "fresh")
                return State(stage, False, self._why(stage, reader.provenance.get("inputs", {})))
        except cache.Missing:
            return State(stage, False, "not made yet")
        except cache.Damaged as error:
            return State(stage, False, str(error))

    def make(self, stage: str, frames: Frames = None, touch: bool = True) -> None:
        """Make one stage whose inputs are there, unless it is fresh.

        What is fresh gets the current time, so that make, which compares times, does not ask again.
        """
        state = self.state(stage, frames)
        if not state.fresh:
            with self.experiment.working_on(stage):
                state = self.state(stage, frames)  # another process may just have made it
                if not state.fresh:
                    say(stage, f"start ({state.reason})")
                    self._execute(stage, frames)
                    return
        say(stage, "fresh")
        if touch:
            for path in self.outputs(stage, frames):
                os.utime(path)

    def file(self, stage: str) -> Path:
        """Return the file that a stage leaves; the render leaves a folder."""
        folder = self.experiment
        files = {
            "groom": folder.groom,
            "simulate": folder.guides,
            "interpolate": folder.strands,
            "render": folder.frames,
        }
        return files[stage]

    def outputs(self, stage: str, frames: Frames = None) -> list[Path]:
        """List the files that a stage leaves."""
        if stage != "render":
            return [self.file(stage)]
        first, last = frames or (1, self.config.simulate.frames)
        return [self.experiment.frames / f"{number:04d}.png" for number in range(first, last + 1)]

    def _execute(self, stage: str, frames: Frames) -> None:
        execute: Callable[..., None] = importlib.import_module(f"pipeline.{stage}.stage").execute
        if stage == "render" and frames is not None:
            execute(self.config, self.experiment, self.keys[stage], frames=frames)
        else:
            execute(self.config, self.experiment, self.keys[stage])

    def _why(self, stage: str, before: dict[str, object]) -> str:
        return "; ".join(explain(before, self.inputs[stage])) or "its key changed"

    def _frames_state(self, frames: Frames) -> State:
        paths = self.outputs("render", frames)
        missing, others = 0, {}
        for path in paths:
            try:
                key, record = cache.picture_record(path)
                if key != self.keys["render"]:
                    others[self._why("render", record.get("inputs", {}))] = path
            except cache.Missing:
                missing += 1
            except cache.Damaged as error:
                others[str(error)] = path
        reasons = list(others)[:3]
        if missing:
            some = "none" if missing == len(paths) else f"{len(paths) - missing}"
            reasons.append(f"{some} of {len(paths)} frames made yet")
        return State("render", not reasons, "; ".join(reasons) or "fresh")
