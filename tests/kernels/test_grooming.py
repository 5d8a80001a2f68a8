"""Grooming kernels against their numpy twins; equal spacing, random numbers, shapes of parts."""

import groom_twins
import numpy as np
import pytest
import resample_twin
from numpy.typing import NDArray
from parts_twin import fold_parts as folded_twin

from pipeline import kernels
from pipeline.groom.head.distance import fold_parts
from pipeline.groom.head.table import load_table
from pipeline.strands import random
from pipeline.strands.resample import resampled

Vectors = NDArray[np.float64]
S, P = 37, 24  # no whole number of blocks


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(5)


@pytest.fixture
def strands(rng: np.random.Generator) -> Vectors:
    """Wavy strands (S, P, 3) of 8 to 20 cm."""
    s = np.linspace(0, 1, P) * rng.uniform(0.08, 0.2, (S, 1))
    wave = 0.004 * np.sin(120 * s + rng.uniform(0, 6, (S, 1)))
    return np.stack([wave, -s, 0.3 * s + 0.5 * wave], axis=2) + 5e-4 * rng.normal(size=(S, P, 3))


@pytest.fixture
def length(strands: Vectors) -> Vectors:
    return np.linalg.norm(np.diff(strands, axis=1), axis=2).sum(axis=1)


def off(name: str, found: Vectors, expected: Vectors) -> float:
    worst = float(np.abs(found - expected).max())
    print(f"{name}: worst difference from the twin {worst:.1e} m")
    return worst


@pytest.mark.parametrize("count", [2, 9, 64])
def test_equal_spacing_is_that_of_its_twin(strands: Vectors, count: int) -> None:
    """Both stop at segments that agree to 6e-7 of their length, 2e-8 m."""
    found = resampled(strands, count)
    worst = off(f"{count} points", found, resample_twin.resampled(strands, count))
    segments = np.linalg.norm(np.diff(found, axis=1), axis=2)
    unequal = np.abs(segments / segments.mean(axis=1, keepdims=True) - 1).max()
    print(f"worst deviation of a segment {unequal:.1e}")
    assert worst < 1e-7
    assert unequal < 1e-6


def test_equal_spacing_of_kinked_strands_is_equal(rng: np.random.Generator) -> None:
    """A zigzag of right angles: no point is far from it, whatever is asked of the curve there."""
    zigzag = np.zeros((11, 16, 3))
    zigzag[:, :, 0] = 0.01 * np.arange(16)
    zigzag[:, ::2, 1] = 0.01 * rng.uniform(0.5, 1.5, (11, 8))
    found = resampled(zigzag, 48)
    segments = np.linalg.norm(np.diff(found, axis=1), axis=2)
    unequal = np.abs(segments / segments.mean(axis=1, keepdims=True) - 1).max()
    print(f"worst deviation of a segment {unequal:.1e}")
    assert unequal < 1e-6


def test_a_strand_is_resampled_as_if_it_were_alone(strands: Vectors) -> None:
    together = resampled(strands, 40)
    assert all(np.array_equal(together[i], resampled(strands[i : i + 1], 40)[0]) for i in range(S))


def test_random_numbers_are_the_finaliser_and_box_muller() -> None:
    index = np.arange(100_003, dtype=np.uint32)
    with np.errstate(over="ignore"):
        h = index * np.uint32(0x9E3779B1) + np.uint32((3 * 0x85EBCA6B + 17 * 0xC2B2AE35) & 0xFFFFFFFF)
        for shift, factor in ((16, 0x7FEB352D), (15, 0x846CA68B)):
            h = (h ^ (h >> np.uint32(shift))) * np.uint32(factor)
        h ^= h >> np.uint32(16)
    assert np.array_equal(random.hashed(3, index, 17), h)
    radius = np.sqrt(-2 * np.log1p(-random.uniform(3, index, 17)))
    expected = radius * np.cos(2 * np.pi * random.uniform(3, index, 17 ^ 0x5BD1))
    worst = np.abs(random.normal(3, index, 17) - expected).max()
    print(f"normal numbers against numpy's logarithm and cosine: {worst:.1e}")
    assert worst < 1e-14


@pytest.mark.parametrize("reach", [np.inf, 8e-3])
def test_the_head_is_that_of_its_twin(rng: np.random.Generator, reach: float) -> None:
    p = rng.uniform([0, -0.25, -0.12], [0.14, 0.14, 0.13], (6001, 3))
    parts = load_table()["parts"]
    worst = off("head", fold_parts(p, parts, reach), folded_twin(p, parts, reach))
    assert worst < 1e-12


def test_helices_are_those_of_their_twin(rng: np.random.Generator, strands: Vectors, length: Vectors) -> None:
    coil = rng.uniform([0.002, 0.02, 0, -1, 0, 0.02], [0.01, 0.06, 1, 1, 0.05, 0.08], (S, 6))
    given = strands, rng.normal(size=(S, 3)), length, coil
    assert off("coiled", kernels.coiled(*given), groom_twins.coiled(*given)) < 1e-13


def test_sines_are_those_of_their_twin(rng: np.random.Generator, strands: Vectors, length: Vectors) -> None:
    sines = rng.uniform([0.01, 0, -1e-3, -1e-3, -1e-3], [0.08, 1, 1e-3, 1e-3, 1e-3], (S, 3, 5))
    given = strands, length, sines, rng.uniform(0.02, 0.06, S)
    assert off("shaken", kernels.shaken(*given), groom_twins.shaken(*given)) < 1e-13


