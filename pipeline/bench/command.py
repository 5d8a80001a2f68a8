"""Commands of ringlet in processes of their own, so that times and peaks of memory are theirs alone."""

import json
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pipeline.errors import FAILED, WRONG_INPUT, InputError

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
    """What `ringlet bench` measures. Raises InputError or CalledProcessError when it cannot."""
    done = subprocess.run(
        [*_RINGLET, "bench", *map(str, words), "--json"], check=False, capture_output=True, text=True
    )
    if done.returncode == WRONG_INPUT:
        raise InputError(done.stderr.strip())
    if done.returncode != FAILED:  # it has measured something that is not as it should be
        done.check_returncode()
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def timed(verb: str, config: Path, *options: object) -> Run:
    """Run, groom or sweep a config, its outputs in a folder that is gone afterwards. Raises InputError or CalledProcessError."""
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
        done = subprocess.run(command, check=False, capture_output=True, text=True)
        seconds = time.perf_counter() - start
    records = tuple(json.loads(line) for line in done.stderr.splitlines() if line.startswith("{"))
    if done.returncode == WRONG_INPUT:
        raise InputError.joined(r["text"] for r in records if r["event"] == "error")
    done.check_returncode()
    return Run(seconds, records)
