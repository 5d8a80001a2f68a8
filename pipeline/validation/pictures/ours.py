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

_SMOOTH = 4  # drawn segments a segment, where a strand has few points: the reference draws smooth curves
_FEW = 32
_FIELD = 2e-3  # [m] between the nodes of a body's distance field


def render(reference: Reference, every: int = 1, grid: int = 128) -> tuple[_F32, NDArray[np.bool_]]:
    """Linear RGB (H, W, 3) over black, and which pixels hair covers all of, (H, W).

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
    silhouette = _Silhouette(config, strands, key, skins[0] if skins else None)
    covered = silhouette.linear(moment)[..., 0]
    silhouette.target.close()
    return picture, covered


class _Silhouette(FrameRenderer):
    """Hair in white, everything else in black."""

    def _shade(self, eye: NDArray[np.float64], first: int, points: _F32, which: NDArray[np.uint32]) -> _F32:
        return np.ones((len(which), 3), np.float32)

    def _draw_head(self, moment: Moment, eye: NDArray[np.float64]) -> None:
        if self.skin is None:
            self.target.background()
        else:
            self.target.triangles(self.skin.points, self.skin.triangles, np.zeros_like(self.skin.points))


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
