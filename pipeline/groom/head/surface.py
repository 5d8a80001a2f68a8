"""The head's skin as triangles."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from pipeline.groom.head.distance import Distances, distance, norm, value_and_gradient
from pipeline.groom.head.table import load_table

Axes = Sequence[NDArray[np.float64]]

COARSE = 3  # first pass of a grid: every 3rd node
REACH = 8e-3  # [m] second pass: nodes this close to the surface


def contour(scale: float = 1.25) -> tuple[NDArray[np.float32], NDArray[np.int32], NDArray[np.float32]]:
    """Closed triangle mesh of the skin, symmetric to 0.05 mm: points, triangles and normals of the formula itself.

    Contoured on stretched axes (1.5 mm on the face to 6 mm on the bust, times `scale`); 1.25 gives 94,000 triangles.
    """
    from pipeline.groom.head_mesh import zero_surface

    x, y, z = [_axis([(at, scale * h) for at, h in spec]) for spec in load_table()["grid"]]
    d = _field((x, y, z), REACH * max(scale, 1))
    d, x = _mirrored(d), np.concatenate([-x[:0:-1], x])
    index, triangles = zero_surface(d)
    p = np.stack([np.interp(i, np.arange(len(a)), a) for i, a in zip(index.T, (x, y, z), strict=True)], -1)
    p, normals = _pulled(p.astype(np.float32))
    return p, triangles, normals


def _pulled(p: NDArray[np.float32]) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    d, g = value_and_gradient(p, REACH)
    p = p - (d / np.maximum((g * g).sum(1), 0.25))[:, None] * g
    return p.astype(np.float32), (g / norm(g)[:, None]).astype(np.float32)


def _axis(spec: Sequence[tuple[float, float]]) -> NDArray[np.float64]:
    """Grid coordinates whose local spacing is linear between (position, spacing) pairs."""
    x, h = np.transpose(spec)
    fine = np.linspace(x[0], x[-1], 4001)
    index = np.r_[0, np.cumsum(np.diff(fine) / np.interp((fine[1:] + fine[:-1]) / 2, x, h))]
    n = COARSE * int(np.ceil(index[-1] / COARSE))
    return np.interp(np.arange(n + 1), index * n / index[-1], fine)


def _field(axes: Axes, reach: float = REACH) -> Distances:
    """Distances on the half grid spanned by `axes`: by the formula near the surface, interpolated elsewhere."""
    shape = [len(a) for a in axes]
    small = [a[::COARSE] for a in axes]
    d = distance(_lattice(small)).reshape([len(a) for a in small])
    for axis, count in enumerate(shape):
        d = _stretched(d, axis, count)
    near = np.flatnonzero(np.abs(d) < reach)
    at = np.unravel_index(near, shape)
    p = np.stack([a[i] for a, i in zip(axes, at, strict=True)], -1).astype(np.float32)
    d.reshape(-1)[near] = distance(p, 1.5 * reach)
    return d


def _stretched(d: Distances, axis: int, count: int) -> Distances:
    """A grid with `count` nodes along an axis, linear between those of d; its ends stay."""
    place = np.arange(count) * ((d.shape[axis] - 1) / (count - 1))
    node = np.minimum(place.astype(np.int64), d.shape[axis] - 2)
    part = np.expand_dims(place - node, [k for k in range(d.ndim) if k != axis])
    return np.asarray(np.take(d, node, axis) * (1 - part) + np.take(d, node + 1, axis) * part)


def _lattice(axes: Axes) -> NDArray[np.float32]:
    return np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, 3).astype(np.float32)


def _mirrored(d: Distances) -> Distances:
    return np.concatenate([d[:0:-1], d])
