"""Light on hair and head in one frame: shadows from a grid of voxels, radiance from the shading kernels.

All strands of a frame are added first, in any chunks, because each shadows all others. Drawn widths count: the grid
holds the strands that are drawn, so that fewer, wider strands cover and shadow as much as many thin ones.
"""

import math
from copy import copy
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from pipeline import kernels
from pipeline.config.schema import Fibre, Scene
from pipeline.render import fibre, pigment
from pipeline.render.lights import as_directions
from pipeline.render.sky import Sky
from pipeline.render.veil import Veil
from pipeline.strands.random import uniform

_F32 = NDArray[np.float32]
_F64 = NDArray[np.float64]

_MARGIN: Final = 3
"""Empty voxels around the hair, so that blur and slanted rays lose nothing."""
_FINER: Final = 3
"""Nodes of the shadow maps along a voxel."""
_CASTERS: Final = 200_000
"""Points of strands from which on not all cast shadows: of c times as many one in c^0.7."""
_CASTER: Final = 41  # salt
_POINTS: Final = (170_000, _CASTERS)
"""Points up to which light goes past single strands, and from which on past none."""
_PIECES: Final = (1_500_000, 1_900_000)
"""The same of what it costs in time and memory: points and lengths of eight widths together, for each light."""
_OPAQUE: Final = 4
"""Times that the head is denser for the eye than for light: two voxels of it hide everything."""


def pieces(points: int, length: float, width: float) -> float:
    """What it takes a light to go past single strands: of so many points, so long in all and so wide each [m]."""
    return points + length / (8 * width)


def told_apart(points: int, length: float, width: float, lights: int) -> float:
    """Part of the strands (0 .. 1) that light goes past one by one; it depends on neither camera nor frame.

    They have so many points, are so long in all [m] and so wide each [m], under so many lights.
    """
    costs = (points, _POINTS), (lights * pieces(points, length, width), _PIECES)
    return float(min(np.clip((none - cost) / (none - all_of), 0, 1) for cost, (all_of, none) in costs))


@dataclass(frozen=True)
class _Shadowed:
    """What is known once all strands of a frame are in."""

    origin: _F64
    """(3,) [m]: outer corner of the first voxel."""
    spacing: float
    """[m]"""
    head: kernels.DistanceField | None
    pose: _F64
    hair: _F32
    """(nx, ny, nz) [1/m]: strands per length of a ray."""
    body: _F32 | None
    """(nx, ny, nz) [1/m]: the head as an almost opaque solid; None where there is none."""
    coarse: _F32 | None
    """(nx/2, ny/2, nz/2) [1/m]: the same on the sky's voxels."""


