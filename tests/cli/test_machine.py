"""What is free on a machine, whoever limits it; and that nothing begins which the kernel would have to end."""

import json
import os
import resource
import subprocess
import sys
from pathlib import Path

import pytest
from small_configs import SWATCH

from pipeline.cli import doctor, machine
from pipeline.cli.main import call

ROOT = Path(__file__).parents[2]
MEMINFO = "MemTotal: 9000000 kB\nMemFree: 1 kB\nMemAvailable: 8000000 kB\n"
CONFIG = f"""\
{SWATCH}[simulate]
frames = 2
settle = 0
[render]
size = [32, 32]
samples = 1
"""


def fake(folder: Path, group: str, files: dict[str, str]) -> tuple[Path, Path]:
    """A /proc and a /sys/fs/cgroup of our own."""
    proc, groups = folder / "proc", folder / "cgroup"
    (proc / "self").mkdir(parents=True)
    (proc / "meminfo").write_text(MEMINFO)
    (proc / "self" / "cgroup").write_text(group)
    for name, text in files.items():
        path = groups / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f"{text}\n")
    return proc, groups


def test_without_limits_it_is_what_the_machine_has(tmp_path: Path) -> None:
    room = machine.memory("groom", *fake(tmp_path, "", {}))
    assert room == machine.Room(8_192_000_000, "what the machine has free")


VERSION_2 = {
    "batch/memory.max": "3000000000",
    "batch/memory.current": "1000000000",
    "batch/memory.stat": "anon 5\ninactive_file 200000000",
    "batch/job/memory.max": "max",
    "batch/job/memory.current": "5",
    "batch/job/memory.stat": "inactive_file 0",
}
VERSION_1 = {
    "memory/memory.limit_in_bytes": "2000000000",
    "memory/memory.usage_in_bytes": "500000000",
    "memory/memory.stat": "cache 9\ntotal_inactive_file 100000000",
}


@pytest.mark.parametrize(
    ("group", "files", "free", "limit"),
    [
        ("0::/batch/job\n", VERSION_2, 2_200_000_000, "batch/memory.max is 3.00 GB"),
        (
            "5:cpu:/\n4:memory:/not/here\n",
            VERSION_1,
            1_600_000_000,
            "memory/memory.limit_in_bytes is 2.00 GB",
        ),
    ],
    ids=["version 2", "version 1"],
)
def test_a_control_group_limits_those_below_it(
    tmp_path: Path, group: str, files: dict[str, str], free: int, limit: str
) -> None:
    room = machine.memory("groom", *fake(tmp_path, group, files))
    assert room.free == free
    assert room.limit.endswith(limit)


def run(folder: Path, *options: str, addresses: int) -> subprocess.CompletedProcess[str]:
    config = folder / "x.toml"
    config.write_text(CONFIG)
    command = [sys.executable, "-m", "pipeline", "run", str(config), "--outputs", str(folder), *options]
    limit = (addresses, resource.RLIM_INFINITY)
    return subprocess.run(
        command,
        cwd=ROOT,
        capture_output=True,
        text=True,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, limit),
    )


def test_what_does_not_fit_is_refused_before_anything_runs(tmp_path: Path) -> None:
    """1.6 GB of addresses hold all stages but the render; the first three are not made in vain."""
    result = run(tmp_path, addresses=1_600_000_000)
    print(result.stderr)
    assert result.returncode == 2
    assert result.stderr.startswith("ringlet: render needs ")
    assert result.stderr.count("\n") == 1
    assert "addresses are limited to 1.60 GB" in result.stderr
    assert "--force" in result.stderr
    assert sorted(path.name for path in (tmp_path / "x").iterdir()) == ["log.jsonl"]
    assert run(tmp_path, "--until", "interpolate", addresses=1_600_000_000).returncode == 0


def test_a_limit_below_the_least_is_told_without_a_traceback(tmp_path: Path) -> None:
    result = run(tmp_path, addresses=400_000_000)
    assert (result.returncode, result.stderr.count("\n")) == (2, 1)
    assert "0.5 GB are the least" in result.stderr


def test_what_is_fresh_needs_no_memory_and_force_begins_all_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    config = tmp_path / "x.toml"
    config.write_text(CONFIG)
    arguments = ["run", str(config), "--until", "groom", "--outputs", str(tmp_path)]
    monkeypatch.setattr(machine, "memory", lambda _stage: machine.Room(1e6, "a test"))
    assert call(arguments) == 2
    assert "0.00 GB are free (a test)" in capsys.readouterr().err
    assert call([*arguments, "--force"]) == 0
    assert call(arguments) == 0


def test_plan_tells_what_is_free_and_what_does_not_fit(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    config = tmp_path / "x.toml"
    config.write_text(CONFIG)
    plan = ["plan", str(config), "--outputs", str(tmp_path / "not" / "there")]
    assert call([*plan, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["short"] == []
    assert found["here"]["memory_gb"] > 0
    assert found["here"]["disk_gb"] == pytest.approx(machine.disk(tmp_path).free / 1e9, abs=0.5)
    monkeypatch.setattr(machine, "memory", lambda _stage: machine.Room(1e6, "a test"))
    monkeypatch.setattr(machine, "disk", lambda _folder: machine.Room(10.0, "/full"))
    assert call([*plan, "--json"]) == 0
    short = json.loads(capsys.readouterr().out)["short"]
    assert [text.split()[0] for text in short] == ["groom", "simulate", "interpolate", "render", "/full:"]


def found_by_doctor(name: str, outputs: Path) -> doctor.Check:
    return next(check for check in doctor.examine(outputs) if check.name == name)


def test_doctor_sees_a_clock_that_went_back(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor, "_gl", lambda: doctor.Check("OpenGL", True, ""))
    (tmp_path / "x").mkdir()
    (tmp_path / "x" / "groom.h5").touch()
    assert found_by_doctor("clock", tmp_path).passed
    os.utime(tmp_path / "x" / "groom.h5", (4e9, 4e9))
    check = found_by_doctor("clock", tmp_path)
    assert not check.passed
    assert "groom.h5" in check.found


def test_doctor_sees_limits_and_folders_that_cannot_be_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(doctor, "_gl", lambda: doctor.Check("OpenGL", True, ""))
    monkeypatch.setattr(doctor.resource, "getrlimit", lambda _which: (4096, 4096))
    assert not found_by_doctor("limits", tmp_path).passed
    monkeypatch.setattr(machine, "disk", lambda _folder: machine.Room(1e12, "/proc"))
    check = found_by_doctor("outputs", tmp_path)
    assert not check.passed
    assert check.found.startswith("/proc: ")
