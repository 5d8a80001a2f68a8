"""Our picture of a path-traced scene, by the renderer that draws frames."""

import numpy as np
from numpy.typing import NDArray

from pipeline.body.distance import Grid
from pipeline.body.normals import point_normals
from pipeline.config.schema import Config, Groom, Render, Scene
from pipeline.render.frame import FrameRenderer, Moment, Skin
from pipeline.strands.expand import Binding, Expansion
from pipeline.validation.pictures.reference import Body, Reference

_F32 = NDArray[np.float32]
_F64 = NDArray[np.float64]

_SMOOTH = 4  # drawn segments a segment, where a strand has few points: the reference draws smooth curves
_FEW = 32
_FIELD = 2e-3  # [m] between the nodes of a body's distance field


def render(reference: Reference, every: int = 1, grid: int = 128) -> tuple[_F32, _F32]:
    """Linear RGB (H, W, 3) over black, and what part of each pixel hair covers, (H, W).

    With `every` 2 the picture is half as wide and high.
    """
    height, width = (side // every for side in reference.smooth.shape[:2])
    pieces = _SMOOTH if reference.strands.shape[1] < _FEW else 1
    config = Config(
        name=reference.name,
        scene=Scene(
            head="none",
            camera=reference.camera,
            lights=reference.lights,
            environment=reference.environment,
            background=(0, 0, 0),
        ),
        groom=Groom(source="swatch"),
        render=Render(
            size=(width, height),
            samples=2,
            geometry="coverage",
            width=reference.width,
            taper=0,
            subdivide=pieces,
            grid=grid,
            exposure=1,
            hair=reference.fibre,
        ),
    )
    count = len(reference.strands)
    strands, key = _as_they_are(reference.strands), np.arange(count, dtype=np.uint32)
    moment = Moment(reference.strands, np.eye(4))
    skins = [_skin(body) for body in reference.bodies]
    renderer = FrameRenderer(config, strands, key, skins[0] if skins else None)
    picture = renderer.linear(moment)
    renderer.target.close()
    silhouette = _Silhouette(_white(config), strands, key, skins)
    covered = silhouette.linear(moment)[..., 0]
    silhouette.target.close()
    return picture, covered


def _white(config: Config) -> Config:
    """White hair under a white sky: it shows as much white as it covers."""
    scene = config.scene.model_copy(update={"lights": (), "environment": (1.0, 1.0, 1.0)})
    fibre = config.render.hair.model_copy(update={"melanin": 0.0})
    render = config.render.model_copy(update={"hair": fibre})
    return config.model_copy(update={"scene": scene, "render": render})


class _Silhouette(FrameRenderer):
    """Hair under its own light, bodies in black that take no part in it."""

    def __init__(
        self, config: Config, strands: Expansion, key: NDArray[np.uint32], bodies: list[Skin]
    ) -> None:
        super().__init__(config, strands, key)
        self._bodies = bodies

    def _draw_head(self, moment: Moment, eye: _F64) -> None:
        del moment, eye  # black bodies that do not move
        self.target.background()
        for body in self._bodies:
            self.target.triangles(body.points, body.triangles, np.zeros_like(body.points))

    def _corners(self, moment: Moment, lower: _F64, upper: _F64) -> _F64:
        corners = super()._corners(moment, lower, upper)
        return np.concatenate([corners, *(body.points.astype(np.float64) for body in self._bodies)])


def _as_they_are(points: _F32) -> Expansion:
    """Strands that are their own guides."""
    own = np.arange(len(points), dtype=np.uint32)
    binding = Binding(
        parent=own,
        root=np.ascontiguousarray(points[:, 0]),
        guide=own[:, None].copy(),
        weight=np.ones((len(points), 1), np.float32),
        key=own,
        scale=np.ones(len(points), np.float32),
        phase=np.zeros(len(points), np.float32),
    )
    return Expansion(points, points, binding)


def _skin(body: Body) -> Skin:
    grid = Grid.around(body.points, _FIELD)
    return Skin(
        points=body.points,
        triangles=body.triangles,
        normals=point_normals(body.points, body.triangles).astype(np.float32),
        albedo=np.full(body.points.shape, body.albedo, np.float32),
        field=grid.field(grid.measure(body.points, body.triangles)),
    )
