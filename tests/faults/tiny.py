"""A whole experiment that takes seconds, run as users run it, and what has to be the same after any disturbance."""

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from pipeline import cache

ROOT = Path(__file__).parents[2]
CONFIG = ROOT / "configs" / "ci" / "wavy.toml"
NAME = "ci-wavy"
FRAMES = 10  # more than a checkpoint holds
SETTINGS = (
    "groom.strands=600",
    "groom.guides=40",
    f"simulate.frames={FRAMES}",
    "simulate.settle=0.1",
    "simulate.contact.spacing=0.006",  # a coarse field of distances: most of the time that a groom takes
    "render.size=[80, 80]",
    "render.samples=1",
)


def command(outputs: Path, *options: str, verb: str = "run") -> list[str]:
    """The command line of one call; `options` may override the settings."""
    settings = [word for setting in SETTINGS for word in ("-s", setting)]
    return [
        sys.executable,
        "-m",
        "pipeline",
        verb,
        str(CONFIG),
        "--outputs",
        str(outputs),
        *settings,
        *options,
    ]


def start(outputs: Path, *options: str, verb: str = "run") -> "subprocess.Popen[str]":
    """Begin a call whose standard error can be read."""
    line = command(outputs, *options, verb=verb)
    pipes = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE}
    return subprocess.Popen(line, cwd=ROOT, text=True, **pipes)


def run(
    outputs: Path, *options: str, verb: str = "run", processors: Sequence[int] = (), code: int = 0
) -> cache.Experiment:
    """Finish a call that has to end with `code`; its standard error is in `outputs`/stderr where that can be written."""

    def restrict() -> None:
        if processors:
            os.sched_setaffinity(0, processors)

    line = command(outputs, *options, verb=verb)
    result = subprocess.run(line, cwd=ROOT, preexec_fn=restrict, capture_output=True, text=True)
    assert result.returncode == code, result.stderr
    assert "Traceback" not in result.stderr
    return cache.Experiment(outputs / NAME)


def columns(path: Path) -> dict[str, bytes]:
    """All that a file of the cache holds, but for the record of when and where it was made; raises Damaged."""
    with cache.open(path) as reader:
        return {name: np.ascontiguousarray(reader[name][:]).tobytes() for name in reader.names}


def products(experiment: cache.Experiment) -> dict[str, object]:
    """What an experiment leaves: columns of its stages' files, bytes of its frames."""
    found: dict[str, object] = {
        path.name: columns(path) for path in (experiment.groom, experiment.guides, experiment.strands)
    }
    return found | {path.name: path.read_bytes() for path in sorted(experiment.frames.iterdir())}


def assert_same(found: cache.Experiment, wanted: cache.Experiment) -> None:
    """Every column and every frame has the same bytes, and nothing is left over."""
    ours, theirs = products(found), products(wanted)
    assert sorted(ours) == sorted(theirs)
    assert [name for name in theirs if ours[name] != theirs[name]] == []
    assert len(theirs) == 3 + FRAMES
    assert leftovers(found) == []
    assert not found.guides.with_suffix(".segments").exists()


def leftovers(experiment: cache.Experiment) -> list[str]:
    """Temporary files of whoever was killed."""
    return sorted(path.name for path in experiment.folder.rglob("*.tmp.*"))


def damaged(experiment: cache.Experiment) -> list[str]:
    """Files that are there but not whole; segments of an unfinished simulation count as well."""
    broken = []
    for path in experiment.folder.rglob("*"):
        try:
            if path.suffix == ".h5":
                columns(path)
            elif path.parent == experiment.frames and path.suffix == ".png":
                cache.picture_record(path)
        except cache.Damaged as error:
            broken.append(str(error))
    return broken


def stage_seconds(experiment: cache.Experiment) -> dict[str, float]:
    """How long each stage took, from the log."""
    records = [json.loads(line) for line in experiment.log.read_text().splitlines()]
    return {record["stage"]: record["seconds"] for record in records if record["event"] == "end"}


def discard(experiment: cache.Experiment, stage: str) -> None:
    """Remove what a stage has left, so that it has to be made again."""
    files = {"groom": experiment.groom, "simulate": experiment.guides, "interpolate": experiment.strands}
    if stage == "render":
        shutil.rmtree(experiment.frames, ignore_errors=True)
    else:
        files[stage].unlink(missing_ok=True)
