"""`ringlet export openjd`: what it writes is a job that the reference tool accepts and runs, stage after stage."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from pipeline import cache
from pipeline.cli.main import call

ROOT = Path(__file__).parents[2]
OPENJD = Path(sys.executable).with_name("openjd")
CONFIG = """\
[scene]
head = "none"
[groom]
source = "swatch"
strands = 4
guides = 2
points = 8
[simulate]
frames = 5
settle = "0 s"
[render]
size = [16, 16]
samples = 1
grid = 16
"""


@pytest.fixture
def job(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Path:
    (tmp_path / "x.toml").write_text(CONFIG)
    outputs = str(tmp_path / "outputs")
    to = str(tmp_path / "job.json")
    settings = ["-s", 'scene.background=[0.1, 0.2, 0.3]', "-s", "render.taper=0.2"]  # fmt: skip
    assert (
        call(["export", "openjd", str(tmp_path / "x.toml"), "--outputs", outputs, "--to", to, *settings]) == 0
    )
    return Path(capsys.readouterr().out.strip())


def openjd(*arguments: str) -> str:
    if not OPENJD.exists():
        pytest.skip("openjd-cli is not installed")
    found = subprocess.run(
        [str(OPENJD), *arguments],
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        timeout=200,
    )
    assert found.returncode == 0, found.stdout + found.stderr
    return found.stdout


def test_a_template_passes_the_check_of_the_specification(job: Path) -> None:
    assert "passes validation checks" in openjd("check", str(job))


def test_steps_wait_for_what_they_need(job: Path) -> None:
    steps = {step["name"]: step for step in json.loads(job.read_text())["steps"]}
    needs = {
        name: [each["dependsOn"] for each in step.get("dependencies", [])] for name, step in steps.items()
    }
    assert needs == {
        "groom": [],
        "simulate": ["groom"],
        "interpolate": ["groom"],
        "render": ["groom", "simulate", "interpolate"],
    }


def test_a_job_runs_the_frames_that_it_is_asked_for(job: Path, tmp_path: Path) -> None:
    command = tmp_path / "ringlet"
    command.write_text(f'#!/bin/sh\nexec {sys.executable} -m pipeline "$@"\n')
    command.chmod(0o755)
    values = {"Ringlet": command, "FirstFrame": 2, "LastFrame": 4, "FramesPerTask": 2}
    parameters = [word for name, value in values.items() for word in ("-p", f"{name}={value}")]
    said = openjd("run", str(job), *parameters)
    assert "completed successfully" in said
    made = cache.Experiment(tmp_path / "outputs/x")
    assert [path.name for path in sorted(made.frames.iterdir())] == ["0002.png", "0003.png", "0004.png"]
