"""One frame: expand the strands, let light through them, shade them, draw them and the head."""

from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from copy import copy
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from pipeline import kernels
from pipeline.body.placement import Placement
from pipeline.config.schema import Config
from pipeline.render import pigment
from pipeline.render.camera import CameraPath
from pipeline.render.chunks import Chunks
from pipeline.render.coverage import Chunk, Coverage
from pipeline.render.finer import Finer
from pipeline.render.geometry import (
    Shape,
    choose_shapes,
    drawn_width,
    one_fibre_each,
    projected_width,
    ribbons,
    smooth,
    smooth_colours,
    taper,
)
from pipeline.render.layers import Layers
from pipeline.render.lighting import Lighting, told_apart
from pipeline.render.target import DECODED, Target, encode
from pipeline.render.tone import CURVES, Pixels, average, develop
from pipeline.render.view import Place, View
from pipeline.strands.expand import Expansion, MovedSkin

Points = NDArray[np.float32]
Linear = NDArray[np.float32]

_MARGIN = 0.02  # [m] that strands may leave the bounds of their guides
_PIECE = 8192  # strands that OpenGL draws at once: it takes 20 times the memory of their points


@dataclass(frozen=True)
class Skin:
    """The head as it is drawn, in its rest pose."""

    points: Points
    """(V, 3) [m]"""
    triangles: NDArray[np.int32]
    """(T, 3)"""
    normals: Points
    """(V, 3)"""
    albedo: Points
    """(V, 3) linear RGB."""
    field: kernels.DistanceField
    """Distance to it, for its own shadow."""
    curvature: NDArray[np.float32] | None = None
    """(V,) [1/m]: light goes round below the skin; None where it does not."""


@dataclass(frozen=True)
class Moment:
    """What is drawn: guides (G, P, 3) float32 [m] and the head's pose (4, 4), rest -> world."""

    guides: Points
    pose: NDArray[np.float64]
    skin: Skin | None = None
    """The head where it is not as at rest, still in its rest frame."""
    moved: MovedSkin | None = None
    """Where that skin has carried the roots."""


@dataclass
class _Lit:
    """The strands of a moment, and the light on them."""

    chunks: Chunks
    lighting: Lighting
    moment: Moment | None = None

    def beside(self, strands: Expansion, count: int) -> "_Lit":
        """Another one for the same strands and lights."""
        return _Lit(Chunks(copy(strands), count), self.lighting.beside())


