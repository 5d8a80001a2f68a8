"""How fast frames are made: expansion, light, shading, drawing and PNG, on a synthetic head of hair.

Frames are made as the stage makes them, several in a row, each in its place beside its neighbours; so the times of the
parts add up to more than a frame takes.
"""

import hashlib
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline import kernels
from pipeline.bench.interpolate import round_groom, swung, whole
from pipeline.body.placement import Placement
from pipeline.config.schema import Camera, Config, Groom, Interpolate, Render, Scene
from pipeline.render import chunks
from pipeline.render.camera import CameraPath
from pipeline.render.frame import FrameRenderer, Moment
from pipeline.render.lighting import Lighting
from pipeline.render.stage import Frames, Pictures
from pipeline.render.target import Target
from pipeline.strands.expand import Expansion, Style

_GROOM, _GUIDES = 20_000, 1_000

_PARTS: tuple[tuple[Any, str, str], ...] = (
    (Expansion, "chunk", "expand"),
    (Lighting, "add", "shadows"),
    (Lighting, "finish", "light"),
    (kernels.Raster, "count", "sort"),
    (kernels.Raster, "add", "sort"),
    (kernels.Raster, "compose", "draw"),
    (Lighting, "shade", "shade"),
    (kernels, "tubes", "tubes"),
    (Target, "clear", "opengl"),
    (Target, "_draw", "opengl"),
    (Target, "read", "opengl"),
    (Target, "depth", "opengl"),
    (FrameRenderer, "developed", "develop"),
    (Pictures, "write", "png"),
)


@dataclass(frozen=True)
class _Swinging:
    """Guides that swing, for any number of frames."""

    guides: NDArray[np.float32]

    def read(self, number: int, back: int) -> Moment:  # noqa: ARG002
        """The moment of a frame, counted from 1."""
        return Moment(swung(self.guides, 0.6 + 0.05 * (number - 1)), np.eye(4))


def bench(
    strands: int = 1_000_000,
    points: int = 16,
    size: tuple[int, int] = (1920, 1080),
    geometry: str = "auto",
    samples: int = 2,
    *,
    threads: int = 0,
    chunk: int = chunks.CHUNK,
    frames: int = 12,
) -> dict[str, Any]:
    """Render frames of a swinging head of hair as the stage does.

    Returns seconds_per_frame after a first one, peak_rss_gb of the process, the geometry drawn, seconds a frame of each
    part as parts, and a digest of the last picture, which depends neither on `threads` nor on `chunk`.
    """
    if threads:
        kernels.set_threads(threads)
    config = _config(Render.model_validate({"size": size, "geometry": geometry, "samples": samples}))
    groom, rest = round_groom(min(_GROOM, strands), points, min(_GUIDES, strands))
    binding = whole(groom, Interpolate(strands=strands), seed=1)
    guides = rest[groom.guides.strand]
    expansion = Expansion(rest, guides, binding, groom.roots.field, Style(clump=0.25, frizz=0.03))
    spent: dict[str, float] = {}
    with tempfile.TemporaryDirectory() as folder, ExitStack() as stack:
        stack.enter_context(_replaced(chunks, "CHUNK", chunk))
        renderer = FrameRenderer(config, expansion, binding.key)
        stack.callback(renderer.close)
        camera, pictures = (
            CameraPath.of(config.scene.camera, Placement()),
            Pictures(Path(folder), config, "bench"),
        )
        made = Frames(config, renderer, camera, _Swinging(guides), pictures)
        made.render((1,))
        for owner, name, part in _PARTS:
            stack.enter_context(_timed(owner, name, part, spent))
        start = time.perf_counter()
        made.render(range(2, 2 + frames))
        seconds = time.perf_counter() - start
        shape, _ = renderer.shape(_Swinging(guides).read(1, 0))
        digest = hashlib.sha256((Path(folder) / f"{1 + frames:04d}.png").read_bytes())
    return {
        "seconds_per_frame": round(seconds / frames, 3),
        "peak_rss_gb": round(_peak_gb(), 3),
        "geometry": shape,
        "parts": {part: round(value / frames, 3) for part, value in spent.items()},
        "picture": digest.hexdigest()[:12],
    }


def _config(render: Render) -> Config:
    camera = Camera(position=(0.25, -0.02, 0.75), look_at=(0.0, -0.05, 0.0), field_of_view=0.5)
    scene = Scene(head="none", camera=camera)
    return Config(name="bench", scene=scene, groom=Groom(source="swatch"), render=render)


def _peak_gb() -> float:
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmHWM")) * 1024 / 1e9


@contextmanager
def _replaced(owner: Any, name: str, value: Any) -> Iterator[None]:
    before = getattr(owner, name)
    setattr(owner, name, value)
    try:
        yield
    finally:
        setattr(owner, name, before)


@contextmanager
def _timed(owner: Any, name: str, part: str, spent: dict[str, float]) -> Iterator[None]:
    """Add the time that calls take to a part."""
    call, lock = getattr(owner, name), threading.Lock()

    def measured(*arguments: Any, **options: Any) -> Any:
        start = time.perf_counter()
        try:
            return call(*arguments, **options)
        finally:
            with lock:
                spent[part] = spent.get(part, 0.0) + time.perf_counter() - start

    with _replaced(owner, name, measured):
        yield
