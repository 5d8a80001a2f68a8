"""Stage 4, the frames: reads groom.h5, guides.h5 and strands.h5, writes frames/0001.png and so on.

Every PNG says in its text chunks which key it was made from, by which libraries, and the fingerprint of the
renderer: under one fingerprint the same key gives the same pixels.
"""

import platform
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from pipeline import cache, kernels
from pipeline.cache.expansion import body_frames, distance_field, expansion_from, placement
from pipeline.config import Config, provenance
from pipeline.progress import say, track
from pipeline.render.body import DrawnBody
from pipeline.render.frame import FrameRenderer, Moment, Pixels, Skin
from pipeline.render.target import Target

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
    record = provenance(config, "render")
    texts = {"config": config.name}
    shape = ""
    with (
        cache.open_guides(experiment.guides) as guides,
        _writer() as write,
        track("render", len(wanted)) as bar,
    ):
        for number in wanted:
            moment = Moment(guides.frame(number - 1), guides.pose(number - 1))
            if body is not None:
                moment = body.at(number - 1, moment)
            name, pixels_wide = renderer.shape(moment)
            if name != shape:
                say("render", f"strands are {name}, {pixels_wide:.2g} px wide, from frame {number} on")
                shape = name
            picture = renderer.frame(moment)
            texts |= {"geometry": name, "frame": str(number), "fingerprint": fingerprint(renderer.target)}
            write(experiment.frames / f"{number:04d}.png", picture, key, record, dict(texts))
            bar.advance()
    renderer.target.close()


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
    return Skin(
        points=groom["head/points"][:],
        triangles=groom["head/triangles"][:],
        normals=groom["head/normals"][:],
        albedo=groom["head/albedo"][:],
        field=field,
    )
