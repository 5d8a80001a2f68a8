"""What `ringlet plan` promises is what the stages take: memory and disk within a fifth."""

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


# A process inherits the peak that wait4 tells from the one that starts it; VmHWM begins anew
_CALL = """
import sys
from pathlib import Path
from pipeline.cli.main import call
code = call(sys.argv[1:])
print(next(line for line in Path("/proc/self/status").read_text().splitlines() if line.startswith("VmHWM")))
sys.exit(code)
"""


def peak_gb(stage: str, outputs: Path) -> float:
    """Peak memory [GB] of one stage in a process of its own."""
    values = [word for value in SMALL for word in ("-s", value)]
    command = [sys.executable, "-c", _CALL, stage, "configs/default.toml", *values, "--outputs", str(outputs)]
    done = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True)
    return int(done.stdout.split()[-2]) * 1024 / 1e9


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
