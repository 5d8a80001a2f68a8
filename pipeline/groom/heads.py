"""The head that hair grows on: the built-in mannequin or a mesh, with one scalp chart for both.

The mannequin's skull is laid onto a mesh's by one scale and one offset (`fit`); the mannequin's
hairline, parting and cut heights then hold on it. Grooming happens in these fitted coordinates.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from dataclasses import field as default
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline import kernels
from pipeline.body.distance import Grid
from pipeline.body.normals import point_normals
from pipeline.body.placement import Placement
from pipeline.config.schema import Config
from pipeline.errors import InputError
from pipeline.groom.axes import file_axis
from pipeline.groom.fit import better_turned, fit_skull
from pipeline.groom.head import scalp
from pipeline.groom.head_field import Field
from pipeline.groom.region import Region
from pipeline.progress import say
from pipeline.strands.chart import Chart

Points = NDArray[np.floating[Any]]
Feet = Callable[[Points], tuple[Points, Points]]

_SMALLEST, _LARGEST = 0.05, 3.0  # [m] from end to end of a mesh; the largest are whole bodies
_STUBBLE = 0.7  # part of the scalp's colour that roots hide


@dataclass(frozen=True)
class Skin:
    """A closed triangle mesh with normals and colours."""

    points: NDArray[np.float32]
    """(V, 3) [m]"""
    triangles: NDArray[np.int32]
    """(T, 3), counter-clockwise seen from outside."""
    normals: NDArray[np.float32]
    """(V, 3), unit, outwards."""
    albedo: NDArray[np.float32]
    """(V, 3) linear RGB."""


@dataclass(frozen=True)
class Head:
    """A head in world coordinates, and where the mannequin's coordinates lie in it."""

    skin: Skin
    field: Field
    """Distance to the skin, world."""
    scale: float
    """World metres per fitted metre."""
    offset: NDArray[np.float64]
    """World position of the fitted origin [m]."""
    project: Feet
    """Pulls points (N, 3) near the skin onto it and tells the normals there; fitted coordinates."""
    arrays: Mapping[str, NDArray[np.float32]] = default(default_factory=dict)
    """Painted numbers (V,) on the points of the skin, by name."""
    texture: NDArray[np.float32] | None = None
    """(T, 3, 2) texture coordinates of the corners of its triangles, if it has any."""
    closest: kernels.MeshDistance | None = None
    """Finds the triangles of the skin that are nearest to points, world; for paint and texture coordinates."""
    region: Region = default(default_factory=Region)
    """Where hair grows."""

    @cached_property
    def fitted_field(self) -> Field:
        """Distance to the skin in fitted coordinates."""
        return self.field.rescaled(self.scale, self.offset)

    @property
    def fitted_chart(self) -> Chart:
        """The chart of the scalp, in fitted coordinates."""
        return scalp.chart()

    @property
    def chart(self) -> Chart:
        """The chart of the scalp, world."""
        return scalp.chart().placed(self.scale, self.offset)

    def on_skin(self, uv: Points) -> NDArray[np.float64]:
        """Points (N, 3) of the skin at chart points (N, 2), in fitted coordinates."""
        return scalp.on_skin(self.fitted_field, uv)

    def density(self, p: Points) -> Points:
        """Relative density of roots at fitted points on the skin, 0 to 1; see `Region.density`."""
        return self.region.density(self, p)

    def uv(self, p: Points) -> NDArray[np.float64]:
        """Texture coordinates (N, 2) of fitted points on the skin: the mesh's, or the scalp chart from 0 to 1."""
        if self.texture is None:
            return np.asarray(0.5 + 0.5 * self.fitted_chart.uv(p))
        triangle, weight = self._feet(p)
        return np.asarray(np.einsum("nk,nki->ni", weight, self.texture[triangle]), np.float64)

    def array(self, name: str, p: Points) -> NDArray[np.float64]:
        """A painted array at fitted points (N, 3), linear in the triangle that is nearest to each.

        Raises InputError for an array that the mesh does not have.
        """
        values = self.painted(name)
        triangle, weight = self._feet(p)
        return np.asarray((values[self.skin.triangles[triangle]] * weight).sum(axis=1), np.float64)

    def painted(self, name: str) -> NDArray[np.float32]:
        """A painted array (V,). Raises InputError for one that the mesh does not have, or that is not finite."""
        if name not in self.arrays:
            there = f"it has {', '.join(self.arrays)}" if self.arrays else "it has none"
            raise InputError(
                f'scene.head: no painted array "{name}" on the points of this mesh; {there} '
                "(PLY, VTP and what meshio reads can hold them)"
            )
        if not np.isfinite(self.arrays[name]).all():
            raise InputError(
                f'scene.head: the painted array "{name}" is not finite everywhere; paint it again'
            )
        return self.arrays[name]

    def _feet(self, p: Points) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
        """The triangle nearest to each fitted point (N, 3), and the weights (N, 3) of its corners there."""
        assert self.closest is not None
        return self.closest.feet(np.ascontiguousarray(self.to_world(p), np.float64))

    def to_world(self, p: Points) -> Points:
        """Fitted coordinates to world coordinates."""
        return np.asarray(p * self.scale + self.offset)