def test_turns_are_those_of_their_twin(rng: np.random.Generator, strands: Vectors, length: Vectors) -> None:
    axis = rng.normal(size=(S, 3))
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    turn = np.concatenate([axis, rng.uniform([0, 0.01, -3], [0.1, 0.1, 3], (S, 3))], axis=1)
    given = strands, length, turn
    assert off("turned", kernels.turned(*given), groom_twins.turned(*given)) < 1e-13


def test_locks_are_those_of_their_twin(rng: np.random.Generator, strands: Vectors, length: Vectors) -> None:
    """Middles of other counts of points, some of them too short."""
    middles = groom_twins.shortened(strands, rng.uniform(0.05, 0.15, S), 19)[:5]
    lengths = np.linalg.norm(np.diff(middles, axis=1), axis=2).sum(axis=1)
    lock = rng.integers(0, 5, S)
    pull = rng.uniform([0, 0.03, 0, -0.02], [1, 0.2, 0.04, 0.02], (S, 4))
    given = strands, length, middles, lengths, lock, pull
    assert off("drawn in", kernels.drawn_in(*given), groom_twins.drawn_in(*given)) < 1e-13
    with pytest.raises(ValueError, match="no such lock"):
        kernels.drawn_in(*given[:4], lock + 1, *given[5:])


def test_shortened_strands_are_those_of_their_twin(rng: np.random.Generator, strands: Vectors) -> None:
    given = strands, rng.uniform(0.01, 0.19, S), 33
    assert off("shortened", kernels.shortened(*given), groom_twins.shortened(*given)) < 1e-13


@pytest.mark.parametrize(
    ("shape", "is_round", "hang"),
    [
        ((0.1, -1.0, 0.05, -0.09), False, -np.inf),
        ((0.0, -1.0, 0.0, -0.12), False, -0.05),
        ((0, -0.02, 0, 0.08), True, -np.inf),
    ],
)
def test_strands_are_cut_where_their_twins_are(
    rng: np.random.Generator, strands: Vectors, shape: tuple[float, ...], is_round: bool, hang: float
) -> None:
    given = strands, rng.uniform(-0.02, 0.02, S), np.array(shape), is_round, hang
    found, expected = kernels.first_outside(*given), groom_twins.first_outside(*given)
    whole = np.linalg.norm(np.diff(strands, axis=1), axis=2).sum(axis=1)
    print(f"{(expected < whole - 1e-9).sum()} of {S} are cut")
    assert (expected < whole - 1e-9).any()
    assert off("cut", found, expected) < 1e-12


def test_strands_grow_as_their_twins_do(rng: np.random.Generator) -> None:
    """Over a ball of 9 cm, combed along circles; what differs are sums of another order, which growth enlarges."""
    n, h = 61, 6e-3
    axis = h * (np.arange(n) - n // 2)
    x, y, z = np.meshgrid(axis, axis, axis, indexing="ij")
    values = (np.sqrt(x**2 + y**2 + z**2) - 0.09).astype(np.float32)
    wall = kernels.DistanceField(values, np.full(3, axis[0]), h)
    grid = rng.normal(size=(33, 33, 4)).astype(np.float32)
    center, axes = np.array([0, 0.01, 0]), np.array([[-1.0, 0, 0], [0, 0, 1.0], [0, 1.0, 0]])

    def chart(p: Vectors) -> Vectors:
        q = (p - center) @ axes.T
        q /= np.linalg.norm(q, axis=1, keepdims=True)
        return q[:, :2] / np.sqrt(2 * (1 + q[:, 2:]))

    normals = rng.normal([0, 2, 0], 1, (S, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    roots, first = 0.09 * normals, groom_twins.unit(normals + 0.5 * rng.normal(size=(S, 3)))
    low = [0.002, 0.05, 0.02, 0.04, -0.3, -0.3, -0.3, -0.05, -0.05, 0.5]
    high = [0.02, 0.1, 0.03, 0.08, 0.3, 0.3, 0.3, 0.05, 0.05, 0.5]
    growth, wander = rng.uniform(low, high, (S, 10)), 0.05 * rng.normal(size=(S, 5, 3))
    terrain = kernels.Terrain(wall, center, axes, grid, groom_twins.STEP)
    found = terrain.grown(roots, first, growth, wander, 41)
    expected = groom_twins.grown(wall, chart, grid, roots, first, growth, wander, 40)
    steps = np.linalg.norm(np.diff(found, axis=1), axis=2)
    print(f"steps differ from 4 mm by {np.abs(steps - groom_twins.STEP).max():.1e} m")
    assert off("grown", found, expected) < 1e-5
    assert np.abs(steps - groom_twins.STEP).max() < 1e-7


def test_strands_that_are_pushed_out_keep_their_clearance(strands: Vectors) -> None:
    """A plane of skin at y = -4 cm, outwards up: what lies below is lifted onto the clearance, the rest stays."""
    y = -0.3 + 0.01 * np.arange(41)
    values = np.broadcast_to((y + 0.04).astype(np.float32)[None, :, None], (31, 41, 31)).copy()
    field = kernels.DistanceField(values, np.array([-0.15, -0.3, -0.15]), 0.01)
    clearance = np.full(P, 1e-3)
    clearance[:2] = -np.inf
    moved, depth = kernels.outside(field, strands, clearance, 1)
    deep = np.maximum(1e-3 - (strands[:, 2:, 1] + 0.04), 0)
    expected = strands.copy()
    expected[:, 2:, 1] += deep
    print(f"pushed out by up to {1000 * deep.max():.1f} mm")
    assert deep.max() > 0.01
    assert np.abs(moved - expected).max() < 1e-7
    assert np.abs(depth - deep.max(axis=1)).max() < 1e-7
