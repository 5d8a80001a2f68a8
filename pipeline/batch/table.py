"""The experiments of a sweep side by side: outputs/<name>/sweep.json for programs and pages, sweep.csv for spreadsheets.

Paths are relative to the folder of these files. Figures of what is not made yet are null.
"""

import csv
import json
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from pipeline import cache
from pipeline.batch.stages import Batch
from pipeline.batch.sweep import batch_of
from pipeline.config import STAGES
from pipeline.config.sweep import Run, Swept

FORMAT = 1
_LARGEST = {
    "energy_bending": "bending",
    "energy_torsion": "torsion",
    "energy_kinetic": "kinetic",
    "strain": "strain",
    "penetration": "penetration",
    "contacts": "contacts",
}
METRICS = (*_LARGEST, "energy_gravity")

Row = dict[str, Any]


def write_table(swept: Swept, outputs: Path, config: Path) -> Path:
    """Write sweep.json and sweep.csv from what the experiments have on disk; returns the path of the former."""
    folder = outputs / swept.base.config.name
    runs = rows(swept.runs, outputs, folder)
    table = {
        "format": FORMAT,
        "name": swept.base.config.name,
        "config": str(config),
        "mode": swept.mode,
        "keys": list(swept.keys),
        "runs": runs,
    }
    path = folder / "sweep.json"
    with cache.replacing(path) as temporary:
        temporary.write_text(json.dumps(table, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
    with (
        cache.replacing(folder / "sweep.csv") as temporary,
        temporary.open("w", newline="", encoding="utf-8") as file,
    ):
        flat = [_flat(row) for row in runs]
        writer = csv.DictWriter(file, list(flat[0]))
        writer.writeheader()
        writer.writerows(flat)
    return path


def rows(runs: Sequence[Run], outputs: Path, folder: Path) -> list[Row]:
    """One row for each experiment."""
    first: dict[str, str] = {}  # who has the file of a key, in the order of the experiments
    return [_row(run, batch_of(run, outputs), folder, first) for run in runs]


def _row(run: Run, batch: Batch, folder: Path, first: dict[str, str]) -> Row:
    config, home = run.loaded.config, os.path.relpath(batch.experiment.folder, folder)
    stale = set(batch.state("render").frames)
    made = [number for number in batch.all_frames if number not in stale]
    stages = {stage: _stage(batch, stage, first) for stage in STAGES}
    return {
        "name": run.name,
        "folder": home,
        "complete": not stale and all(stage["fresh"] for stage in stages.values()),
        "values": run.values,
        "frames": config.simulate.frames,
        "fps": config.simulate.fps,
        "size": list(config.render.size),
        "pictures": [f"{home}/frames/{number:04d}.png" for number in made],
        "stages": stages,
        "metrics": _metrics(batch) if stages["simulate"]["fresh"] else dict.fromkeys(METRICS),
    }


def _stage(batch: Batch, stage: str, first: dict[str, str]) -> Row:
    key, name = batch.keys[stage], batch.experiment.folder.name
    fresh = batch.state(stage).fresh
    owner = first.setdefault(key, name) if fresh else name
    return {
        "key": key,
        "fresh": fresh,
        "seconds": batch.seconds(stage) if fresh and owner == name else None,
        "shared_with": None if owner == name else owner,
    }


def _metrics(batch: Batch) -> dict[str, float]:
    """Figures of the whole simulation: SI; energies and strain are the largest of all frames."""
    with cache.open_guides(batch.experiment.guides) as guides:
        figures = guides.diagnostics
    metrics = {name: float(np.max(figures[column])) for name, column in _LARGEST.items()}
    return metrics | {"energy_gravity": float(np.ptp(figures["gravity"]))}


def _flat(row: Row) -> Row:
    values = {
        key: value if isinstance(value, str) else json.dumps(value) for key, value in row["values"].items()
    }
    times = {f"seconds_{stage}": row["stages"][stage]["seconds"] for stage in STAGES}
    made = {"frames_made": len(row["pictures"])}
    only = {name: row[name] for name in ("name", "folder", "complete", "frames")}
    flat: Row = only | made | values | row["metrics"] | times
    return flat
