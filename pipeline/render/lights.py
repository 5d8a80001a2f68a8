"""Lights as directions: a soft one is the sum of several sharp ones that fill its cone evenly.

Directions lie on a spiral of the golden angle in the cone of half its angle, each for an equal solid angle (Vogel, "A
Better Way to Construct the Sunflower Head", 1979, on a sphere). Together they give a surface that faces the light's
middle the irradiance of the light.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pipeline.config.schema import Light

_SHARP = np.radians(1.0)  # below it one direction will do
_MOST = 16
_GOLDEN = np.pi * (3 - np.sqrt(5))


def as_directions(lights: Sequence[Light]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Unit directions (L, 3) towards the lights and the irradiance (L, 3) of each, linear RGB."""
    directions, irradiance = [np.zeros((0, 3))], [np.zeros((0, 3))]
    for light in lights:
        cone = _cone(np.array(light.direction, np.float64), light.softness)
        facing = cone @ cone.sum(axis=0) / np.linalg.norm(cone.sum(axis=0))
        directions.append(cone)
        colour = light.irradiance * np.array(light.colour) / np.maximum(facing, 0).sum()
        irradiance.append(np.tile(colour, (len(cone), 1)))
    return np.concatenate(directions).astype(np.float32), np.concatenate(irradiance).astype(np.float32)


def count(softness: float) -> int:
    """How many directions a light of an angle [rad] is the sum of."""
    return 1 if softness < _SHARP else min(_MOST, 4 + int(np.degrees(softness) / 5))


def _cone(direction: NDArray[np.float64], softness: float) -> NDArray[np.float64]:
    """Unit directions (n, 3) in a cone of an angle [rad] from side to side."""
    axis = direction / np.linalg.norm(direction)
    n = count(softness)
    if n == 1:
        return axis[None]
    i = np.arange(n) + 0.5
    cosine = 1 - i / n * (1 - np.cos(softness / 2))
    sine, turn = np.sqrt(1 - cosine**2), i * _GOLDEN
    across = np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
    across /= np.linalg.norm(across)
    other = np.cross(axis, across)
    ways = np.outer(np.cos(turn), across) + np.outer(np.sin(turn), other)
    return np.asarray(sine[:, None] * ways + cosine[:, None] * axis)
