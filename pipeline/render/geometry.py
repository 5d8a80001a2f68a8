"""Strands as shapes: which one fits the projected width, ribbons that face the camera, smooth subdivision."""

from collections.abc import Callable
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from pipeline.config.schema import Render
from pipeline.render.view import View

Points = NDArray[np.float32]
Which = NDArray[np.uint32]
Shape = Literal["tubes", "ribbons", "lines", "coverage"]

TUBES_FROM = 3.0  # [px] projected width from which `auto` fades from coverage to tubes: its strips have notches at bends
TUBES_ALONE = 4.0  # [px] and from which it draws tubes alone

_FIBRE = 80e-6  # [m] a human hair's diameter
_FULL = 100_000  # strands of a full head


def drawn_width(render: Render, strands: int, of: int | None = None) -> float:
    """Width [m] of a strand in the picture: the config's, or a fibre's, widened when there are few strands.

    Where only the first `strands` of `of` strands are drawn, they are wider by what is missing: the sum of the widths,
    and so the part of every ray that meets hair, stays.
    """
    of = of or strands
    width = render.width
    if width is None:
        width = float(_FIBRE * np.sqrt(max(_FULL / of, 1.0)))
    return width * of / strands


def one_fibre_each(render: Render, strands: int, of: int | None = None) -> bool:
    """Whether a drawn strand is a fibre that shows its sides: one that stands for two or more shows their mean."""
    return bool(drawn_width(render, strands, of) < np.sqrt(2) * (render.width or _FIBRE))


def projected_width(render: Render, camera: View, width: float, middle: NDArray[np.float64]) -> float:
    """Width [px] of a strand of `width` [m] that passes through `middle` (3,) [m]."""
    forward = np.subtract(camera.look_at, camera.position)
    depth = float((middle - camera.position) @ forward / np.linalg.norm(forward))
    visible = 2 * max(depth, 1e-6) * np.tan(camera.field_of_view / 2)
    return float(width / visible * render.size[1])


def choose_shapes(render: Render, pixels: float) -> tuple[tuple[Shape, float], ...]:
    """The shape that the config asks for, or those that fit a projected width [px], and their parts of the picture.

    Between coverage and tubes a picture is both: in a zoom nothing pops.
    """
    if render.geometry != "auto":
        return ((render.geometry, 1.0),)
    t = min(max((pixels - TUBES_FROM) / (TUBES_ALONE - TUBES_FROM), 0.0), 1.0)
    tubes = t * t * (3 - 2 * t)
    both: tuple[tuple[Shape, float], ...] = (("coverage", 1 - tubes), ("tubes", tubes))
    return tuple((shape, part) for shape, part in both if part > 0)


def taper(render: Render, points: int) -> NDArray[np.float32]:
    """Width of each of P points as a fraction of the root's: constant, then thinning out towards the tip."""
    left = 1 - np.linspace(0, 1, points)
    profile = np.sqrt(np.clip(left / render.taper, 0, 1)) if render.taper > 0 else np.ones(points)
    return np.maximum(profile, 0.05).astype(np.float32)


def smooth(points: Points, pieces: int) -> Points:
    """Subdivide segments of (S, P, C) along Catmull and Rom's curve (1974) through the points: (S, (P-1) pieces + 1, C)."""
    if pieces == 1:
        return points
    before, after = 2 * points[:, :1] - points[:, 1:2], 2 * points[:, -1:] - points[:, -2:-1]
    padded = np.concatenate([before, points, after], axis=1)
    a, b, c, d = (padded[:, i : i + points.shape[1] - 1, None] for i in range(4))
    t = (np.arange(pieces, dtype=np.float32) / np.float32(pieces))[:, None]
    curve = b + t / 2 * (c - a + t * (2 * a - 5 * b + 4 * c - d + t * (3 * b - a - 3 * c + d)))
    inner = curve.reshape(len(points), -1, points.shape[2])
    return np.ascontiguousarray(np.concatenate([inner, points[:, -1:]], axis=1), np.float32)


def smooth_colours(
    shade: Callable[[Which], NDArray[np.float32]], count: int, pieces: int, wanted: Which
) -> NDArray[np.float32]:
    """Linear RGB (n, 3) of points (n,), flat indices, of strands that `smooth` has subdivided.

    Linear between their `count` points, of which `shade` gives the colours (m, 3) by flat indices (m,), ascending.
    """
    if pieces == 1:
        return shade(wanted)
    strand, place = np.divmod(wanted, np.uint32((count - 1) * pieces + 1))
    segment, part = np.divmod(place, np.uint32(pieces))
    before = strand * np.uint32(count) + segment
    after = before + (part > 0)
    shaded = np.unique(np.concatenate([before, after]))
    colours = shade(shaded)
    a, b = (colours[np.searchsorted(shaded, ends)] for ends in (before, after))
    t = part.astype(np.float32)[:, None] / np.float32(pieces)
    return np.asarray(a + t * (b - a))


def ribbons(
    points: Points, widths: NDArray[np.float32], eye: NDArray[np.float64], drawn: NDArray[np.bool_]
) -> tuple[Points, NDArray[np.int64]]:
    """Bands that face the eye: points (S, P, 2, 3) [m] and triangles (T, 3) over their flat order.

    Segments (S, P-1) that are not `drawn` have no triangles.
    """
    tangent = np.empty_like(points)
    tangent[:, 1:-1] = points[:, 2:] - points[:, :-2]
    tangent[:, 0], tangent[:, -1] = points[:, 1] - points[:, 0], points[:, -1] - points[:, -2]
    side = np.cross(tangent, points - eye.astype(np.float32))
    side *= (widths / 2 / np.maximum(np.linalg.norm(side, axis=2), 1e-20))[..., None]
    edges = np.stack([points - side, points + side], axis=2)
    strand, segment = np.nonzero(drawn)
    first = 2 * (strand * points.shape[1] + segment)[:, None]
    triangles = (first + np.array([[0, 1, 2, 2, 1, 3]])).reshape(-1, 3)
    return edges, triangles
