"""The light of the sky on hair that is seen, against exact rays between the strands.

A ray that meets n strands keeps (1 - k)^n of its light: k, the rate at which light fades with the mean count of a
Poisson medium, is what one strand takes away. What a strand answers to light from a direction is a single fibre's, of
its own tangent.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates
from shipped_configs import shipped

from pipeline import cache, kernels
from pipeline.cache.expansion import distance_field, placement
from pipeline.config.schema import Fibre, Scene
from pipeline.groom import stage
from pipeline.render import fibre, pigment
from pipeline.render.camera import CameraPath
from pipeline.render.geometry import drawn_width
from pipeline.render.lighting import Lighting
from pipeline.render.sky import Sky

_F64 = NDArray[np.float64]

BLACK, BROWN = Fibre(melanin=0.95, redness=0.2), Fibre(melanin=0.7, redness=0.7)
WIDTH = 2.5e-4
LONG, HIGH, THICK = 0.16, 0.1, 0.03
"""Sides of a mat of hair [m]; light and eye come across its third."""


@dataclass(frozen=True)
class Hair:
    strands: _F64
    """(S, P, 3) [m]"""
    width: float
    head: kernels.DistanceField | None
    grid: int


@dataclass(frozen=True)
class Seen:
    """Points of strands that an eye sees."""

    x: _F64
    own: NDArray[np.intp]
    """(N,) the strand of each."""
    tangent: _F64
    to_eye: _F64


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


def passed(hair: Hair, x: _F64, own: NDArray[np.intp], direction: _F64) -> NDArray[np.intp]:
    """How many other strands rays (N,) from x (N, 3) meet: half a width from the line, ahead of the point."""
    u = np.cross(direction, [0, 0, 1] if abs(direction[2]) < 0.7 else [0, 1, 0])
    u /= np.linalg.norm(u)
    frame = np.stack([u, np.cross(direction, u), direction], axis=1).astype(np.float32)
    points, x = (each.astype(np.float32) @ frame for each in (hair.strands, x))
    low, high = points.min(axis=1) - hair.width / 2, points.max(axis=1) + hair.width / 2
    near = x[:, None, 2] < high[:, 2]
    for axis in range(2):
        near &= (x[:, None, axis] > low[:, axis]) & (x[:, None, axis] < high[:, axis])
    near[np.arange(len(x)), own] = False
    ray, strand = np.nonzero(near)
    a, e = points[strand, :-1] - x[ray, None], np.diff(points, axis=1)[strand]
    part = np.clip(-(a * e)[..., :2].sum(2) / np.maximum((e[..., :2] ** 2).sum(2), 1e-20), 0, 1)[..., None]
    off, ahead = ((a + part * e)[..., :2] ** 2).sum(2), (a + part * e)[..., 2] > 0
    met = ((off < (hair.width / 2) ** 2) & ahead).any(axis=1)
    return np.bincount(ray[met], minlength=len(x))


def dark(hair: Hair, x: _F64, direction: _F64) -> NDArray[np.bool_]:
    """Whether rays (N,) from x (N, 3) meet the head."""
    if hair.head is None:
        return np.zeros(len(x), bool)
    steps = np.arange(1, 80)[:, None, None] * 3e-3 * direction
    far, _ = kernels.distance(hair.head, (x + steps).reshape(-1, 3))
    return np.asarray((far < -5e-4).reshape(len(steps), -1).any(axis=0))


def seen(hair: Hair, eye: _F64, tried: int) -> Seen:
    """Those of some points that an eye sees, chosen by the length that they show it."""
    rng = np.random.default_rng(4)
    ends = hair.strands[:, 1:] - hair.strands[:, :-1]
    to_eye = eye - (hair.strands[:, 1:] + hair.strands[:, :-1]) / 2
    to_eye /= np.linalg.norm(to_eye, axis=2, keepdims=True)
    shown = np.linalg.norm(np.cross(ends, to_eye), axis=2).ravel()
    chosen = rng.choice(shown.size, tried, p=shown / shown.sum())
    own, j = np.divmod(chosen, ends.shape[1])
    x = hair.strands[own, j] + rng.random((tried, 1)) * ends[own, j]
    middle = x.mean(axis=0)
    toward = (eye - middle) / np.linalg.norm(eye - middle)
    # Rays to the eye are all but parallel: those to each of a few neighbours are counted along one
    clear = np.zeros(tried, bool)
    for part in np.array_split(np.argsort(x @ np.cross(toward, [0, 1, 0])), max(1, tried // 80)):
        way = (eye - x[part]).mean(axis=0)
        way /= np.linalg.norm(way)
        clear[part] = (passed(hair, x[part], own[part], way) == 0) & ~dark(hair, x[part], way)
    tangent, to = ends[own, j], eye - x
    tangent, to = (each / np.linalg.norm(each, axis=1, keepdims=True) for each in (tangent, to))
    return Seen(x[clear], own[clear], tangent[clear], to[clear])


def spiral(count: int) -> _F64:
    """Directions (count, 3), evenly spread."""
    i = np.arange(count) + 0.5
    z, turn = 1 - 2 * i / count, i * np.pi * (3 - np.sqrt(5))
    return np.stack([np.sqrt(1 - z**2) * np.cos(turn), np.sqrt(1 - z**2) * np.sin(turn), z], axis=1)


def answers(colour: Fibre, sigma: float, points: Seen, directions: _F64) -> _F64:
    """What the fibre at each point (N,) answers to light from directions (D, 3): (N, D), of sum 1 over all."""
    hair = fibre.Scattering(colour.roughness, colour.azimuthal_roughness, 0.0)
    level = np.sqrt(sigma / fibre.ABSORPTION_MAX) * (fibre.LEVELS - 1)
    sine, arriving = (points.tangent * points.to_eye).sum(1)[:, None], points.tangent @ directions.T
    out, across = np.sqrt(1 - sine**2), np.sqrt(1 - arriving**2)
    phi = np.arccos(np.clip((points.to_eye @ directions.T - sine * arriving) / (out * across), -1, 1))
    theta = np.arccos(out) * (fibre.INCLINATIONS - 1) * 2 / np.pi + 0 * phi
    places = np.stack([level + 0 * phi, theta, phi * (fibre.AZIMUTHS - 1) / np.pi])
    light = sum(
        fibre._along(across * out, arriving * sine, v) * map_coordinates(lobe, places, order=1)
        for lobe, v in zip(hair.far_field[0], fibre.variances(colour.roughness), strict=True)
    )
    return np.asarray(light / light.sum(axis=1, keepdims=True))


def exact(hair: Hair, colour: Fibre, points: Seen, directions: int) -> _F64:
    """Part of the sky's light that points (N,) answer: green."""
    scattering = fibre.Scattering(colour.roughness, colour.azimuthal_roughness, 0.0)
    colours = pigment.table(colour)
    sigma = colours[:, colours.shape[1] // 2, :3].mean(axis=0, dtype=np.float64)
    keeps = 1 - float(scattering.loss(sigma)[1])
    finer = spiral(16 * directions)
    ways = spiral(directions)
    cell = (finer @ ways.T).argmax(axis=1)
    weight = answers(colour, sigma[1], points, finer) @ (cell[:, None] == np.arange(directions))
    through = np.stack(
        [keeps ** passed(hair, points.x, points.own, d) * ~dark(hair, points.x, d) for d in ways], axis=1
    )
    return (weight * through).sum(axis=1)


def ours(hair: Hair, colour: Fibre, points: Seen, eye: _F64) -> _F64:
    """The same by the renderer: what is seen under a sky of 1, by what is seen of hair where all or nothing comes through."""
    lit, opaque, bare = (sky_on(hair, width, colour, points, eye) for width in (1, 100, 1e-6))
    # What hair itself sends back is there where no sky is
    returned = (opaque / bare).min()
    return (lit / bare - returned) / (1 - returned)


def sky_on(hair: Hair, wider: float, colour: Fibre, points: Seen, eye: _F64) -> _F64:
    """Radiance (N,) of points towards the eye under a sky of 1; without hair there is no head either."""
    light = Lighting(Scene(lights=(), environment=(1, 1, 1)), colour, hair.grid)
    width = wider * hair.width
    light.begin(hair.strands.min((0, 1)) - 0.01, hair.strands.max((0, 1)) + 0.01, width)
    light.add(hair.strands.astype(np.float32), np.full(hair.strands.shape[:2], width, np.float32))
    light.finish(hair.head if wider >= 1 else None, np.eye(4))
    short = 1e-4 * points.tangent
    strands = np.stack([points.x - short, points.x, points.x + short], axis=1).astype(np.float32)
    variation = np.tile(np.array([[0.5, 1, 0]], np.float32), (len(strands), 1))
    which = np.arange(1, 3 * len(strands), 3, dtype=np.uint32)
    radiance = light.shade(strands, variation, np.zeros(len(strands), np.uint32), eye, which)
    return np.asarray(radiance[:, 1], np.float64)


@pytest.mark.parametrize("distance", [0.1, 0.8, 100.0])
def test_under_an_even_sky_all_fibres_answer_alike(distance: float) -> None:
    """No light is made: from anywhere, answers have the mean 1, and what mirrors more here does less there."""
    sky = Sky(fibre.Scattering(0.3, 0.3, 0.0), np.array([0.2, 0.5, 1.5]))
    for toward in spiral(7):
        answers = sky.answers(distance * toward, 0.4)
        mean, turned, moments = (
            answers[:, part].mean(axis=0) for part in (slice(3), slice(3, 12), slice(12, 17))
        )
        most = np.abs(answers[:, 3:12]).max(), np.abs(answers[:, 12:]).max()
        assert np.abs(mean - 1).max() < 1e-5
        assert np.abs(turned).max() < 1e-5 * most[0]
        assert np.abs(moments).max() < 1e-5 * most[1]
    print(f"at {distance} m answers turn by {most[0]:.2f} a metre, fibres mirror up to {most[1]:.2f} more")


def test_white_hair_in_a_white_room_is_white_whichever_way_it_lies() -> None:
    mat = Hair(locks(40, 10, 3), WIDTH, None, 64)
    rng = np.random.default_rng(1)
    eye = np.array([0.0, 0.3, 0.7])
    x = rng.uniform(-0.5, 0.5, (200, 3)) * [LONG, HIGH, THICK]
    tangent = rng.normal(size=(200, 3))
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    points = Seen(
        x, np.zeros(200, np.intp), tangent, (eye - x) / np.linalg.norm(eye - x, axis=1, keepdims=True)
    )
    radiance = sky_on(mat, 1, Fibre(melanin=0.0), points, eye)
    print(f"{radiance.min():.3f} to {radiance.max():.3f}")
    assert radiance.min() > 0.97
    assert radiance.max() < 1.001


@pytest.mark.parametrize("toward", [(0.0, 0.2, 1.0), (0.3, -0.5, 0.8)])
def test_the_sky_on_hair_that_is_seen_is_that_of_exact_rays(toward: tuple[float, float, float]) -> None:
    mat = Hair(locks(100, 20, 3), WIDTH, None, 128)
    eye = 10 * np.array(toward) / np.linalg.norm(toward)
    points = seen(mat, eye, 700)
    true = exact(mat, BLACK, points, 32)
    found = ours(mat, BLACK, points, eye)
    print(f"{len(points.x)} seen: sky {found.mean():.3f}, exact {true.mean():.3f}")
    assert found.mean() == pytest.approx(true.mean(), rel=0.08)


@pytest.mark.parametrize(("name", "colour"), [("bob", BLACK), ("bob", BROWN), ("curly", BROWN)])
def test_the_sky_on_a_head_of_hair_is_that_of_exact_rays(name: str, colour: Fibre, tmp_path: Path) -> None:
    """Sleek hair as well as locks, with the head, from where its camera stands. Black hair answers light from the eye's side
    most, brown hair that from behind.
    """
    made, experiment = shipped(name, strands=1200), cache.Experiment(tmp_path)
    stage.execute(made, experiment, "groom")
    with cache.open(experiment.groom, "groom") as groom:
        field, head = distance_field(groom), placement(groom)
        strands = np.asarray(groom["strands/points"][:], np.float64)
    eye = np.asarray(CameraPath.of(made.scene.camera, head).at(0.0).position, np.float64)
    hair = Hair(strands, drawn_width(made.render, len(strands)), field, 128)
    points = seen(hair, eye, 1200)
    true = exact(hair, colour, points, 26)
    found = ours(hair, colour, points, eye)
    alike = np.corrcoef(found, true)[0, 1]
    print(
        f"{name}: {len(points.x)} seen: sky {found.mean():.3f}, exact {true.mean():.3f}, correlation {alike:.2f}"
    )
    assert found.mean() == pytest.approx(true.mean(), rel=0.08)
