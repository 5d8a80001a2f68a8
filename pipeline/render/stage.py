"""Stage 4, the frames: reads groom.h5, guides.h5 and strands.h5, writes frames/0001.png and so on, and 0001.exr if wanted.

Every PNG says in its text chunks which key it was made from, by which libraries, and the fingerprint of the
renderer: under one fingerprint the same key gives the same pixels.
"""

import platform
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Protocol

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
from pipeline.render.frame import FrameRenderer, Linear, Moment, Skin
from pipeline.render.layers import Layers
from pipeline.render.passes import mean, passes
from pipeline.render.target import Target
from pipeline.render.tone import Pixels
from pipeline.render.view import View


def execute(config: Config, experiment: cache.Experiment, key: str, frames: Sequence[int] = ()) -> None:
    """Render frames (numbers from 1); all of them when none are given.

    Raises InputError when there is no off-screen OpenGL or the disk is full; Missing or Damaged for caches.
    """
    with open_frames(config, experiment, key) as opened:
        opened.render(frames or range(1, config.simulate.frames + 1))


@contextmanager
def open_frames(config: Config, experiment: cache.Experiment, key: str) -> Iterator["Frames"]:
    """Open what all frames of an experiment share; they can then be rendered in any portions. Raises as `execute`."""
    if config.render.exr:
        exr.library()
    with cache.open(experiment.groom, "groom") as groom, cache.open(experiment.strands, "strands") as strands:
        expansion = expansion_from(groom, strands, config)
        keys = strands["strands/key"][:]
        skin, moving, head = _skin(groom), body_frames(groom), placement(groom)
        body = DrawnBody(moving, skin, strands["strands/root"][:]) if moving and skin else None
    renderer = FrameRenderer(config, expansion, keys, skin, head)
    path = CameraPath.of(config.scene.camera, head, config.simulate.frames, config.simulate.fps)
    try:
        with cache.open_guides(experiment.guides) as guides:
            yield Frames(
                config, renderer, path, Stored(guides, body), Pictures(experiment.frames, config, key)
            )
    finally:
        renderer.close()


@dataclass(frozen=True)
class Frames:
    """The frames of an experiment, by one renderer."""

    config: Config
    renderer: FrameRenderer
    path: CameraPath
    source: "Source"
    pictures: "Pictures"

    def render(self, numbers: Sequence[int]) -> None:
        """Render frames (numbers from 1): while one is drawn the next is read and lit, and the last one written."""
        shape = ""
        with ThreadPoolExecutor(1, "write") as pool, track("render", len(numbers)) as bar:
            moments, writing = self._moments(numbers), None
            for number in numbers:
                shots = list(passes(self.config, self.path, number))
                name, wide = self.renderer.shape(moments.at(number, shots[0].back), shots[0].view)
                if name != shape:
                    say("render", f"strands are drawn as {name}, {wide:.2g} px wide, from frame {number} on")
                    shape = name
                seen = ((moments.at(number, shot.back), shot.view) for shot in shots)
                linear, layers = _mean_of(self.renderer, seen)
                if writing is not None:
                    writing.result()
                texts = {"geometry": name, "fingerprint": fingerprint(self.renderer.target)}
                writing = pool.submit(self._write, number, linear, layers, texts)
                del linear, layers  # not kept beside the next frame's
                bar.advance()
            if writing is not None:
                writing.result()

    def _moments(self, numbers: Sequence[int]) -> "Moments":
        order = [(number, shot.back) for number in numbers for shot in passes(self.config, self.path, number)]
        return Moments(list(dict.fromkeys(order)), self.source, self.renderer)

    def _write(self, number: int, linear: Linear, layers: Layers | None, texts: dict[str, str]) -> None:
        if layers is not None:
            self.pictures.write_layers(number, layers.channels(linear, self.renderer.background), texts)
        self.pictures.write(number, self.renderer.developed(linear), texts)


