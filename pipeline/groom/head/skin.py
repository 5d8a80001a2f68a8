"""Colour of the mannequin's skin: a tone, soft painted shapes, and baked openness."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.groom.head.distance import distance, fold_parts, smoothstep
from pipeline.groom.head.table import load_table

Points = NDArray[np.floating[Any]]

_OPENNESS = ((0.004, 0.35), (0.010, 0.30), (0.022, 0.25))  # (distance along the normal [m], weight)


def albedo(p: Points, normals: Points, tone: str) -> NDArray[np.float32]:
    """Linear RGB (N, 3) of points on the skin."""
    colour = srgb_to_linear(_painted(p, tone)) * (0.35 + 0.65 * openness(p, normals))[:, None]
    return colour.astype(np.float32)


def openness(p: Points, normals: Points) -> Points:
    """Cheap ambient occlusion in 0..1: how freely the distance grows along the normal."""
    closed = sum(w * np.clip(1 - distance(p + s * normals, 0.03) / s, 0, 1) for s, w in _OPENNESS)
    return np.asarray(1 - closed)


def srgb_to_linear(colour: Points) -> Points:
    """Decode sRGB in 0..1."""
    return np.where(colour <= 0.04045, colour / 12.92, ((colour + 0.055) / 1.055) ** 2.4)


def _painted(p: Points, tone: str) -> Points:
    q = np.array(p, copy=True)
    q[:, 0] = np.abs(q[:, 0])
    table = load_table()
    colour = np.tile(np.array(table["skin"][tone]), (len(p), 1))
    for spot in table["paint"]:
        d = fold_parts(q, [spot], np.inf)
        weight = spot["strength"] * smoothstep(1 - d / spot["soft"])[:, None]
        colour += weight * (np.array(spot["color"]) - colour)
    return colour
