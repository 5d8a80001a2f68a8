"""What `ringlet plan` promises is what the stages take: memory and disk within a fifth."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from pipeline import cache
from pipeline.cli.plan import estimate
from pipeline.config import load

ROOT = Path(__file__).parents[2]
SMALL = [
    "groom.strands=6000",
    "interpolate.strands=20000",
    "simulate.frames=2",
    "simulate.settle=0.02 s",
    "render.size=[160,96]",
]
WITHIN = 0.2


def peak_gb(stage: str, outputs: Path) -> float:
    """Peak memory [GB] of one stage in a process of its own."""
    values = [word for value in SMALL for word in ("-s", value)]
    command = [
        sys.executable,
        "-m",
        "pipeline",
        stage,
        "configs/default.toml",
        *values,
        "--outputs",
        str(outputs),
    ]
    process = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    assert process.returncode == 0, stage
    return usage.ru_maxrss * 1024 / 1e9


@pytest.mark.skipif(sys.platform != "linux", reason="peak memory in units of Linux")
def test_plan_is_right_about_memory_and_disk(tmp_path: Path) -> None:
    """Each stage in a process of its own, as make runs them."""
    config = load(ROOT / "configs/default.toml", tuple(SMALL)).config
    promised = estimate(config)["stages"]
    experiment = cache.Experiment(tmp_path / config.name)
    written = {"groom": experiment.groom, "simulate": experiment.guides, "interpolate": experiment.strands}
    wrong = []
    for stage, plan in promised.items():
        found = {"peak_rss_gb": peak_gb(stage, tmp_path)}
        if stage in written:
            found["disk_gb"] = written[stage].stat().st_size / 1e9
        for name, value in found.items():
            off = plan[name] / value - 1
            print(f"{stage} {name}: promised {plan[name]:.4f}, taken {value:.4f} ({100 * off:+.0f} %)")
            if abs(off) > WITHIN:
                wrong.append((stage, name))
    assert not wrong