class FrameRenderer:
    """Renders moments of one experiment into one framebuffer."""

    def __init__(
        self,
        config: Config,
        strands: Expansion,
        key: NDArray[np.uint32],
        skin: Skin | None = None,
        head: Placement | None = None,
    ) -> None:
        """Prepare for strands with random keys (N,). Raises InputError when there is no off-screen OpenGL."""
        render, scene = config.render, config.scene
        self.render, self.camera = render, CameraPath.of(scene.camera, head or Placement()).at(0.0)
        self.strands, self.key, self.skin = strands, key, skin
        self.count = min(render.strands or strands.count, strands.count)
        self.width = drawn_width(render, self.count, strands.count)
        self._points = self.count * ((strands.points - 1) * render.subdivide + 1)
        self.variation = pigment.variation(render.hair, config.seed, key)
        single = one_fibre_each(render, self.count, strands.count)
        self._now = _Lit(Chunks(strands, self.count), Lighting(scene, render.hair, render.grid, single))
        lights = self._now.lighting.lights
        told = told_apart(self._points, self.count * strands.length, self.width, lights)
        # What stands for several fibres lies among more and thinner ones
        self._told = told if single else 0.0
        self._next = self._now.beside(strands, self.count)
        self._ahead = ThreadPoolExecutor(1, "light")
        across, down = (side * render.samples for side in render.size)
        # Exposure and tone curve apply to what is lit; the background is meant as it is written.
        background = CURVES[render.tone].linear(np.array(scene.background)) / render.gain
        self.target = Target(across, down, tuple(background.tolist()))
        self.background = DECODED[encode(background)]
        self._coverage = Coverage(self.target, render.size)
        self._widths = np.zeros((0, 0), np.float32)
        self._finer: Finer | None = None  # of the head, whose triangles stay

    @property
    def lighting(self) -> Lighting:
        """The light on the moment that is drawn."""
        return self._now.lighting

    def prepare(self, read: Callable[[], Moment]) -> "Future[Moment]":
        """Read the moment that is drawn next, and light it as well, both beside the drawing of this one.

        It is only read where memory does not hold the points of two moments, and where OpenGL draws all strands, which
        keeps the processors busy as it is. At most one moment is prepared at a time.
        """
        if self._next.moment is not None:  # which is drawn from now on
            self._now, self._next = self._next, self._now
        free = self._next
        ahead = free.chunks.two_fit and self.render.geometry in ("auto", "coverage")

        def ready() -> Moment:
            moment = read()
            if ahead:
                self._light(free, moment, None)
            return moment

        free.moment = None
        return self._ahead.submit(ready)

    def close(self) -> None:
        """Free the framebuffer."""
        self._ahead.shutdown()
        self.target.close()

    def pixels(self, moment: Moment, view: View | None = None) -> float:
        """Projected width [px] of strands at a moment."""
        middle = moment.guides.reshape(-1, 3).mean(axis=0, dtype=np.float64)
        return projected_width(self.render, view or self.camera, self.width, middle)

    def shape(self, moment: Moment, view: View | None = None) -> tuple[str, float]:
        """How strands are drawn at a moment, "coverage and tubes" where one fades into the other, and their width [px]."""
        pixels = self.pixels(moment, view)
        return " and ".join(shape for shape, _ in choose_shapes(self.render, pixels)), pixels

    def frame(self, moment: Moment) -> Pixels:
        """Render a moment: sRGB (H, W, 3), of as many bits as the config says."""
        return self.developed(self.linear(moment))

    def developed(self, linear: Linear) -> Pixels:
        """Pixels (H, W, 3) sRGB of linear ones."""
        return develop(linear, self.render.gain, self.render.tone, self.render.bits)

    def linear(self, moment: Moment, view: View | None = None) -> Linear:
        """Render a moment as `view` sees it, or the camera of the scene: linear RGB (H, W, 3) before the exposure.

        Pictures of several moments and views add up: motion blur and depth of field are means of them. The light on
        the moment of the call before, the same object, is there already.
        """
        camera = view or self.camera
        pixels = self.pixels(moment, camera)
        parts = choose_shapes(self.render, pixels)
        if len(parts) == 1:
            return self._picture(moment, camera, parts[0][0], pixels)
        pictures = [self._picture(moment, camera, shape, pixels) * np.float32(part) for shape, part in parts]
        return np.asarray(pictures[0] + pictures[1])

    def layers(self, moment: Moment, view: View) -> Layers:
        """What the picture shows besides colours that `linear` has just given of this moment."""
        if moment is not self._now.moment:
            raise ValueError("layers are those of the moment that was rendered last")
        self._clear(moment, view)
        self._draw_head(moment, view.position)
        return self._coverage.layers(self._drawn, view)

    def _picture(self, moment: Moment, camera: View, shape: Shape, pixels: float) -> Linear:
        """The linear picture with all strands drawn in one shape, which are so wide [px]."""
        self._clear(moment, camera)
        coverage = self._coverage if shape == "coverage" else None
        if coverage is not None:
            coverage.begin(camera)
        if moment is self._next.moment:
            self._now, self._next = self._next, self._now
        if moment is not self._now.moment:
            self._light(self._now, moment, coverage)
        elif coverage is not None:
            for first, points in self._now.chunks:
                coverage.count(first, points, self._own_widths(points))
        self._draw_head(moment, camera.position)
        if coverage is not None:
            return coverage.draw(self._drawn, self.lighting.shader(camera.position))
        wider = max(1.0, 1 / (pixels * self.render.samples)) if shape == "lines" else 1.0
        veil = self.lighting.veil(camera.position, wider)
        for first, points in self._now.chunks.pieces(_PIECE):
            self._draw_strands(shape, camera.position, first, points, veil.visible(points))
        return average(self.target.read(), self.render.samples)

    def _clear(self, moment: Moment, camera: View) -> None:
        self.target.clear(camera, *self._depths(camera, self._corners(moment, *_bounds(moment))))

    def _light(self, to: "_Lit", moment: Moment, coverage: Coverage | None) -> None:
        """First pass: all strands into the density grid."""
        to.moment = None
        to.chunks.move(moment.guides, moment.pose, moment.moved)
        cast = self._points if self._told else self.count * self.strands.points
        to.lighting.begin(*_bounds(moment), self.width, cast, self._told)
        for first, points in to.chunks:
            drawn = smooth(points, self.render.subdivide) if self._told else points
            to.lighting.add(drawn, self._own_widths(drawn))
            if coverage is not None:
                coverage.count(first, points, self._own_widths(points))
        skin = moment.skin or self.skin
        to.lighting.finish(skin.field if skin else None, moment.pose)
        to.moment = moment

    def _drawn(self) -> Iterator[Chunk]:
        """All strands as they are drawn by coverage."""
        for first, points in self._now.chunks:
            own = slice(first, first + len(points))
            fine = smooth(points, self.render.subdivide)
            yield fine, self._own_widths(fine), self.variation[own], self.key[own]

    def _own_widths(self, points: Points) -> NDArray[np.float32]:
        """Widths (S, P) [m] of strands (S, P, 3)."""
        strands, count, _ = points.shape
        widths = self._widths  # another thread may change which these are
        if len(widths) < strands or widths.shape[1] != count:
            profile = np.float32(self.width) * taper(self.render, count)
            self._widths = widths = np.ascontiguousarray(np.broadcast_to(profile, (strands, count)))
        return widths[:strands]

    def _draw_strands(
        self, shape: Shape, eye: Place, first: int, points: Points, visible: NDArray[np.bool_]
    ) -> None:
        """Shade and draw what is visible of strands (S, P, 3); `visible` is (S, P)."""
        seen = np.flatnonzero(visible.any(axis=1))
        if len(seen) == 0:
            return
        pieces, own = self.render.subdivide, first + seen
        shaded = np.ascontiguousarray(points[seen])
        points = smooth(shaded, pieces) if pieces > 1 else shaded
        segments = np.repeat(visible[seen, :-1] | visible[seen, 1:], pieces, axis=1)
        wanted = np.zeros(points.shape[:2], bool)
        wanted[:, :-1] |= segments
        wanted[:, 1:] |= segments
        which = np.flatnonzero(wanted).astype(np.uint32)
        shade = partial(self.lighting.shade, shaded, self.variation[own], self.key[own], eye)
        colours = np.zeros_like(points)
        colours.reshape(-1, 3)[which] = smooth_colours(shade, shaded.shape[1], pieces, which)
        if shape == "lines":
            self.target.lines(points, colours, segments)
            return
        widths = self._own_widths(points)
        if shape == "tubes":
            self.target.tubes(points, colours, widths, segments, self.render.tube_sides)
            return
        edges, triangles = ribbons(points, widths, eye, segments)
        self.target.triangles(edges.reshape(-1, 3), triangles, np.repeat(colours.reshape(-1, 3), 2, axis=0))

    def _draw_head(self, moment: Moment, eye: Place) -> None:
        """Draw the head, or where there is none the background."""
        skin, pose = moment.skin or self.skin, moment.pose
        if skin is None:
            self.target.background()
            return
        if self._finer is None:
            self._finer = Finer(skin.triangles, len(skin.points))
        finer, rotation = self._finer, pose[:3, :3]
        seen, triangles = finer.facing(skin.points, skin.normals, (eye - pose[:3, 3]) @ rotation)
        points = _turned(finer(skin.points)[seen], rotation) + pose[:3, 3].astype(np.float32)
        normals = _turned(finer(skin.normals)[seen], rotation)
        normals /= np.sqrt((normals * normals).sum(axis=1, keepdims=True))
        curvature = None if skin.curvature is None else finer(skin.curvature)[seen]
        colours = self.lighting.shade_surface(points, normals, finer(skin.albedo)[seen], eye, curvature)
        self.target.triangles(points, triangles, colours)

    def _corners(
        self, moment: Moment, lower: NDArray[np.float64], upper: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        boxes = [np.array([lower, upper])]
        skin = moment.skin or self.skin
        if skin is not None:
            box = np.array([skin.points.min(axis=0), skin.points.max(axis=0)], np.float64)
            boxes.append(_box_corners(box) @ moment.pose[:3, :3].T + moment.pose[:3, 3])
        return np.concatenate([_box_corners(boxes[0]), *boxes[1:]])

    def _depths(self, camera: View, corners: NDArray[np.float64]) -> tuple[float, float]:
        """Nearest and farthest distance [m] of corners along the line of sight."""
        forward = np.subtract(camera.look_at, camera.position)
        depth = (corners - camera.position) @ (forward / np.linalg.norm(forward))
        return float(depth.min()) - _MARGIN, float(depth.max()) + _MARGIN


def _bounds(moment: Moment) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lower and upper corner (3,) [m] of all strands, whole margins from the middle of the roots: the grid of shadows goes
    with the head and stands still while hair moves a little, so that nothing shimmers.
    """
    middle = moment.guides[:, 0].mean(axis=0, dtype=np.float64)
    lower = moment.guides.min(axis=(0, 1)) - middle
    upper = moment.guides.max(axis=(0, 1)) - middle
    return (
        middle + _MARGIN * np.floor(lower / _MARGIN - 1),
        middle + _MARGIN * np.ceil(upper / _MARGIN + 1),
    )


def _turned(vectors: Points, rotation: NDArray[np.float64]) -> Points:
    """Vectors (N, 3) turned by a matrix (3, 3); column by column, which wakes no threads."""
    x, y, z = (vectors[:, i : i + 1] * rotation[:, i].astype(np.float32) for i in range(3))
    return np.asarray(x + y + z, np.float32)


def _box_corners(box: NDArray[np.float64]) -> NDArray[np.float64]:
    """All 8 corners of a box given by its lower and upper corner (2, 3)."""
    choice = np.stack(np.meshgrid([0, 1], [0, 1], [0, 1], indexing="ij"), axis=-1).reshape(-1, 3)
    return np.asarray(box[choice, np.arange(3)])
