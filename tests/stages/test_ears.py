"""Hair and the ears of the built-in head: they are thin, and no strand goes through them however fast it comes."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from pipeline import kernels
from pipeline.bench.interpolate import swung
from pipeline.config.schema import Hair, Simulate
from pipeline.groom.heads import Head
from pipeline.simulate.rest import rest_shape, step_settings
from pipeline.strands.expand import Binding, Expansion
from pipeline.strands.strands import Strands

POINTS = 12


def thrown_at_the_ear(head: Head, dt: float, speed: float) -> tuple[float, NDArray[np.float64]]:
    """Short strands that fly forwards at the left ear; the least distance [m] of their ways, and where they end."""
    points = np.zeros((4, POINTS, 3))
    points[..., 0] = np.array([0.080, 0.083, 0.086, 0.089])[:, None]
    points[..., 1], points[..., 2] = np.linspace(-0.01, 0.02, POINTS), -0.062
    rest = rest_shape(Hair(), points, np.zeros((4, POINTS), np.uint8), np.full((4, POINTS), 1e-3))
    state = kernels.at_rest(points)
    state.velocity[..., 2] = speed
    settings = step_settings(Simulate(fps=1 / dt, substeps=1, gravity=(0, 0, 0), air={"shielding": 0.0}))
    field = kernels.DistanceField(head.field.values, head.field.origin, head.field.spacing)
    drive = kernels.Drive(np.tile(np.eye(4), (2, 1, 1)), np.zeros((1, 3)))
    u, lowest = np.linspace(0, 1, 201)[:, None, None, None], np.inf
    for _ in range(max(1, round(0.12 / speed / dt))):
        before = state.points.copy()
        kernels.advance(state, rest, field, drive, settings)
        way = before + u * (state.points - before)
        lowest = min(lowest, float(head.field.distance(way.reshape(-1, 3)).min()))
    return lowest, state.points.copy()


@pytest.mark.parametrize("dt", [1 / 24, 1 / 60, 1 / 240])
def test_no_strand_flies_through_an_ear(mannequin: Head, dt: float) -> None:
    for speed in (1.0, 3.0, 8.0):
        lowest, points = thrown_at_the_ear(mannequin, dt, speed)
        print(
            f"dt 1/{1 / dt:.0f}, {speed * dt * 1e3:.0f} mm a step: ways come as near as {lowest * 1e3:.2f} mm, "
            f"strands end at z {points[..., 2].mean(axis=1).round(3).tolist()}"
        )
        assert lowest > -0.2e-3  # the ear is up to 9 mm thick there: what goes through comes 4.4 mm deep
        assert points[..., 2].mean(axis=1).min() < -0.02  # at least the innermost is stopped behind it


@pytest.mark.parametrize("angle", [0.6, -0.6])
def test_no_strand_that_follows_guides_comes_into_ears_or_shoulders(
    mannequin: Head, wavy: Strands, angle: float
) -> None:
    """Guides swing sideways through ear and shoulder; the strands that follow them stay out and keep their lengths."""
    rest, guides = wavy.points, wavy.points[::25]
    count = len(rest)
    near = np.asarray(cKDTree(guides[:, 0]).query(rest[:, 0], 3)[1], np.uint32)
    binding = Binding(
        parent=np.arange(count, dtype=np.uint32),
        root=np.ascontiguousarray(rest[:, 0]),
        guide=near,
        weight=np.full(near.shape, 1 / 3, np.float32),
        key=np.zeros(count, np.uint32),
        scale=np.ones(count, np.float32),
        phase=np.zeros(count, np.float32),
    )
    field = kernels.DistanceField(mannequin.field.values, mannequin.field.origin, mannequin.field.spacing)
    depth = {}
    for name, head in (("free", None), ("kept out", field)):
        expansion = Expansion(rest, guides, binding, head)
        expansion.frame(swung(guides, angle), np.eye(4))
        points = expansion.chunk(0, count).astype(np.float64)
        phi = mannequin.field.distance(points[:, 1:].reshape(-1, 3))
        place = points[:, 1:].reshape(-1, 3)
        ear = (np.abs(place[:, 0]) > 0.07) & (np.abs(place[:, 1] + 0.01) < 0.04)
        regions = {"ears": ear, "shoulders": place[:, 1] < -0.14, "anywhere": np.ones(len(place), bool)}
        depth[name] = {region: -1e3 * float(phi[inside].min()) for region, inside in regions.items()}
        middles = 0.5 * (points[:, 2:] + points[:, 1:-1]).reshape(-1, 3)
        depth[name]["middles of segments"] = -1e3 * float(mannequin.field.distance(middles).min())
    lengths = [
        np.linalg.norm(np.diff(x, axis=1), axis=2).sum(axis=1) for x in (rest.astype(np.float64), points)
    ]
    stretched = np.abs(lengths[1] / lengths[0] - 1).max()
    print(
        "; ".join(
            f"{name}: " + ", ".join(f"{r} {d:.2f} mm" for r, d in of.items()) for name, of in depth.items()
        )
    )
    print(f"lengths are off by {stretched:.1e}")
    assert min(depth["free"].values()) > 3
    assert max(depth["kept out"].values()) < 0.1
    assert stretched < 1e-5
