"""The light of the sky on hair that is seen, against exact rays between the strands."""

import numpy as np
import pytest
from numpy.typing import NDArray

from pipeline.config.schema import Fibre, Scene
from pipeline.render import fibre, pigment
from pipeline.render.lighting import Lighting

_F64 = NDArray[np.float64]

WIDTH = 2.5e-4
LONG, HIGH, THICK = 0.16, 0.1, 0.03
"""Sides of a mat of hair [m]; light and eye come across its third."""
SPIRAL = 32


def locks(count: int, per: int, seed: int) -> _F64:
    """Strands (S, 5, 3) of locks that hang along x and wave."""
    rng = np.random.default_rng(seed)
    u = np.linspace(0, 1, 5)
    middle = rng.uniform(-0.5, 0.5, (count, 1, 2)) * [HIGH, THICK]
    turn = 2 * np.pi * (rng.uniform(0.5, 1, (count, 1, 1)) * u[:, None] + rng.random((count, 1, 2)))
    across = np.repeat(middle + 4e-3 * np.sin(turn), per, axis=0) + 2e-3 * rng.normal(
        size=(count * per, 1, 2)
    )
    along = np.broadcast_to(LONG * (u - 0.5)[:, None], (count * per, 5, 1))
    return np.concatenate([along, across], axis=2)


def passed(points: _F64, x: _F64, own: NDArray[np.intp], direction: _F64) -> NDArray[np.intp]:
    """How many other strands rays (N,) from x (N, 3) meet: half a width from the line, ahead of the point."""
    u = np.cross(direction, [0, 0, 1] if abs(direction[2]) < 0.7 else [0, 1, 0])
    u /= np.linalg.norm(u)
    frame = np.stack([u, np.cross(direction, u), direction], axis=1)
    points, x = (
        each @ frame.astype(np.float32) for each in (points.astype(np.float32), x.astype(np.float32))
    )
    counts = np.zeros(len(x), np.intp)
    for j in range(points.shape[1] - 1):
        a, e = points[:, j], points[:, j + 1] - points[:, j]
        a = a - x[:, None]
        part = np.clip(-(a[..., :2] * e[:, :2]).sum(2) / (e[:, :2] ** 2).sum(1), 0, 1)
        off = ((a[..., :2] + part[..., None] * e[:, :2]) ** 2).sum(2)
        hit = (off < (WIDTH / 2) ** 2) & (a[..., 2] + part * e[:, 2] > 0)
        hit[np.arange(len(x)), own] = False
        counts += hit.sum(1)
    return counts


def spiral() -> _F64:
    """Directions (SPIRAL, 3), evenly spread."""
    i = np.arange(SPIRAL) + 0.5
    z, turn = 1 - 2 * i / SPIRAL, i * np.pi * (3 - np.sqrt(5))
    return np.stack([np.sqrt(1 - z**2) * np.cos(turn), np.sqrt(1 - z**2) * np.sin(turn), z], axis=1)


def sky_on(points: _F64, width: float, hair: Fibre, x: _F64, tangent: _F64, eye: _F64) -> _F64:
    """Radiance (N,) towards an eye of hair at x (N, 3) under a sky of 1, among strands of a width."""
    light = Lighting(Scene(lights=(), environment=(1, 1, 1)), hair, 64)
    sides = np.array([LONG, HIGH, THICK]) / 2 + 0.01
    light.begin(-sides, sides, width)
    light.add(points.astype(np.float32), np.full(points.shape[:2], width, np.float32))
    light.finish(None, np.eye(4))
    short = 1e-4 * tangent / np.linalg.norm(tangent, axis=1, keepdims=True)
    strands = np.stack([x - short, x, x + short], axis=1).astype(np.float32)
    variation = np.tile(np.array([[0.5, 1, 0]], np.float32), (len(x), 1))
    which = np.arange(1, 3 * len(x), 3, dtype=np.uint32)
    radiance = light.shade(strands, variation, np.zeros(len(x), np.uint32), eye, which)
    return np.asarray(radiance[:, 1], np.float64)


@pytest.mark.parametrize("toward", [(0.0, 0.2, 1.0), (0.3, -0.5, 0.8)])
def test_the_sky_on_hair_that_is_seen_is_that_of_exact_rays(toward: tuple[float, float, float]) -> None:
    points = locks(100, 20, 3)
    rng = np.random.default_rng(4)
    to_eye = np.array(toward) / np.linalg.norm(toward)
    own, t = rng.integers(0, len(points), 700), rng.random((700, 1))
    x = points[own, 1] * (1 - t) + points[own, 2] * t
    seen = passed(points, x, own, to_eye) == 0
    x, own, tangent = x[seen], own[seen], (points[own, 2] - points[own, 1])[seen]

    hair = Fibre(melanin=0.95, redness=0.2)
    lit, opaque, bare = (
        sky_on(points, width, hair, x, tangent, 10 * to_eye) for width in (WIDTH, 100 * WIDTH, 1e-6 * WIDTH)
    )
    # What hair itself sends back is there where no sky is
    returned = opaque.min()
    ours = (lit.mean() - returned) / (bare.mean() - returned)
    scattering = fibre.Scattering(hair.roughness, hair.azimuthal_roughness, hair.tilt)
    colours = pigment.table(hair)
    sigma = colours[:, colours.shape[1] // 2, :3].mean(axis=0, dtype=np.float64)
    loss = scattering.loss(sigma)[1]
    directions = spiral()
    weight = scattering.answer(directions @ to_eye, sigma)[:, 1]
    through = np.array([np.exp(-loss * passed(points, x, own, d)).mean() for d in directions])
    exact = (weight * through).sum() / weight.sum()
    print(f"{len(x)} seen, k {loss:.2f}: sky {ours:.3f}, exact {exact:.3f}")
    assert ours == pytest.approx(exact, rel=0.08)
