"""Where an experiment stands: what is fresh and why the rest is not, who works on it, what it takes on the disk."""

from collections import deque
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pipeline import cache, log
from pipeline.batch.stages import Batch
from pipeline.cache.atomic import stale_files
from pipeline.config import STAGES

_EXPERIMENTS_SHOWN = 8
_PROGRESS = ("unit", "done", "total", "rate", "left_s")


def examine(batch: Batch) -> dict[str, Any]:
    """All that `ringlet status` tells, as one object; files are read whole and verified, nothing is changed."""
    experiment = batch.experiment
    records = list(log.records(experiment.log))
    own, shared = _disk_use(experiment.folder)
    return {
        "name": batch.config.name,
        "folder": str(experiment.folder),
        "stages": [_stage(batch, stage, records) for stage in STAGES],
        "disk": {
            "bytes": own,
            "shared_bytes": shared,
            "leftovers": [str(path) for path in _leftovers(experiment)],
        },
        "last_run": _last_run(records),
    }


def examine_sweep(batches: Sequence[Batch]) -> list[dict[str, Any]]:
    """Of every experiment of a sweep, which stage is the first that is not fresh."""
    found = []
    for batch in batches:
        stale = next((state for state in batch.states() if not state.fresh), None)
        reason = f"{stale.name}: {stale.reason}" if stale else ""
        found.append({"name": batch.config.name, "complete": stale is None, "reason": reason})
    return found


def _stage(batch: Batch, stage: str, records: list[log.Record]) -> dict[str, Any]:
    state = batch.state(stage)
    files = [path for path in batch.outputs(stage) if path.exists()]
    workers = batch.experiment.workers_on(stage)
    found = {
        "name": stage,
        "fresh": state.fresh,
        "reason": state.reason,
        "bytes": sum(path.stat().st_size for path in files),
        "seconds": batch.seconds(stage) if state.fresh else None,
        "workers": workers,
        "progress": _progress(stage, records) if workers else None,
    }
    if stage in ("simulate", "render"):
        total = batch.config.simulate.frames
        if stage == "render":
            done = total - len(state.frames)
        else:
            done = total if state.fresh else cache.Segments(batch.file(stage), batch.keys[stage]).count()
        found["frames"] = {"done": done, "total": total}
    return found


def _progress(stage: str, records: list[log.Record]) -> dict[str, Any] | None:
    """The last that was heard of a stage since it was begun."""
    heard = None
    for record in records:
        if record["stage"] == stage and record["event"] == "begin":
            heard = None
        elif record["stage"] == stage and record["event"] == "progress":
            heard = {name: record[name] for name in _PROGRESS}
    return heard


def _last_run(records: list[log.Record]) -> dict[str, Any] | None:
    """The call that began last, and how it ended; an end that nobody told was forced, unless it still runs."""
    begun = deque((record for record in records if record["event"] == "run"), maxlen=1)
    if not begun:
        return None
    run = begun[0]
    ends = [record for record in records if record["event"] == "exit" and record["run"] == run["run"]]
    return {
        "began": run["time"],
        "command": run["text"],
        "process": run["pid"],
        "host": run["host"],
        "code": ends[-1]["code"] if ends else None,
        "end": ends[-1]["text"] if ends else None,
        "seconds": ends[-1]["seconds"] if ends else None,
    }


def _disk_use(folder: Path) -> tuple[int, int]:
    """Bytes on the disk of a folder's files, and the part of them that other experiments have as well."""
    own = shared = 0
    for path in folder.rglob("*"):
        if path.is_file():
            status = path.stat()
            own += 512 * status.st_blocks
            shared += 512 * status.st_blocks if status.st_nlink > 1 else 0
    return own, shared


def _leftovers(experiment: cache.Experiment) -> list[Path]:
    """Temporary files of processes that are no more; the next run that makes something removes them."""
    return [path for folder in experiment.working_folders for path in stale_files(folder)]


def lines(found: dict[str, Any]) -> list[str]:
    """The same for people."""
    said = []
    for stage in found["stages"]:
        frames = stage.get("frames")
        done = f"  ({frames['done']} of {frames['total']} frames)" if frames and not stage["fresh"] else ""
        said.append(f"{stage['name']:<12} {'fresh' if stage['fresh'] else 'stale: ' + stage['reason']}{done}")
        for worker in stage["workers"]:
            said.append(f"{'':<12} {worker} is making it{_heard(stage['progress'])}")
    disk = found["disk"]
    part = (
        f", {_mb(disk['shared_bytes'])} of it shared with other experiments" if disk["shared_bytes"] else ""
    )
    said.append(f"{'disk':<12} {_mb(disk['bytes'])}{part}")
    if disk["leftovers"]:
        said.append(
            f"{'':<12} {len(disk['leftovers'])} left over by killed processes; the next run removes them"
        )
    if run := found["last_run"]:
        running = any(stage["workers"] for stage in found["stages"])
        no_end = "goes on" if running else "was ended by force"
        end = f"exit code {run['code']} after {run['seconds']:.1f} s" if run["end"] else no_end
        said.append(f"{'last run':<12} {run['began'][:19]} UTC, {end}")
        if run["code"]:
            said.append(f"{'':<12} {run['end'].splitlines()[-1]}")
    return said


def sweep_lines(found: Sequence[dict[str, Any]]) -> list[str]:
    """The experiments of a sweep for people: how many are complete, and the first that are not."""
    open_ = [each for each in found if not each["complete"]]
    said = [f"{'sweep':<12} {len(found) - len(open_)} of {len(found)} experiments complete"]
    said += [f"{'':<12} {each['name']}: {each['reason']}" for each in open_[:_EXPERIMENTS_SHOWN]]
    if len(open_) > _EXPERIMENTS_SHOWN:
        said.append(f"{'':<12} and {len(open_) - _EXPERIMENTS_SHOWN} more")
    return said


def _heard(progress: dict[str, Any] | None) -> str:
    if progress is None:
        return ""
    unit, rate = progress["unit"], progress["rate"]
    return f": {unit} {progress['done']}/{progress['total']}, {rate:.3g} {unit}s/s, {progress['left_s']:.0f} s left"


def _mb(size: float) -> str:
    return f"{size / 1e6:.1f} MB"
