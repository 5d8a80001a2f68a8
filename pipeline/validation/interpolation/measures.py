"""How far strands are from the truth: distances, lengths, kinks and radii of curls."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.validation.interpolation.grooms import LENGTH, Kind

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Error:
    """Of strands in motion; distances and lengths over the length of a strand."""

    mean: float
    """Distance of points, mean of all strands and frames."""
    p95: float
    """Of strands, each with the mean of its points and frames."""
    worst: float
    """The largest mean of a strand's points in one frame."""
    length: float
    """Largest change of a strand's length."""
    kink: float
    """How much sharper the sharpest bend of a strand is than in truth [deg], mean of all strands and frames."""
    radius: float
    """Median of the relative errors of curls' radii; 0 for straight hair."""


def error(kind: Kind, rest: Floats, found: Floats, truth: Floats) -> Error:
    """Compare strands (F, n, P, 3) [m], (n, P, 3) at rest, with where they should be."""
    distance = np.linalg.norm(found - truth, axis=3).mean(axis=2) / LENGTH
    length, rest_length = (np.linalg.norm(np.diff(x, axis=-2), axis=-1).sum(axis=-1) for x in (found, rest))
    return Error(
        mean=float(distance.mean()),
        p95=float(np.percentile(distance.mean(axis=0), 95)),
        worst=float(distance.max()),
        length=float(np.abs(length / rest_length - 1).max()),
        kink=float((_sharpest(found) - _sharpest(truth)).mean()),
        radius=float(np.median(_radius(kind, found) / _radius(kind, truth) - 1)) if kind.radius else 0.0,
    )


def distance(found: Floats, truth: Floats) -> float:
    """Mean distance of points (F, S, P, 3) [m] over the length of a strand."""
    return float(np.linalg.norm(found - truth, axis=3).mean() / LENGTH)


def _sharpest(points: Floats) -> Floats:
    """The largest angle between neighbouring segments (F, S) [deg]."""
    edge = np.diff(points, axis=2)
    t = edge / np.linalg.norm(edge, axis=3, keepdims=True)
    cross = np.linalg.norm(np.cross(t[:, :, :-1], t[:, :, 1:]), axis=3)
    return np.asarray(np.degrees(np.arctan2(cross, (t[:, :, :-1] * t[:, :, 1:]).sum(axis=3))).max(axis=2))


def _radius(kind: Kind, points: Floats) -> Floats:
    """Mean distance (F, S) [m] of points from the mean of those within half a turn."""
    turn = np.hypot(2 * np.pi * kind.radius, kind.pitch) / LENGTH * (kind.points - 1)
    half = round((turn - 1) / 2)
    total = np.pad(points.cumsum(axis=2), ((0, 0), (0, 0), (1, 0), (0, 0)))
    middle = (total[:, :, 2 * half + 1 :] - total[:, :, : -2 * half - 1]) / (2 * half + 1)
    inner = points[:, :, half : half + middle.shape[2]]
    return np.asarray(np.linalg.norm(inner - middle, axis=3).mean(axis=2))
