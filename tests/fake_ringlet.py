"""`ringlet` with stages that write tiny files in no time, to test what runs when; logs each stage it runs."""

import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pipeline import cache
from pipeline.batch.stages import Batch
from pipeline.cli.main import main
from pipeline.config import keys, provenance

if TYPE_CHECKING:
    import pytest

Execute = Callable[[Batch, str, tuple[int, ...]], None]
FIGURES = ("bending", "torsion", "kinetic", "gravity", "strain", "penetration", "contacts")


def execute(batch: Batch, stage: str, frames: tuple[int, ...]) -> None:
    """In place of `Batch.execute`."""
    log(f"{stage} {' '.join(str(frame) for frame in frames)}".rstrip())
    key, record = batch.keys[stage], provenance(batch.config, stage)
    if stage == "render":
        pixels = np.zeros((4, 4, 3), np.uint8)
        for number in frames:
            cache.write_picture(batch.experiment.frames / f"{number:04d}.png", pixels, key, record)
    elif stage == "simulate":
        with cache.create_guides(batch.file(stage), key, record, guides=1, points=8, fps=24) as writer:
            for _ in range(batch.config.simulate.frames):
                writer.append(np.zeros((1, 8, 3)), np.eye(4), dict.fromkeys(FIGURES, 0.5))
    else:
        with cache.create(
            batch.file(stage), kind="groom" if stage == "groom" else "strands", key=key, provenance=record
        ) as writer:
            writer.write("strands/points", np.zeros((2, 8, 3), np.float32))


def log(line: str) -> None:
    if path := os.environ.get("RINGLET_TEST_LOG"):
        with Path(path).open("a") as file:
            file.write(line + "\n")


def fake(monkeypatch: "pytest.MonkeyPatch", stages: Execute = execute) -> None:
    """For one test: these stages in place of the real ones, and keys that no change of code touches."""
    monkeypatch.setattr(Batch, "execute", stages)
    monkeypatch.setattr("pipeline.config.keys.code_version", lambda _stage: "fixed")


if __name__ == "__main__":
    keys.code_version = lambda _stage: "fixed"
    Batch.execute = execute  # type: ignore[method-assign]
    if sys.argv[1] == "keys":
        log("keys")
    main()
