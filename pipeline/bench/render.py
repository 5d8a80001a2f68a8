"""How fast a frame is made: expansion, density, shading, drawing and PNG, on a synthetic head of hair."""

import resource
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from pipeline import cache
from pipeline.bench.interpolate import round_groom, swung, whole
from pipeline.config.schema import Camera, Config, Groom, Interpolate, Render, Scene
from pipeline.render.frame import FrameRenderer, Moment
from pipeline.strands.expand import Expansion, Style

_GROOM, _GUIDES, _REPEATS = 20_000, 1_000, 3


def bench(
    strands: int = 1_000_000,
    points: int = 16,
    size: tuple[int, int] = (1920, 1080),
    geometry: str = "auto",
    samples: int = 2,
) -> dict[str, Any]:
    """Render frames of a swinging head of hair as the stage does.

    Returns seconds_per_frame (median, after a warm-up frame), peak_rss_gb of the process and the geometry drawn.
    """
    render = Render.model_validate({"size": size, "geometry": geometry, "samples": samples})
    camera = Camera(position=(0.25, -0.02, 0.75), look_at=(0.0, -0.05, 0.0), field_of_view=0.5)
    scene = Scene(head="none", camera=camera)
    config = Config(name="bench", scene=scene, groom=Groom(source="swatch"), render=render)
    groom, rest = round_groom(min(_GROOM, strands), points, min(_GUIDES, strands))
    binding = whole(groom, Interpolate(strands=strands), seed=1)
    guides = rest[groom.guides.strand]
    expansion = Expansion(rest, guides, binding, groom.roots.field, Style(clump=0.25, frizz=0.03))
    renderer = FrameRenderer(config, expansion, binding.key)
    seconds = []
    with tempfile.TemporaryDirectory() as folder:
        for i in range(1 + _REPEATS):
            moment = Moment(swung(guides, 0.6 + 0.05 * i), np.eye(4))
            start = time.perf_counter()
            picture = renderer.frame(moment)
            cache.write_picture(Path(folder) / f"{i}.png", picture, "bench", {})
            seconds.append(time.perf_counter() - start)
    shape, _ = renderer.shape(moment)
    renderer.target.close()
    return {
        "seconds_per_frame": round(float(np.median(seconds[1:])), 3),
        "peak_rss_gb": round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20, 3),
        "geometry": shape,
    }