def _mean_of(renderer: FrameRenderer, shots: Iterable[tuple[Moment, View]]) -> tuple[Linear, Layers | None]:
    """The mean of some views, linear (H, W, 3), and its layers where the config wants them."""
    if not renderer.render.exr:
        return mean(renderer.linear(*shot) for shot in shots), None
    strands: list[NDArray[np.uint32]] = []

    def both() -> Iterator[Linear]:
        for shot in shots:
            linear, layers = renderer.linear(*shot), renderer.layers(*shot)
            if not strands:
                strands.append(layers.strand)
            yield np.concatenate([linear, layers.planes], axis=2)

    planes = mean(both())
    return planes[..., :3], Layers(planes[..., 3:], strands[0])


class Moments:
    """What is drawn, one moment after another in a known order: the next is made ready beside the drawing."""

    def __init__(self, order: Sequence[tuple[int, int]], source: "Source", renderer: FrameRenderer) -> None:
        """Moments as (frame from 1, states before it), none of them twice."""
        self._order, self._source, self._renderer = iter(order), source, renderer
        self._here: tuple[int, int] | None = None
        self._moment: Moment | None = None
        self._coming: tuple[tuple[int, int], Future[Moment]] | None = None
        self._fetch()

    def at(self, number: int, back: int) -> Moment:
        """The moment of a frame, counted from 1, or `back` states before it; the same object while it is asked again."""
        if self._moment is None or (number, back) != self._here:
            if self._coming is None or self._coming[0] != (number, back):
                raise ValueError(f"frame {number}, {back} states before it, comes out of its order")
            self._here, self._moment = (number, back), self._coming[1].result()
            self._fetch()
        return self._moment

    def _fetch(self) -> None:
        place = next(self._order, None)
        self._coming = place and (place, self._renderer.prepare(partial(self._source.read, *place)))


class Source(Protocol):
    """Where moments come from."""

    def read(self, number: int, back: int) -> Moment:
        """The moment of a frame, counted from 1, or `back` states before it."""
        ...


@dataclass(frozen=True)
class Stored:
    """Moments as a simulation has stored them."""

    guides: cache.GuidesReader
    body: DrawnBody | None

    def read(self, number: int, back: int) -> Moment:
        """See `Source`."""
        moment = Moment(*self.guides.state(number - 1, back))
        if self.body is None:
            return moment
        return self.body.at(max(0.0, number - 1 - back / self.guides.states), moment)


class Pictures:
    """Where frames are written."""

    def __init__(self, folder: Path, config: Config, key: str) -> None:
        self._folder, self._key = folder, key
        self._record = provenance(config, "render")
        self._texts = {"config": config.name}

    def write(self, number: int, picture: Pixels, texts: dict[str, str]) -> None:
        """Write a frame with its key, what it was made from and `texts`. Raises InputError when the disk is full."""
        path, texts = self._named(number, ".png", texts)
        cache.write_picture(path, picture, self._key, self._record, **texts)

    def write_layers(self, number: int, channels: Mapping[str, NDArray[Any]], texts: dict[str, str]) -> None:
        """Write the layers of a frame in the same way."""
        path, texts = self._named(number, ".exr", texts)
        cache.write_layers(path, channels, self._key, self._record, **texts)

    def _named(self, number: int, suffix: str, texts: dict[str, str]) -> tuple[Path, dict[str, str]]:
        self._folder.mkdir(parents=True, exist_ok=True)
        return self._folder / f"{number:04d}{suffix}", self._texts | {"frame": str(number)} | texts


def fingerprint(target: Target) -> str:
    """What pixels depend on besides the config: OpenGL, libraries, kernels and processor."""
    from vtkmodules.vtkCommonCore import vtkVersion

    libraries = f"vtk {vtkVersion.GetVTKVersion()}, numpy {np.__version__}"
    machine = f"{_processor()}, {' '.join(platform.libc_ver())}"
    return f"{target.renderer_name}; {libraries}; kernels {kernels.VARIANT}; {machine}"


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.machine()
    wanted = ("vendor_id", "cpu family", "model\t", "model name")
    return " ".join(dict.fromkeys(line.split(":", 1)[1].strip() for line in lines if line.startswith(wanted)))


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
