"""What a sweep costs beside the work: experiments that differ in a light share everything but their frames."""

import tempfile
from pathlib import Path
from typing import Any

from pipeline.bench.command import timed

_CONFIG = """\
name = "lights"
[groom]
strands = {strands}
guides = 64
[simulate]
frames = {frames}
settle = "0.1 s"
[render]
size = [{size}, {size}]
[sweep]
"scene.lights[0].irradiance" = {values}
"""


def bench(experiments: int, frames: int, size: int, strands: int) -> dict[str, Any]:
    """Sweep a light; frames are square, of `size` px.

    Returns how often each stage was made; seconds from start to end, and of drawing; and overhead_s_per_experiment, all
    that is neither a stage before the render nor drawing: loading, opening caches and OpenGL, table and page.
    """
    values = [round(0.5 + number / 2, 1) for number in range(experiments)]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "lights.toml"
        path.write_text(_CONFIG.format(strands=strands, frames=frames, size=size, values=values))
        run = timed("sweep", path)
    before = {stage: run.ends(stage) for stage in ("groom", "simulate", "interpolate")}
    rest = run.seconds - run.drawing - sum(map(sum, before.values()))
    return {
        "experiments": experiments,
        **{f"times_{stage}": len(ends) for stage, ends in before.items()},
        "times_render": len(run.ends("render")),
        "seconds": round(run.seconds, 2),
        "seconds_drawing": round(run.drawing, 2),
        "overhead_s_per_experiment": round(rest / experiments, 3),
    }