def make_head(config: Config) -> Head | None:
    """The head of a config; None for "none". Raises InputError for a mesh that cannot serve."""
    if config.scene.head == "none":
        return None
    head = _mannequin(config) if config.scene.head == "builtin" else _from_mesh(config)
    if config.groom.source == "procedural":
        _darken_scalp(head)
    return head


def _mannequin(config: Config) -> Head:
    from pipeline.groom.head import distance, skin, surface

    points, triangles, normals = surface.contour()
    field, closest = _measured(points, triangles, config)
    return Head(
        skin=Skin(points, triangles, normals, skin.albedo(points, normals, config.scene.skin)),
        field=field,
        closest=closest,
        scale=1.0,
        offset=np.zeros(3),
        project=lambda p: distance.foot(p, steps=1, reach=surface.REACH),
        region=Region(config.groom.scalp),
    )


def _from_mesh(config: Config) -> Head:
    from pipeline.groom.head.skin import srgb_to_linear
    from pipeline.groom.head.table import load_table
    from pipeline.groom.head_mesh import load_mesh

    scene = config.scene
    mesh = load_mesh(Path(scene.head), scene.unit_scale, scene.up_axis, scene.face_axis)
    points, triangles = mesh.points, mesh.triangles
    largest = float(np.ptp(points, axis=0).max())
    if not _SMALLEST < largest < _LARGEST:
        raise InputError(
            f"{scene.head}: {largest:.3g} m from end to end is not the size of a head; "
            "scene.unit_scale is metres per unit of the file (0.01 for centimetres)"
        )
    normals = point_normals(points, triangles).astype(np.float32)
    tone = srgb_to_linear(np.array(load_table()["skin"][scene.skin]))
    field, closest = _measured(points, triangles, config)
    region = Region(config.groom.scalp)
    placement = _fitted(config, points, field, region)
    scale, offset = placement.scale, np.array(placement.offset)
    albedo = np.tile(tone, (len(points), 1)).astype(np.float32)
    return Head(
        skin=Skin(points, triangles, normals, albedo),
        field=field,
        closest=closest,
        scale=scale,
        offset=offset,
        project=_grid_feet(field.rescaled(scale, offset)),
        arrays=mesh.arrays,
        texture=mesh.uv,
        region=region,
    )


def _measured(
    points: Points, triangles: NDArray[np.integer], config: Config
) -> tuple[Field, kernels.MeshDistance]:
    grid = Grid.around(points, config.simulate.contact.spacing)
    closest = grid.measure(points, triangles)
    return Field(closest.values, grid.origin, grid.spacing), closest


def _fitted(config: Config, points: Points, field: Field, region: Region) -> Placement:
    """Where the mannequin lies in a mesh; a mesh that looks another way is refused, or told of."""
    scene = config.scene
    fit = fit_skull(points, field)
    say(
        "groom",
        f"the skull is {fit.placement.scale:.2f} of the built-in head's, and fits it within {1e3 * fit.apart:.1f} mm",
    )
    turn = better_turned(points, field, fit)
    if turn is not None:
        up, face = (file_axis(turn[k], scene.up_axis, scene.face_axis) for k in (1, 2))
        told = (
            f'{scene.head}: this head seems to look along "{face}" of its file with "{up}" up; '
            f'set scene.up_axis = "{up}" and scene.face_axis = "{face}"'
            + (", after turning it over" if up[0] == "-" else "")
        )
        if config.groom.source == "procedural" and region.automatic:
            raise InputError(f"{told}, or say where hair grows by groom.scalp")
        say("groom", told)
    return fit.placement


def _darken_scalp(head: Head) -> None:
    """Roots and stubble between the strands, which no strand stands for."""
    covered = head.density((head.skin.points - head.offset) / head.scale)
    head.skin.albedo[:] *= (1 - _STUBBLE * covered)[:, None]


def _grid_feet(field: Field) -> Feet:
    def project(p: Points) -> tuple[Points, Points]:
        for _ in range(2):
            d, n = field.sample(p)
            p = p - d[:, None] * n
        return p, n

    return project
