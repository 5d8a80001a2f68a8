"""Parallel fibres so many that they touch: what they reflect, against exact rays between their circles."""

from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray
from own_colours import own_colours

from pipeline import kernels
from pipeline.render import fibre

_F32 = NDArray[np.float32]
_F64 = NDArray[np.float64]

RADIUS, WIDE, THICK, SPACING = 1e-4, 0.03, 0.003, 3e-4
LOW, HIGH = np.array([-0.02, -WIDE / 2, -THICK / 2]), np.array([0.02, WIDE / 2, THICK / 2])
EYE = np.array([0.0, 1.0])


@cache
def circles() -> _F64:
    """Middles (N, 2) of fibres along x: half of their layer's room is fibre."""
    count = int(0.5 * WIDE * THICK / (np.pi * RADIUS**2))
    return np.random.default_rng(3).uniform(LOW[1:], HIGH[1:], (count, 2))


def free(x: _F64, own: NDArray[np.intp], way: _F64) -> NDArray[np.bool_]:
    """Whether rays from x (N, 2) in one direction (2,) meet none of the other circles."""
    normal, clear = np.array([way[1], -way[0]]), []
    for rows in np.array_split(np.arange(len(x)), len(x) // 2000 + 1):
        aside = circles() @ normal - (x[rows] @ normal)[:, None]
        along = circles() @ way - (x[rows] @ way)[:, None]
        met = (np.abs(aside) < RADIUS) & (along > -np.sqrt(np.maximum(RADIUS**2 - aside**2, 0)))
        met[np.arange(len(rows)), own[rows]] = False
        clear.append(~met.any(axis=1))
    return np.concatenate(clear)


@cache
def sides() -> tuple[NDArray[np.intp], _F64, _F64]:
    """Points that the eye sees, as often as it sees them: circles, offsets h across them, places (N, 2)."""
    rng = np.random.default_rng(4)
    well = np.flatnonzero(np.abs(circles()[:, 0]) < 0.4 * WIDE)
    own, h = rng.choice(well, 120000), rng.uniform(-1, 1, 120000)
    x = circles()[own] + RADIUS * np.stack([h, np.sqrt(1 - h**2)], axis=1)
    seen = free(x, own, EYE)
    return own[seen], h[seen], x[seen]


def once(lobe: _F64, p: int, sigma: float) -> kernels.FibreTables:
    """Fibres whose lobe p is this (A, T, H), and which scatter nothing else."""
    record = np.zeros((*lobe.shape, 8), np.float32)
    record[..., p] = lobe
    pigment, _ = own_colours(np.full((2, 3), sigma, np.float32))
    sums, flat = np.zeros((*lobe.shape[:2], 8), np.float32), np.zeros(4, np.float32)
    return kernels.FibreTables(
        record, sums, pigment, np.full(4, fibre.variance(0.3), np.float32), flat, fibre.ABSORPTION_MAX
    )


def ours(to_light: _F64, tables: kernels.FibreTables) -> float:
    """Mean radiance of what is seen."""
    own, _, _ = sides()
    middles = np.concatenate([np.zeros((len(circles()), 1)), circles()], axis=1)
    ends = np.array([[-0.018, 0, 0], [0, 0, 0], [0.018, 0, 0]])
    strands = (middles[:, None] + ends).astype(np.float32)
    L = np.array([[0.0, *to_light]], np.float32)
    shadows = kernels.Shadows(L)
    shadows.begin(LOW, HIGH, SPACING, 2 * RADIUS)
    shadows.add(strands, np.full(strands.shape[:2], 2 * RADIUS, np.float32))
    shadows.finish(np.zeros((4, 4, 4), np.float32), LOW, 0.02, None, np.eye(4))
    around = np.zeros((2, 2, 2, 16), np.float32)
    around[..., :8] = 1
    everywhere, none = np.ones((2, 2, 2, 4), np.float32), np.zeros(3, np.float32)
    light = kernels.Illumination(L, np.ones((1, 3), np.float32), none, shadows, around, everywhere)
    light.glints = False
    seen = strands[own]
    variation, key = (
        np.tile(np.array([0, 1, 0], np.float32), (len(seen), 1)),
        np.zeros(len(seen), np.uint32),
    )
    middle = np.arange(1, 3 * len(seen), 3, dtype=np.uint32)
    eye = 1e4 * np.array([0.0, *EYE])
    return float(kernels.shade(seen, variation, key, eye, light, tables, middle)[:, 0].mean(dtype=np.float64))


@pytest.mark.parametrize(
    ("p", "level", "degrees"), [(0, -1, 5), (0, -1, 20), (0, -1, 45), (0, -1, 70), (2, 6, 5), (2, 6, 45)]
)
def test_packed_fibres_show_the_sides_that_stand_out(p: int, level: int, degrees: float) -> None:
    """By how much R and TRT exceed what fibres that take no room scatter in the same light."""
    phi, s = np.radians(degrees), fibre.scale(0.3)
    to_light = np.array([np.sin(phi), np.cos(phi)])
    scattering = fibre.Scattering(0.3, 0.3, 0.0)
    lobes, sigma = scattering.far_field[0], scattering.levels[level]
    own, h, x = sides()
    lit = free(x, own, to_light)
    # The light stands on the side of positive h, which the lobe's azimuths leave to negative ones
    leaving = fibre.attenuation(np.ones(1), h, np.array([sigma]))[p]
    near = leaving * fibre.logistic(phi - fibre.deflection(p, np.ones(1), -h), s)
    far = np.interp(phi, np.linspace(0, np.pi, fibre.AZIMUTHS), lobes[p, level, 0])
    rays = (near * lit).mean() / (far * lit.mean())
    alike = np.ones_like(lobes[p])
    found = ours(to_light, once(lobes[p], p, sigma)) / (far * ours(to_light, once(alike, 3, sigma)))
    print(f"lobe {p}, {degrees} degrees: {found:.3f} of what thin fibres scatter, rays {rays:.3f}")
    assert found == pytest.approx(rays, rel=0.07)
