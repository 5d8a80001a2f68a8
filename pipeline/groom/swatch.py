"""A swatch: strands on a flat patch, without a head. For physics experiments, looks of fibres and of style operators."""

import numpy as np
from numpy.typing import NDArray

from pipeline.config.schema import Config
from pipeline.groom.partings import partings_of
from pipeline.groom.style.ground import Ground
from pipeline.groom.style.hair import Hair
from pipeline.groom.style.stack import Stack
from pipeline.strands.held import held_ends
from pipeline.strands.partings import Neighbours
from pipeline.strands.random import hashed
from pipeline.strands.resample import resampled
from pipeline.strands.strands import Strands

_PLASTIC = 1.32471795724474602596


def swatch(config: Config) -> Strands:
    """Strands whose roots fill a square across their direction, in an order whose every prefix is evenly spread."""
    groom = config.groom
    direction = np.array(groom.swatch.direction, float)
    direction /= np.linalg.norm(direction)
    across = np.cross(direction, np.eye(3)[np.abs(direction).argmin()])
    across /= np.linalg.norm(across)
    index = np.arange(groom.strands)
    uv = (0.5 + index[:, None] * np.array([1 / _PLASTIC, 1 / _PLASTIC**2])) % 1 - 0.5
    roots = groom.swatch.size * (uv[:, :1] * across + uv[:, 1:] * np.cross(direction, across))
    hair = Hair(
        index=index,
        root=roots,
        normal=np.tile(direction, (len(index), 1)),
        points=roots[:, None] + np.linspace(0, groom.swatch.length, groom.points)[:, None] * direction,
        length=np.full(len(index), groom.swatch.length),
        comb=np.tile(across, (len(index), 1)),
    )
    ground = Ground(config.seed, groom.points)
    placed = Neighbours(roots.astype(np.float32).astype(np.float64), partings_of(config, None))
    stack = Stack(groom.style, ground, lambda some: _some(hair, some), placed)
    points = stack.strands(index).points
    points[:, 0] = roots
    points = resampled(points, groom.points)
    return Strands(
        points=points.astype(np.float32),
        held=held_ends(np.tile([2, 2 if groom.swatch.pin_tips else 0], (len(index), 1)), groom.points),
        normal=hair.normal.astype(np.float32),
        key=hashed(config.seed, index, 7),
    )


def _some(hair: Hair, index: NDArray[np.int64]) -> Hair:
    names = ("index", "root", "normal", "points", "length", "comb")
    return Hair(**{name: getattr(hair, name)[index] for name in names})
