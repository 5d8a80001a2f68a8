"""Stage 4, the frames: reads groom.h5, guides.h5 and strands.h5, writes frames/0001.png and so on, and 0001.exr if wanted.

Every PNG says in its text chunks which key it was made from, by which libraries, and the fingerprint of the
renderer: under one fingerprint the same key gives the same pixels.
"""

import platform
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline import cache, kernels
from pipeline.body.normals import point_curvature
from pipeline.cache import exr
from pipeline.cache.expansion import body_frames, distance_field, expansion_from, placement
from pipeline.config import Config, provenance
from pipeline.progress import say, track
from pipeline.render.body import DrawnBody
from pipeline.render.camera import CameraPath
from pipeline.render.frame import FrameRenderer, Moment, Skin
from pipeline.render.layers import Layers
from pipeline.render.passes import mean, passes
from pipeline.render.target import Target
from pipeline.render.tone import Pixels
from pipeline.render.view import View

Record = dict[str, Any]


def execute(config: Config, experiment: cache.Experiment, key: str, frames: Sequence[int] = ()) -> None:
    """Render frames (numbers from 1); all of them when none are given.

    Raises InputError when there is no off-screen OpenGL or the disk is full; Missing or Damaged for caches.
    """
    if config.render.exr:
        exr.library()
    wanted = frames or range(1, config.simulate.frames + 1)
    with cache.open(experiment.groom, "groom") as groom, cache.open(experiment.strands, "strands") as strands:
        expansion = expansion_from(groom, strands, config)
        keys = strands["strands/key"][:]
        skin, moving, head = _skin(groom), body_frames(groom), placement(groom)
        body = DrawnBody(moving, skin, strands["strands/root"][:]) if moving and skin else None
    renderer = FrameRenderer(config, expansion, keys, skin, head)
    path = CameraPath.of(config.scene.camera, head, config.simulate.frames, config.simulate.fps)
    record = provenance(config, "render")
    texts = {"config": config.name}
    shape = ""
    with (
        cache.open_guides(experiment.guides) as guides,
        _writer(experiment.frames) as write,
        track("render", len(wanted)) as bar,
    ):
        moments = Moments(guides, body)
        for number in wanted:
            shots = list(passes(config, path, number))
            name, pixels_wide = renderer.shape(moments.at(number, 0), shots[0].view)
            if name != shape:
                say("render", f"strands are {name}, {pixels_wide:.2g} px wide, from frame {number} on")
                shape = name
            linear, layers = _frame(renderer, ((moments.at(number, shot.back), shot.view) for shot in shots))
            texts |= {"geometry": name, "frame": str(number), "fingerprint": fingerprint(renderer.target)}
            made = Made(experiment.frames / f"{number:04d}", key, record, dict(texts))
            if layers is not None:
                write(made.layers, layers.channels(linear, renderer.background))
            write(made.picture, renderer.developed(linear))
            bar.advance()
    renderer.target.close()


def _frame(
    renderer: FrameRenderer, shots: Iterable[tuple[Moment, View]]
) -> tuple[NDArray[np.float32], Layers | None]:
    """The mean of some views, linear (H, W, 3), and where the config wants them its layers."""
    if not renderer.render.exr:
        return mean(renderer.linear(*shot) for shot in shots), None
    strands: list[NDArray[np.uint32]] = []

    def both() -> Iterator[NDArray[np.float32]]:
        for shot in shots:
            linear, layers = renderer.linear(*shot), renderer.layers(*shot)
            if not strands:
                strands.append(layers.strand)
            yield np.concatenate([linear, layers.planes], axis=2)

    planes = mean(both())
    return planes[..., :3], Layers(planes[..., 3:], strands[0])


class Moments:
    """What is drawn of a simulation; the last one that was asked for is kept as it is."""

    def __init__(self, guides: cache.GuidesReader, body: DrawnBody | None) -> None:
        self._guides, self._body = guides, body
        self._at = lru_cache(1)(self._read)

    def at(self, number: int, back: int) -> Moment:
        """The moment of a frame, counted from 1, or `back` states before it."""
        return self._at(number, back)

    def _read(self, number: int, back: int) -> Moment:
        moment = Moment(*self._guides.state(number - 1, back))
        if self._body is None:
            return moment
        return self._body.at(max(0.0, number - 1 - back / self._guides.states), moment)


def fingerprint(target: Target) -> str:
    """What pixels depend on besides the config: OpenGL, libraries, kernels and processor."""
    import vtk

    libraries = f"vtk {vtk.vtkVersion.GetVTKVersion()}, numpy {np.__version__}"
    machine = f"{_processor()}, {' '.join(platform.libc_ver())}"
    return f"{target.renderer_name}; {libraries}; kernels {kernels.VARIANT}; {machine}"


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.machine()
    wanted = ("vendor_id", "cpu family", "model\t", "model name")
    return " ".join(dict.fromkeys(line.split(":", 1)[1].strip() for line in lines if line.startswith(wanted)))


@dataclass(frozen=True)
class Made:
    """A frame that was made: its files, but for their suffix, and what they say of it."""

    path: Path
    key: str
    record: Record
    texts: dict[str, str]

    def picture(self, pixels: Pixels) -> None:
        """Write the PNG."""
        cache.write_picture(self.path.with_suffix(".png"), pixels, self.key, self.record, **self.texts)

    def layers(self, channels: Mapping[str, NDArray[Any]]) -> None:
        """Write the EXR."""
        cache.write_layers(self.path.with_suffix(".exr"), channels, self.key, self.record, **self.texts)


class _Write:
    """Writes one file at a time beside the rendering of the next frame."""

    def __init__(self, pool: ThreadPoolExecutor, folder: Path) -> None:
        self._pool, self._folder = pool, folder
        self._last: Future[None] | None = None

    def __call__(self, write: Callable[[Any], None], what: Any) -> None:
        self.wait()
        self._folder.mkdir(parents=True, exist_ok=True)
        self._last = self._pool.submit(write, what)

    def wait(self) -> None:
        """Wait for the file that is being written; raises what went wrong with it."""
        if self._last is not None:
            self._last.result()


@contextmanager
def _writer(folder: Path) -> Iterator[_Write]:
    with ThreadPoolExecutor(1) as pool:
        writer = _Write(pool, folder)
        yield writer
        writer.wait()


def _skin(groom: cache.Reader) -> Skin | None:
    field = distance_field(groom)
    if field is None:
        return None
    points, normals, triangles = (groom[f"head/{name}"][:] for name in ("points", "normals", "triangles"))
    return Skin(
        points=points,
        triangles=triangles,
        normals=normals,
        albedo=groom["head/albedo"][:],
        field=field,
        curvature=point_curvature(points, normals, triangles).astype(np.float32),
    )
