"""What the files of an experiment tell about how they were made."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pipeline import cache, log
from pipeline.compare import renderer_of
from pipeline.config import STAGES
from pipeline.errors import InputError

_SAID = ("message", "warning", "error")


@dataclass(frozen=True)
class Facts:
    """The record of one stage."""

    stage: str
    key: str = ""
    """Hash of all it was made from; "" when there is nothing, or nothing readable."""
    problem: str = ""
    """Why it is not there."""
    inputs: dict[str, Any] = field(default_factory=dict)
    """The values that went into the key."""
    code: str = ""
    libraries: dict[str, str] = field(default_factory=dict)
    kernels: str = ""
    renderer: str = ""
    """Fingerprint of what drew the frames."""
    host: str = ""
    written: str = ""


@dataclass(frozen=True)
class Said:
    """A line of the log."""

    time: str
    stage: str
    event: str
    text: str


def facts_of(experiment: cache.Experiment) -> dict[str, Facts]:
    """The record of every stage; of the render, that of its first frame. Damaged and missing files are told, not raised."""
    return {stage: _facts(experiment, stage) for stage in STAGES}


def frames_of(experiment: cache.Experiment) -> list[Path]:
    """All frames that are there, in order."""
    return sorted(path for path in experiment.frames.glob("*.png") if path.stem.isdigit())


def said_of(experiment: cache.Experiment, keys: dict[str, str]) -> list[Said]:
    """What was said while the files that are there were made, and by the last call before any stage; oldest first.

    Lines said twice are listed once. A log may hold anything: what is not one of its lines is passed over.
    """
    making: dict[tuple[Any, Any], Any] = {}
    found: dict[tuple[str, str, str], Said] = {}
    for record in log.records(experiment.log):
        run, stage, event = (record.get(name) for name in ("run", "stage", "event"))
        if not isinstance(run, str) or not isinstance(stage, str):
            continue
        if event == "begin":
            making[run, stage] = record.get("key")
        elif (
            event in _SAID
            and (event != "message" or stage in keys)
            and making.get((run, stage)) == keys.get(stage)
        ):
            text = str(record.get("text", ""))
            found[stage, str(event), text] = Said(str(record.get("time", "")), stage, str(event), text)
    return list(found.values())


def peaks_of(experiment: cache.Experiment, keys: dict[str, str]) -> dict[str, float]:
    """Most memory that a process used while it made a stage [GB], where the log tells."""
    peaks: dict[str, float] = {}
    for record in log.records(experiment.log):
        if record.get("event") != "end":
            continue
        stage, peak = record.get("stage"), record.get("peak_gb")
        if isinstance(stage, str) and isinstance(peak, int | float) and record.get("key") == keys.get(stage):
            peaks[stage] = max(float(peak), peaks.get(stage, 0.0))
    return peaks


def _facts(experiment: cache.Experiment, stage: str) -> Facts:
    try:
        if stage == "render":
            return _of_frames(frames_of(experiment))
        with cache.open(experiment.files(stage)[0]) as reader:
            record = reader.provenance
            return Facts(
                stage,
                reader.key,
                inputs=record.get("inputs", {}),
                code=record.get("code", ""),
                libraries=record.get("libraries", {}),
                kernels=record.get("kernels", ""),
                host=record.get("host", ""),
                written=record.get("written", ""),
            )
    except cache.Missing:
        return Facts(stage, problem="not made yet")
    except InputError as error:
        return Facts(stage, problem=str(error))


def _of_frames(frames: list[Path]) -> Facts:
    if not frames:
        return Facts("render", problem="not made yet")
    key, record = cache.picture_record(frames[0])
    return Facts(
        "render",
        key,
        inputs=record.get("inputs", {}),
        code=record.get("code", ""),
        renderer=renderer_of(frames[0]) or "",
    )
