"""Commands of ringlet in processes of their own, so that times and peaks of memory are theirs alone."""

import json
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pipeline.errors import FAILED

_RINGLET = (sys.executable, "-m", "pipeline")


@dataclass(frozen=True)
class Run:
    """What a command did that makes stages from nothing."""

    seconds: float
    """From its start to its end."""
    records: tuple[dict[str, Any], ...]
    """Lines of its log."""

    def ends(self, stage: str) -> list[float]:
        """Seconds of a stage, each time that it was made."""
        return [r["seconds"] for r in self.records if r["event"] == "end" and r["stage"] == stage]

    @property
    def drawing(self) -> float:
        """Seconds for which frames were drawn."""
        told = [r for r in self.records if r["stage"] == "render" and r["event"] == "message"]
        return float(sum(r["seconds"] for r in told if r.get("unit") == "frame"))

    @property
    def peak_gb(self) -> float:
        """Most memory that a stage has used."""
        return float(max(r["peak_gb"] for r in self.records if r["event"] == "end"))


def figures(*words: object) -> dict[str, Any]:
    """What `ringlet bench` measures. Raises CalledProcessError when it cannot."""
    command = [*_RINGLET, "bench", *map(str, words), "--json"]
    done = subprocess.run(command, check=False, capture_output=True, text=True)
    if done.returncode != FAILED:  # it has measured something that is not as it should be
        done.check_returncode()
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def timed(verb: str, config: Path, *options: object) -> Run:
    """Run, groom or sweep a config, its outputs in a folder that is gone afterwards. Raises CalledProcessError."""
    with tempfile.TemporaryDirectory() as folder:
        command = [
            *_RINGLET,
            verb,
            str(config),
            "--outputs",
            folder,
            "--log-format",
            "json",
            *map(str, options),
        ]
        start = time.perf_counter()
        said = subprocess.run(command, check=True, capture_output=True, text=True).stderr
        seconds = time.perf_counter() - start
    return Run(seconds, tuple(json.loads(line) for line in said.splitlines() if line.startswith("{")))
