"""The SLURM script of docs/farm.md, as an array of two tasks on this machine."""

import os
import re
import signal
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

import pytest
from tiny_run import tiny

from pipeline import cache

pytest.importorskip("distributed", reason='needs the extra "farm"')
ROOT = Path(__file__).parents[2]
FRAMES = 4
CONFIG = tiny(FRAMES)


def script() -> str:
    """The script, for workers with less patience."""
    found = re.search(r"```bash\n(#!/bin/bash\n.*?)```", (ROOT / "docs/farm.md").read_text(), re.DOTALL)
    assert found
    assert "--patience 60" in found[1]
    return found[1].replace("--patience 60", "--patience 3")


def programs(folder: Path) -> Path:
    """What a job has on its path: ringlet, dask and python of this environment."""
    folder.mkdir()
    for name, module in (("ringlet", "-m pipeline"), ("dask", "-m dask"), ("python", "")):
        (folder / name).write_text(f'#!/bin/sh\nexec {sys.executable} {module} "$@"\n')
        (folder / name).chmod(0o755)
    return folder


def test_an_array_of_workers_makes_the_run_and_ends_with_it(tmp_path: Path) -> None:
    (tmp_path / "configs").mkdir()
    (tmp_path / "configs/default.toml").write_text(CONFIG)
    (tmp_path / "job.sh").write_text(script())
    path = f"{programs(tmp_path / 'bin')}:{os.environ['PATH']}"
    slurm = {"SLURM_SUBMIT_DIR": str(tmp_path), "SLURM_ARRAY_JOB_ID": "7", "SLURM_CPUS_PER_TASK": "1"}
    slurm |= {"PATH": path, "PYTHONPATH": str(ROOT)}
    with (tmp_path / "said").open("w") as said:
        tasks = [
            subprocess.Popen(
                ["bash", "job.sh"],
                env=os.environ | slurm | {"SLURM_ARRAY_TASK_ID": str(number)},
                cwd=tmp_path,
                stdout=said,
                stderr=said,
                start_new_session=True,
            )
            for number in (1, 0)
        ]
        try:
            codes = [task.wait(timeout=300) for task in tasks]
        finally:
            for task in tasks:
                end_what_is_left_of(task.pid)
    told = (tmp_path / "said").read_text()
    print(told)
    assert codes == [0, 0]
    assert told.count("worker: working for") == 2
    made = cache.Experiment(tmp_path / "outputs/default")
    assert len(list(made.frames.glob("*.png"))) == FRAMES


def end_what_is_left_of(group: int) -> None:
    """As SLURM does when the script of a task has ended."""
    with suppress(ProcessLookupError):
        os.killpg(group, signal.SIGKILL)
