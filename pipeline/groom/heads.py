"""The head that hair grows on: the built-in mannequin or a mesh, with one scalp chart for both.

A mesh's skull is fitted to the mannequin's by crown, breadth and depth (one scale, one offset); the mannequin's
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
from pipeline.config.schema import Config
from pipeline.errors import InputError
from pipeline.groom.head import scalp
from pipeline.groom.head_field import Field, distance_grid
from pipeline.strands.chart import Chart

Points = NDArray[np.floating[Any]]
Feet = Callable[[Points], tuple[Points, Points]]

# The mannequin's skull [m]: what a mesh is fitted to.
_CROWN, _BREADTH, _OCCIPUT, _TOP = 0.131, 0.158, -0.0876, 0.075

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
        """Relative density of roots at fitted points on the skin."""
        return scalp.density(p)

    def uv(self, p: Points) -> Points:
        """Texture coordinates (N, 2), 0 to 1, of fitted points on the skin: the scalp chart."""
        return np.asarray(0.5 + 0.5 * self.fitted_chart.uv(p))

    def array(self, name: str, p: Points) -> NDArray[np.float64]:
        """A painted array at fitted points (N, 3), linear in the triangle that is nearest to each.

        Raises InputError for an array that the mesh does not have.
        """
        if name not in self.arrays:
            there = f"it has {', '.join(self.arrays)}" if self.arrays else "it has none"
            raise InputError(f'scene.head: no painted array "{name}" on this mesh; {there}')
        triangle, weight = self._mesh.feet(np.ascontiguousarray(self.to_world(p), np.float64))
        corner = self.skin.triangles[triangle]
        return np.asarray((self.arrays[name][corner] * weight).sum(axis=1), np.float64)

    @cached_property
    def _mesh(self) -> kernels.MeshDistance:
        grid = Grid.around(self.skin.points, self.field.spacing)
        return grid.measure(self.skin.points, self.skin.triangles)

    def to_world(self, p: Points) -> Points:
        """Fitted coordinates to world coordinates."""
        return np.asarray(p * self.scale + self.offset)


def make_head(config: Config) -> Head | None:
    """The head of a config; None for "none". Raises InputError for a mesh that cannot serve."""
    if config.scene.head == "none":
        return None
    if config.scene.head == "builtin":
        head = _mannequin(config.simulate.contact.spacing, config.scene.skin)
    else:
        head = _from_mesh(config)
    if config.groom.source == "procedural":
        _darken_scalp(head)
    return head


def _mannequin(spacing: float, tone: str) -> Head:
    from pipeline.groom.head import distance, skin, surface

    points, triangles, normals = surface.contour()
    return Head(
        skin=Skin(points, triangles, normals, skin.albedo(points, normals, tone)),
        field=distance_grid(points, triangles, spacing),
        scale=1.0,
        offset=np.zeros(3),
        project=lambda p: distance.foot(p, steps=1, reach=surface.REACH),
    )


def _from_mesh(config: Config) -> Head:
    from pipeline.groom.head.skin import srgb_to_linear
    from pipeline.groom.head.table import load_table
    from pipeline.groom.head_mesh import load_mesh

    scene = config.scene
    points, triangles = load_mesh(Path(scene.head), scene.unit_scale, scene.up_axis)
    largest = float(np.ptp(points, axis=0).max())
    if not _SMALLEST < largest < _LARGEST:
        raise InputError(
            f"{scene.head}: {largest:.3g} m from end to end is not the size of a head; "
            "scene.unit_scale is metres per unit of the file (0.01 for centimetres)"
        )
    normals = point_normals(points, triangles).astype(np.float32)
    tone = srgb_to_linear(np.array(load_table()["skin"][scene.skin]))
    field = distance_grid(points, triangles, config.simulate.contact.spacing)
    scale, offset = fit_skull(points)
    fitted = field.rescaled(scale, offset)
    albedo = np.tile(tone, (len(points), 1)).astype(np.float32)
    return Head(Skin(points, triangles, normals, albedo), field, scale, offset, _grid_feet(fitted))


def _darken_scalp(head: Head) -> None:
    """Roots and stubble between the strands, which no strand stands for."""
    covered = head.density((head.skin.points - head.offset) / head.scale)
    head.skin.albedo[:] *= (1 - _STUBBLE * covered)[:, None]


def fit_skull(points: Points) -> tuple[float, NDArray[np.float64]]:
    """Scale and offset (3,) that lay the mannequin's skull onto a mesh's: same crown, breadth and occiput."""
    p = np.asarray(points, np.float64)
    crown = p[:, 1].max()
    scale = 1.0
    for _ in range(20):
        top = p[p[:, 1] > crown - _TOP * scale]
        scale = float(np.ptp(top[:, 0])) / _BREADTH
    middle = 0.5 * (top[:, 0].min() + top[:, 0].max())
    return scale, np.array([middle, crown - _CROWN * scale, top[:, 2].min() - _OCCIPUT * scale])


def _grid_feet(field: Field) -> Feet:
    def project(p: Points) -> tuple[Points, Points]:
        for _ in range(2):
            d, n = field.sample(p)
            p = p - d[:, None] * n
        return p, n

    return project
