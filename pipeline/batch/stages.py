"""Which stages are fresh, why the others are not, and how they are made."""

import importlib
import os
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from pipeline import cache, log
from pipeline.config import STAGES, Config, explain, stage_inputs, stage_keys
from pipeline.progress import say

_KINDS = {"groom": "groom", "simulate": "guides", "interpolate": "strands"}
_REASONS_SHOWN = 3
_CHANGES_SHOWN = 6
_verified: dict[tuple[int, ...], str] = {}  # keys of files that this process has read whole


@dataclass(frozen=True)
class State:
    """Whether a stage's output fits the config; if not, why; of the render, also which frames do not."""

    name: str
    reason: str = "fresh"
    frames: tuple[int, ...] = ()

    @property
    def fresh(self) -> bool:
        return self.reason == "fresh"


class Batch:
    """The stages of one config in one folder. Frames are counted from 1."""

    def __init__(self, config: Config, experiment: cache.Experiment) -> None:
        self.config, self.experiment = config, experiment
        self.keys, self.inputs = stage_keys(config), stage_inputs(config)
        self.all_frames = range(1, config.simulate.frames + 1)
        self.sharing = cache.Sharing(experiment)

    def states(self) -> list[State]:
        """Examine every stage, in order; every file is read whole and verified."""
        return [self.state(stage) for stage in STAGES]

    def state(self, stage: str, frames: range | None = None) -> State:
        """Examine one stage; of the render, only some frames if they are given."""
        if stage == "render":
            return self._state_of_frames(frames or self.all_frames)
        return State(stage, self._why_stale(stage, self.file(stage)) or "fresh")

    def make(self, stage: str, frames: range | None = None, touch: bool = True) -> None:
        """Make one stage whose inputs are there, unless it is fresh.

        What is there gets the current time, so that make, which compares times, does not ask again.
        """
        state = self.state(stage, frames)
        if not state.fresh:
            with self.experiment.working_on(stage, frames):
                state = self.state(stage, frames)  # another process may just have made it
                if not state.fresh:
                    self._renew(stage, state)
        elif stage != "render":
            with cache.where_writable():
                self.sharing.note(self.keys[stage])
                self._tidy(stage)
        if touch and state.fresh:
            say(stage, "fresh")
        if touch:
            with cache.where_writable():
                for path in self.outputs(stage, frames):
                    _touch(path)

    def _tidy(self, stage: str) -> None:
        """Remove the segments of a simulation that was killed after its last frame, when they had been put together."""
        segments = cache.Segments(self.file("simulate"), self.keys["simulate"])
        if stage == "simulate" and segments.folder.exists() and not self.experiment.workers_on(stage):
            with self.experiment.working_on(stage):
                segments.remove()

    def _renew(self, stage: str, state: State) -> None:
        """Take the file from another experiment that has it, else make it."""
        if stage == "render":
            self._run(stage, state)
            return
        key = self.keys[stage]
        with self.sharing.making(stage, key):
            others = self.sharing.others(key)
            other = next((each for each in others if not self._why_stale(stage, each.files(stage)[0])), None)
            if other is None:
                self._run(stage, state)
            else:
                say(stage, f"the same as that of {other.folder.name}")
                self.sharing.take(stage, other)
            self.sharing.note(key)

    def _run(self, stage: str, state: State) -> None:
        key, start = self.keys[stage], time.monotonic()
        log.emit(
            stage, "begin", f"start ({state.reason})", key=key, reason=state.reason, frames=len(state.frames)
        )
        self.execute(stage, state.frames)
        seconds, peak = round(time.monotonic() - start, 3), round(log.peak_gb(), 3)
        log.emit(stage, "end", f"made in {seconds} s", key=key, seconds=seconds, peak_gb=peak)

    def seconds(self, stage: str) -> float | None:
        """How long it took to make a stage that is there, of the render all runs under its key.

        What the log tells; where it does not, how long the file was being written, None for frames.
        """
        records = [r for r in log.records(self.experiment.log) if r.get("key") == self.keys[stage]]
        ends = [record.get("seconds") for record in records if record.get("event") == "end"]
        spent = [seconds for seconds in ends if isinstance(seconds, int | float)]
        if spent:
            return round(float(sum(spent) if stage == "render" else spent[-1]), 3)
        if stage == "render":
            return None
        with cache.open(self.file(stage), _KINDS[stage]) as reader:
            return float(reader.provenance["wall_time_s"])

    def execute(self, stage: str, frames: tuple[int, ...]) -> None:
        """Run the code of a stage; of the render, for these frames."""
        execute: Callable[..., None] = importlib.import_module(f"pipeline.{stage}.stage").execute
        only = {"frames": frames} if stage == "render" else {}
        execute(self.config, self.experiment, self.keys[stage], **only)

    def file(self, stage: str) -> Path:
        """Return the file that a stage before the render leaves."""
        return self.experiment.files(stage)[0]

    def outputs(self, stage: str, frames: range | None = None) -> list[Path]:
        """List the files that a stage leaves."""
        if stage != "render":
            return [self.file(stage)]
        return [path for number in frames or self.all_frames for path in self._files(number)]

    def _files(self, number: int) -> list[Path]:
        """The files of a frame."""
        return [self.experiment.frames / f"{number:04d}{suffix}" for suffix in self.config.render.suffixes]

    def _why_stale(self, stage: str, path: Path) -> str | None:
        try:
            with cache.open(path, _KINDS[stage]) as reader:
                if reader.key != self.keys[stage]:
                    return self._difference(stage, reader.provenance)
                if identity(path) not in _verified:
                    reader.verify()
                    _verified[identity(path)] = reader.key
                return None
        except cache.Missing:
            return "not made yet"
        except cache.Damaged as error:
            return str(error)

    def _difference(self, stage: str, provenance: dict[str, dict[str, object]]) -> str:
        reasons = explain(provenance.get("inputs", {}), self.inputs[stage])
        if len(reasons) > _CHANGES_SHOWN:
            reasons = [*reasons[: _CHANGES_SHOWN - 1], f"and {len(reasons) - _CHANGES_SHOWN + 1} more"]
        return "; ".join(reasons) or "its key changed"

    def _state_of_frames(self, frames: range) -> State:
        """Examine frames one by one; tell the first few different reasons."""
        missing: set[int] = set()
        stale: dict[int, str] = {}
        for number, path in ((n, path) for n in frames for path in self._files(n)):
            try:
                if path.exists() and _verified.get(identity(path)) == self.keys["render"]:
                    continue
                key, provenance = cache.picture_record(path)
                _verified[identity(path)] = key
                if key != self.keys["render"]:
                    stale[number] = self._difference("render", provenance)
            except cache.Missing:
                missing.add(number)
            except cache.Damaged as error:
                stale[number] = str(error)
        if not missing and not stale:
            return State("render")
        reasons = list(dict.fromkeys(stale.values()))[:_REASONS_SHOWN]
        if missing:
            reasons.append(f"{len(missing)} of {len(frames)} frames not made yet")
        return State("render", "; ".join(reasons), tuple(sorted(missing | stale.keys())))


def identity(path: Path) -> tuple[int, ...]:
    """What tells apart files, and states of a file, but for its name: experiments share files by hard links."""
    status = path.stat()
    return status.st_dev, status.st_ino, status.st_size, status.st_mtime_ns


def _touch(path: Path) -> None:
    """Give a file the current time, without having to verify it again."""
    key = _verified.get(identity(path))
    os.utime(path)
    if key is not None:
        _verified[identity(path)] = key
