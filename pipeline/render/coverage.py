"""Strands by exact coverage over what VTK has drawn; see `pipeline.kernels.Raster`.

All strands of a frame are counted first, beside their light, so that hair that nobody can see is neither shaded nor
drawn. Then `draw` takes them once more, and again for the few tiles where the guess of what can be seen was wrong.
"""

from collections.abc import Callable, Iterable, Iterator
from functools import partial

import numpy as np
from numpy.typing import NDArray

from pipeline import kernels
from pipeline.render.layers import Layers
from pipeline.render.target import DECODED, NOTHING, Target
from pipeline.render.view import View

Points = NDArray[np.float32]
Chunk = tuple[Points, Points, Points, NDArray[np.uint32]]
"""Points (S, P, 3) [m], widths (S, P) [m], variation (S, 3), random keys (S,)."""
Chunks = Callable[[], Iterable[Chunk]]

_PARTS = (np.arange(256) / 255).astype(np.float32)
_LAYERS = 14.0  # of hair that hide the rest: with fewer, more pixels are drawn twice; with more, more is sorted for nothing


class Coverage:
    """Frames of one size: `begin`, `count` all strands, then `draw` them over the target."""

    def __init__(self, target: Target, size: tuple[int, int]) -> None:
        """Prepare for frames of `size` [px] over the target."""
        self._target, self._size = target, size
        self._raster = kernels.Raster(size, _LAYERS)
        self._blank: kernels.Backdrop | None = None

    def begin(self, camera: View) -> None:
        """Start a frame; the target has been cleared for it."""
        scale = self._size[1] / 2 / np.tan(camera.field_of_view / 2)
        self._raster.begin(self._target.matrix(), scale, self._target.planes())

    def count(self, first: int, points: Points, widths: Points) -> None:
        """Look at strands (S, P, 3) [m] with widths (S, P) [m], which begin with number `first`."""
        self._raster.count(points, widths, first)

    def draw(self, chunks: Chunks, shader: kernels.PointShader) -> Points:
        """Linear RGB (H, W, 3) of all strands over what the target shows.

        `chunks` gives all of them, the same each time that it is called.
        """
        if self._target.blank:  # the same everywhere: one sample tells it
            if self._blank is None:
                across, down = self._size
                depth = np.full((down, across), NOTHING, np.float32)
                one = np.ascontiguousarray(np.broadcast_to(self._target.background_bytes, (down, across, 3)))
                self._blank = kernels.Backdrop(depth, one, DECODED, 1)
            return self._drawn(chunks, shader, self._blank)
        backdrop = self._backdrop(self._target.depth(), self._target.read(), DECODED)
        return self._drawn(chunks, shader, backdrop)

    def layers(self, chunks: Chunks, camera: View) -> Layers:
        """The layers of all strands and of what the target shows; the target has been cleared for the camera."""
        depth = self._target.depth()
        solid = np.zeros((*depth.shape, 3), np.uint8)
        solid[..., 0] = np.where(depth < NOTHING, 255, 0)
        backdrop = self._backdrop(depth, solid, _PARTS)
        across, down = self._size
        strand = np.zeros((down, across), np.uint32)
        numbered = partial(_numbered, chunks)
        self._recount(numbered, camera)
        shader = kernels.DistanceShader(camera.position, camera.ahead())
        parts = self._drawn(numbered, shader, backdrop, strand)
        self._recount(numbered, camera)
        blank = self._backdrop(depth, np.zeros_like(solid), _PARTS)
        tangent = self._drawn(numbered, kernels.TangentShader(), blank)
        parts[..., 2] += (parts[..., 0] - parts[..., 1]) * self._distance(depth)
        return Layers(np.concatenate([parts, tangent], axis=2), strand)

    def _recount(self, chunks: Chunks, camera: View) -> None:
        self.begin(camera)
        first = 0
        for points, widths, _, _ in chunks():
            self.count(first, points, widths)
            first += len(points)

    def _backdrop(self, depth: Points, samples: NDArray[np.uint8], decode: Points) -> kernels.Backdrop:
        return kernels.Backdrop(depth, samples, decode, self._target.width // self._size[0])

    def _drawn(
        self,
        chunks: Chunks,
        shader: kernels.PointShader,
        backdrop: kernels.Backdrop,
        names: NDArray[np.uint32] | None = None,
    ) -> Points:
        across, down = self._size
        self._raster.cut_off(backdrop)
        picture = np.empty((down, across, 3), np.float32)
        wrong = 1
        while wrong:
            for chunk in chunks():
                self._raster.add(*chunk)
            wrong = self._raster.compose(backdrop, shader, picture, names)
        return picture

    def _distance(self, depth: Points) -> Points:
        """Mean distance [m] of what is drawn in each pixel (H, W), of the depths of its samples; 0 where nothing is."""
        near, far = self._target.planes()
        there = depth < NOTHING
        distance = np.where(there, near / (1 - np.minimum(depth, 1) * (far - near) / far), 0)
        across, down = self._size
        per_side = self._target.width // across
        blocks = (down, per_side, across, per_side)
        count = there.reshape(blocks).sum(axis=(1, 3))
        total = distance.reshape(blocks).sum(axis=(1, 3))
        return np.asarray(total / np.maximum(count, 1), np.float32)


def _numbered(chunks: Chunks) -> Iterator[Chunk]:
    """The same strands, with their numbers, from 1, for keys."""
    first = 1
    for points, widths, variation, _ in chunks():
        yield points, widths, variation, np.arange(first, first + len(points), dtype=np.uint32)
        first += len(points)
