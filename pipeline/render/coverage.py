"""Strands by exact coverage over what VTK has drawn; see `pipeline.kernels.Raster`.

All strands of a frame are counted first, beside their light, so that hair that nobody can see is neither shaded nor
drawn. Then `draw` takes them once more, and again for the few tiles where the guess of what can be seen was wrong.
"""

from collections.abc import Callable, Iterable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from pipeline import kernels
from pipeline.render.geometry import Which, smooth, smooth_colours
from pipeline.render.target import DECODED, Target
from pipeline.render.view import View

Points = NDArray[np.float32]
Chunks = Callable[[], Iterable[tuple[int, Points]]]
"""All strands in chunks: the number of the first, and their points (S, P, 3) [m]; the same each time."""
Shade = Callable[[int, Points, Which], NDArray[np.float32]]
"""Linear RGB (n, 3) of some of the points (n,), flat indices, of a chunk."""

_LAYERS = 33.0  # of hair that hide the rest: with fewer, more pixels are drawn twice; with more, more is shaded for nothing


class Coverage:
    """One frame: `count` all strands, then `draw` them over the target."""

    def __init__(self, target: Target, size: tuple[int, int], camera: View) -> None:
        """Start a frame of `size` [px]; the target has been cleared for it."""
        self._target, self._size = target, size
        scale = size[1] / 2 / np.tan(camera.field_of_view / 2)
        self._raster = kernels.Raster(size, target.matrix(), scale, target.planes(), _LAYERS)

    def count(self, first: int, points: Points, widths: Points) -> None:
        """Look at strands (S, P, 3) [m] with widths (S, P) [m], which begin with number `first`."""
        self._raster.count(points, widths, first)

    def draw(self, chunks: Chunks, widths: Callable[[Points], Points], pieces: int, shade: Shade) -> Points:
        """Linear RGB (H, W, 3) of all strands, with `pieces` drawn segments per segment, over what the target shows."""
        across, down = self._size
        samples, depth = np.ascontiguousarray(self._target.read()), self._target.depth()
        backdrop = kernels.Backdrop(depth, samples, DECODED, self._target.width // across)
        self._raster.cut_off(backdrop)
        picture = np.empty((down, across, 3), np.float32)
        wrong = 1
        while wrong:
            for first, points in chunks():
                fine = smooth(points, pieces) if pieces > 1 else points
                seen = self._raster.add(fine, widths(fine))
                shaded = partial(shade, first, points)
                self._raster.colour(smooth_colours(shaded, points.shape[1], pieces, seen))
            wrong = self._raster.compose(backdrop, picture)
        return picture
