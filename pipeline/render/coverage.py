"""Strands by exact coverage over what VTK has drawn; see `pipeline.kernels.Raster`.

All strands of a frame are counted first, beside their light, so that hair that nobody can see is neither shaded nor
drawn. Then `draw` takes them once more, and again for the few tiles where the guess of what can be seen was wrong.
"""

from collections.abc import Callable, Iterable

import numpy as np
from numpy.typing import NDArray

from pipeline import kernels
from pipeline.render.target import DECODED, Target
from pipeline.render.view import View

Points = NDArray[np.float32]
Chunk = tuple[Points, Points, Points, NDArray[np.uint32]]
"""Points (S, P, 3) [m], widths (S, P) [m], absorption (S, 3), random keys (S,)."""

_LAYERS = 40.0  # of hair that hide the rest: with fewer, more pixels are drawn twice; with more, more is sorted for nothing


class Coverage:
    """Frames of one size: `begin`, `count` all strands, then `draw` them over the target."""

    def __init__(self, target: Target, size: tuple[int, int]) -> None:
        """Prepare for frames of `size` [px] over the target."""
        self._target, self._size = target, size
        self._raster = kernels.Raster(size, _LAYERS)

    def begin(self, camera: View) -> None:
        """Start a frame; the target has been cleared for it."""
        scale = self._size[1] / 2 / np.tan(camera.field_of_view / 2)
        self._raster.begin(self._target.matrix(), scale, self._target.planes())

    def count(self, first: int, points: Points, widths: Points) -> None:
        """Look at strands (S, P, 3) [m] with widths (S, P) [m], which begin with number `first`."""
        self._raster.count(points, widths, first)

    def draw(self, chunks: Callable[[], Iterable[Chunk]], shader: kernels.PointShader) -> Points:
        """Linear RGB (H, W, 3) of all strands over what the target shows.

        `chunks` gives all of them, the same each time that it is called.
        """
        across, down = self._size
        samples, depth = np.ascontiguousarray(self._target.read()), self._target.depth()
        backdrop = kernels.Backdrop(depth, samples, DECODED, self._target.width // across)
        self._raster.cut_off(backdrop)
        picture = np.empty((down, across, 3), np.float32)
        wrong = 1
        while wrong:
            for chunk in chunks():
                self._raster.add(*chunk)
            wrong = self._raster.compose(backdrop, shader, picture)
        return picture
