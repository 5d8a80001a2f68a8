"""Stage 4, the frames: reads groom.h5, guides.h5 and strands.h5, writes frames/0001.png and so on.

Every PNG says in its text chunks which key it was made from, by which libraries, and the fingerprint of the
renderer: under one fingerprint the same key gives the same pixels.
"""

import platform
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from pipeline import cache, kernels
from pipeline.body.normals import point_curvature
from pipeline.cache.expansion import body_frames, distance_field, expansion_from, placement
from pipeline.config import Config, provenance
from pipeline.progress import say, track
from pipeline.render.body import DrawnBody
from pipeline.render.camera import CameraPath
from pipeline.render.frame import FrameRenderer, Moment, Skin
from pipeline.render.passes import mean, passes
from pipeline.render.target import Target
from pipeline.render.tone import Pixels

Record = dict[str, Any]


def execute(config: Config, experiment: cache.Experiment, key: str, frames: Sequence[int] = ()) -> None:
    """Render frames (numbers from 1); all of them when none are given.

    Raises InputError when there is no off-screen OpenGL or the disk is full; Missing or Damaged for caches.
    """
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
        _writer() as write,
        track("render", len(wanted)) as bar,
    ):
        moments = Moments(guides, body)
        for number in wanted:
            shots = list(passes(config, path, number))
            name, pixels_wide = renderer.shape(moments.at(number, 0), shots[0].view)
            if name != shape:
                say("render", f"strands are {name}, {pixels_wide:.2g} px wide, from frame {number} on")
                shape = name
            picture = renderer.developed(
                mean(renderer.linear(moments.at(number, shot.back), shot.view) for shot in shots)
            )
            texts |= {"geometry": name, "frame": str(number), "fingerprint": fingerprint(renderer.target)}
            write(experiment.frames / f"{number:04d}.png", picture, key, record, dict(texts))
            bar.advance()
    renderer.target.close()


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


class _Write:
    """Writes one picture at a time beside the rendering of the next."""

    def __init__(self, pool: ThreadPoolExecutor) -> None:
        self._pool = pool
        self._last: Future[None] | None = None

    def __call__(self, path: Path, picture: Pixels, key: str, record: Record, texts: dict[str, str]) -> None:
        self.wait()
        path.parent.mkdir(parents=True, exist_ok=True)
        self._last = self._pool.submit(_write_picture, path, picture, key, record, texts)

    def wait(self) -> None:
        """Wait for the picture that is being written; raises what went wrong with it."""
        if self._last is not None:
            self._last.result()


def _write_picture(path: Path, picture: Pixels, key: str, record: Record, texts: dict[str, str]) -> None:
    cache.write_picture(path, picture, key, record, **texts)


@contextmanager
def _writer() -> Iterator[_Write]:
    with ThreadPoolExecutor(1) as pool:
        writer = _Write(pool)
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
