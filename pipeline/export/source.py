"""The strands of an experiment's frames, chunk by chunk, as its caches describe them."""

import hashlib
import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from pipeline import cache
from pipeline.cache.expansion import MovingSkin, body_frames, expansion_from
from pipeline.cache.partings import read_partings
from pipeline.config import Config
from pipeline.render.geometry import drawn_width, taper
from pipeline.strands.formats.lines import Chunks, Lines

What = Literal["strands", "guides"]

_CHUNK = 65_536  # strands that are in memory at once
_VERSION = 1  # of what is written


@dataclass(frozen=True)
class Source:
    """Strands in motion."""

    lines: Lines
    moment: Callable[[int], Chunks]
    """Points of a frame, counted from 1, in the world."""


@contextmanager
def opened(
    config: Config, experiment: cache.Experiment, what: What, most: int | None = None
) -> Iterator[Source]:
    """The strands or the guides of a finished experiment, the first `most` of them.

    They have the widths that the renderer draws. Raises Missing or Damaged.
    """
    with cache.open_guides(experiment.guides) as guides:
        if what == "guides":
            count = min(guides.guides, most or guides.guides)
            with cache.open(experiment.groom, "groom") as groom:
                uv = _uv(groom, groom["strands/points"][groom["guides/strand"][:count]][:, 0])
            lines = _lines(config, count, guides.points, [guides.key], what, uv)
            yield Source(lines, lambda number: [guides.frame(number - 1)[:count]])
            return
        with (
            cache.open(experiment.groom, "groom") as groom,
            cache.open(experiment.strands, "strands") as file,
        ):
            expansion = expansion_from(groom, file, config)
            body = body_frames(groom)
            skin = MovingSkin(body, file["strands/root"][:]) if body else None
            count = min(expansion.count, most or expansion.count)
            uv = _uv(groom, file["strands/root"][:count])
            key = file.key

        def moment(number: int) -> Iterator[NDArray[np.float32]]:
            at = number - 1
            expansion.frame(guides.frame(at), guides.pose(at), skin.at(at) if skin else None)
            for a in range(0, count, _CHUNK):
                yield expansion.chunk(a, min(a + _CHUNK, count))

        yield Source(_lines(config, count, expansion.points, [guides.key, key], what, uv), moment)


def _uv(groom: cache.Reader, roots: NDArray[np.float32]) -> NDArray[np.float32] | None:
    """Where roots (N, 3) [m] at rest lie on the head's chart, as `Head.uv` has it; None without a head."""
    chart = read_partings(groom).chart
    return None if chart.flat else (0.5 + 0.5 * chart.uv(roots)).astype(np.float32)


def _lines(
    config: Config, count: int, points: int, keys: list[str], what: What, uv: NDArray[np.float32] | None
) -> Lines:
    widths = (drawn_width(config.render, count) * taper(config.render, points)).astype(np.float32)
    fps = float(config.simulate.fps)
    made_from = json.dumps([_VERSION, keys, count, widths.tolist(), fps])
    digest = hashlib.sha256(made_from.encode()).hexdigest()[:32]
    return Lines(count, points, widths, fps, f"ringlet {what} {digest}", uv)
