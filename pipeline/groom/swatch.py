"""A swatch: strands on a flat patch, straight or curled, without a head. For physics experiments and looks of fibres."""

import numpy as np

from pipeline.config.schema import Config
from pipeline.groom.curls import curled
from pipeline.strands.held import held_ends
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
    along = np.linspace(0, groom.swatch.length, groom.points)
    points = roots[:, None] + along[:, None] * direction
    if groom.curl.radius > 0:
        lengths = np.broadcast_to(along, points.shape[:2])
        reference = np.broadcast_to(across, roots.shape)
        points = curled(groom.curl, config.seed, index, index, points, lengths, reference)
        points[:, 0] = roots
        points = resampled(points, groom.points)
    return Strands(
        points=points.astype(np.float32),
        held=held_ends(np.tile([2, 2 if groom.swatch.pin_tips else 0], (len(index), 1)), groom.points),
        normal=np.tile(direction, (len(index), 1)).astype(np.float32),
        side=np.zeros(len(index), np.int8),
        key=hashed(config.seed, index, 7),
    )