class Lighting:
    """Light on hair and head, frame by frame: `begin`, `add` all strands, `finish`, then `shade` any of them."""

    def __init__(self, scene: Scene, hair: Fibre, grid: int, one_fibre_each: bool = True) -> None:
        """Prepare what does not change from frame to frame: `grid` voxels along the longest side of the hair.

        Strands that are no `one_fibre_each` show their mean over their width, however wide they are drawn.
        """
        self._hair = hair
        self._voxels = grid
        self._directions, self._irradiance = as_directions(scene.lights)
        self._sky = np.array(scene.environment, np.float32)
        scattering = fibre.Scattering(hair.roughness, hair.azimuthal_roughness, hair.tilt, hair.reciprocal)
        colours = pigment.table(hair)
        self._tables = scattering.tables(colours, one_fibre_each)
        middle = colours[:, colours.shape[1] // 2, :3]
        self._around = Sky(scattering, middle.mean(axis=0, dtype=np.float64))
        # Light that comes from everywhere has passed all of the strands
        self._loss = scattering.loss(middle).mean(axis=0, dtype=np.float64).astype(np.float32)
        self._grid: kernels.DensityGrid | None = None
        self._shadows = kernels.Shadows(self._directions)  # its maps keep their memory from frame to frame
        self._frame: _Shadowed | None = None
        self._seen: tuple[_F64, kernels.Illumination] | None = None

    @property
    def lights(self) -> int:
        """How many directions light comes from, besides the sky."""
        return len(self._directions)

    def beside(self) -> "Lighting":
        """Another one with the same lights, for the frames between."""
        other = copy(self)
        other._shadows = kernels.Shadows(self._directions)
        return other

    def begin(self, lower: _F64, upper: _F64, width: float, points: int = 0, told: float = 0.0) -> None:
        """Start a frame: bounds (3,) float64 [m] of all strands, a typical drawn width [m], how many points all have, and
        what part of the strands is `told_apart`.

        Raises:
            ValueError: bounds that are not finite or upside down.

        """
        size = np.asarray(upper, np.float64) - lower
        if not np.isfinite(size).all() or (size < 0).any():
            raise ValueError(f"bounds of the hair: {lower} to {upper}")
        spacing = max(float(size.max()), 1e-3) / (self._voxels - 2 * _MARGIN)
        # Even extents: the sky is sampled on voxels twice as large
        shape = 2 * np.ceil((size / spacing + 2 * _MARGIN) / 2).astype(int)
        origin = np.asarray(lower, np.float64) - (shape * spacing - size) / 2
        nx, ny, nz = (int(extent) for extent in shape)
        self._grid = kernels.DensityGrid((nx, ny, nz), origin, spacing, width)
        low = np.asarray(lower, np.float64)
        self._every = max(math.ceil((points / _CASTERS) ** 0.7), 1)
        self._shadows.begin(low, low + size, spacing / _FINER, width, 1 / self._every, told)
        self._added = 0
        self._frame, self._seen = None, None

    def add(self, points: _F32, widths: _F32) -> None:
        """Add strands that cast shadows: points (S, P, 3) float32 [m], widths (S, P) float32 [m], in any chunks.

        Of very many one in each group of neighbours casts the shadows of all: as wide as they are together.
        """
        grid = self._started()
        if self._every > 1:
            last = self._added + len(points)
            group = np.arange(self._added // self._every, (last - 1) // self._every + 1)
            chosen = self._every * group + np.floor(uniform(0, group, _CASTER) * self._every).astype(np.int64)
            chosen = chosen[(chosen >= self._added) & (chosen < last)] - self._added
            self._added = last
            points, widths = points[chosen], widths[chosen] * np.float32(self._every)
        grid.add(points, widths)
        self._shadows.add(points, widths)

    def finish(self, head: kernels.DistanceField | None, pose: _F64) -> None:
        """Let light through what was added and the head, which stands at `pose` (4, 4), rest -> world."""
        grid = self._started()
        origin = np.array(grid.origin)
        density = grid.density()
        body = coarse = None
        if head is not None:
            nx, ny, nz = grid.shape
            body = kernels.body_density(head, pose, grid.shape, origin, grid.spacing)
            coarse = kernels.body_density(head, pose, (nx // 2, ny // 2, nz // 2), origin, 2 * grid.spacing)
        # A fibre seen from all sides shows pi / 4 of its length * width
        hair = density * np.float32(np.pi / 4)
        self._shadows.finish(hair, origin, grid.spacing, head, pose)
        self._frame = _Shadowed(origin, grid.spacing, head, pose, hair, body, coarse)
        self._grid = None

    def veil(self, eye: _F64, wider: float) -> Veil:
        """What hair and head hide from an eye (3,) [m], when strands are drawn `wider` than they shadow."""
        frame = self._finished()
        density = np.float32(wider) * frame.hair
        if frame.body is not None:
            density += np.float32(_OPAQUE) * frame.body
        return Veil(density, frame.origin, frame.spacing, eye)

    def shader(self, eye: _F64) -> kernels.FibreShader:
        """Return what shades points of strands as seen from `eye` (3,) float64 [m]."""
        return kernels.FibreShader(self._light(eye), self._tables, eye)

    def shade(
        self, points: _F32, variation: _F32, key: NDArray[np.uint32], eye: _F64, which: NDArray[np.uint32]
    ) -> _F32:
        """Linear RGB (n, 3) float32, as seen from `eye` (3,), of points (n,), flat indices, of strands (S, P, 3).

        The strands have variations (S, 3), see `pipeline.render.pigment`, and random keys (S,).
        """
        return kernels.shade(points, variation, key, eye, self._light(eye), self._tables, which)

    def shade_surface(
        self, points: _F32, normals: _F32, albedo: _F32, eye: _F64, curvature: _F32 | None = None
    ) -> _F32:
        """Linear RGB (N, 3) float32 of points of the head (N, 3), with unit normals and linear albedo (N, 3).

        Curvature (N,) [1/m] lets light go round below the skin; unset, the head is flat to it.
        """
        frame = self._finished()
        flat = np.zeros(len(points), np.float32) if curvature is None else curvature
        surface = kernels.Surface(points, normals, albedo, flat)
        return kernels.shade_surface(surface, eye, self._light(eye), frame.head, frame.pose, self._loss)

    def _light(self, eye: _F64) -> kernels.Illumination:
        """Lights and sky as an eye (3,) [m] sees them: of the light that comes from everywhere, hair that is seen sends
        on most of what reaches it from behind.
        """
        if self._seen is not None and np.array_equal(self._seen[0], eye):
            return self._seen[1]
        frame, shadows = self._finished(), self._shadows
        assert shadows is not None
        sides = frame.spacing * np.array(frame.hair.shape)
        answers = self._around.answers(eye - (frame.origin + sides / 2), float(np.linalg.norm(sides)))
        sky, everywhere = kernels.surroundings(
            frame.hair, frame.coarse, frame.spacing, self._loss, self._around.directions, answers
        )
        light = kernels.Illumination(self._directions, self._irradiance, self._sky, shadows, sky, everywhere)
        x, y, z = (float(each) for each in frame.origin)
        light.origin, light.spacing, light.glints = (x, y, z), frame.spacing, self._hair.glints
        self._seen = np.array(eye), light
        return light

    def _started(self) -> kernels.DensityGrid:
        if self._grid is None:
            raise ValueError("begin a frame first")
        return self._grid

    def _finished(self) -> _Shadowed:
        if self._frame is None:
            raise ValueError("finish the frame first")
        return self._frame
