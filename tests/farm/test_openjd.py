"""`ringlet export openjd`: what it writes is a job that the reference tool accepts and runs, stage after stage."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from tiny_run import tiny

from pipeline import cache
from pipeline.cli.main import call

ROOT = Path(__file__).parents[2]
OPENJD = Path(sys.executable).with_name("openjd")
CONFIG = tiny(5)


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


@pytest.fixture
def ringlet(tmp_path: Path) -> Path:
    """The command of this tree."""
    command = tmp_path / "ringlet"
    command.write_text(f'#!/bin/sh\nexec {sys.executable} -m pipeline "$@"\n')
    command.chmod(0o755)
    return command


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


def test_a_job_runs_the_frames_that_it_is_asked_for(job: Path, ringlet: Path, tmp_path: Path) -> None:
    values = {"Ringlet": ringlet, "FirstFrame": 2, "LastFrame": 4, "FramesPerTask": 2}
    parameters = [word for name, value in values.items() for word in ("-p", f"{name}={value}")]
    said = openjd("run", str(job), *parameters)
    assert "completed successfully" in said
    made = cache.Experiment(tmp_path / "outputs/x")
    assert [path.name for path in sorted(made.frames.iterdir())] == ["0002.png", "0003.png", "0004.png"]


@pytest.fixture
def sweep_job(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Path:
    config = CONFIG.replace("frames = 5", "frames = 2")
    (tmp_path / "x.toml").write_text(f'{config}[sweep]\n"scene.lights[0].irradiance" = [1, 2]\n')
    places = ["--outputs", str(tmp_path / "outputs"), "--to", str(tmp_path / "sweep.json")]
    assert call(["export", "openjd", str(tmp_path / "x.toml"), "--sweep", *places]) == 0
    return Path(capsys.readouterr().out.strip())


def test_a_sweep_is_a_job_whose_steps_are_shared_by_experiments(sweep_job: Path) -> None:
    steps = {step["name"]: step for step in json.loads(sweep_job.read_text())["steps"]}
    assert list(steps) == ["groom 1", "simulate 1", "interpolate 1", "render 1", "render 2", "table"]
    needs = {
        name: [each["dependsOn"] for each in step["dependencies"]]
        for name, step in steps.items()
        if name != "groom 1"
    }
    assert needs["simulate 1"] == needs["interpolate 1"] == ["groom 1"]
    assert needs["render 1"] == needs["render 2"] == ["groom 1", "simulate 1", "interpolate 1"]
    assert needs["table"] == ["render 1", "render 2"]
    assert steps["render 2"]["description"] == "x@irradiance=2"
    assert "passes validation checks" in openjd("check", str(sweep_job))


def test_the_job_of_a_sweep_leaves_what_the_sweep_leaves(
    sweep_job: Path, ringlet: Path, tmp_path: Path
) -> None:
    assert "completed successfully" in openjd("run", str(sweep_job), "-p", f"Ringlet={ringlet}")
    table = json.loads((tmp_path / "outputs/x/sweep.json").read_text())
    assert [run["complete"] for run in table["runs"]] == [True, True]
    assert [run["stages"]["simulate"]["shared_with"] for run in table["runs"]] == [None, "x@irradiance=1"]
    assert (tmp_path / "outputs/x/sweep.html").exists()
