"""Small runs with stages that take no time, and figures in guides.h5."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
from fake_ringlet import FIGURES, execute
from small_configs import ONE_LIGHT, SWATCH

from pipeline import cache
from pipeline.batch.stages import Batch
from pipeline.config import provenance

CONFIG = """\
extends = "base.toml"
[simulate]
frames = 5
theta = 0.6
"""
BASE = SWATCH + ONE_LIGHT
NAMES = (*FIGURES, "rounds")

Make = Callable[..., Path]


def stage(batch: Batch, name: str, frames: tuple[int, ...]) -> None:
    """Stages with pictures that tell their frame and irradiance, and energies."""
    key, record = batch.keys[name], provenance(batch.config, name)
    if name == "simulate":
        with cache.create_guides(batch.file(name), key, record, guides=1, points=8, fps=24) as writer:
            for frame in range(batch.config.simulate.frames):
                figures = {each: (i + 1) * 1e-6 * frame for i, each in enumerate(NAMES)}
                writer.append(np.zeros((1, 8, 3)), np.eye(4), figures)
    elif name == "render":
        tone = int(20 * batch.config.scene.lights[0].irradiance)
        for number in frames:
            pixels = np.full((18, 32, 3), tone, np.uint8)
            pixels[:, : 6 * number] = (200, 40, 40)
            path = batch.experiment.frames / f"{number:04d}.png"
            cache.write_picture(path, pixels, key, record, fingerprint="gl <1>; vtk 1; kernels v1; cpu")
    else:
        execute(batch, name, frames)


def add_to_log(folder: Path, **record: object) -> None:
    with (folder / "log.jsonl").open("a", encoding="utf-8") as file:
        file.write(json.dumps(record) + "\n")
