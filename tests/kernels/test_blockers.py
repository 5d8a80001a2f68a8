"""Light past single strands: against exact rays, of a strand's own curls, determinism."""

import numpy as np
import pytest
from numpy.typing import NDArray
from test_shadows import HIGH, LIGHTS, LOW, SPACING, WIDTH, passed, straight

from pipeline import kernels

_F32 = NDArray[np.float32]
PLACES = 16


def shadows(points: _F32, chunk: int = 10**9) -> kernels.Shadows:
    maps = kernels.Shadows(LIGHTS)
    maps.begin(LOW, HIGH, SPACING, WIDTH, told=1.0)
    for first in range(0, len(points), chunk):
        some = points[first : first + chunk]
        maps.add(some, np.full(some.shape[:2], WIDTH, np.float32))
    maps.finish(np.zeros((4, 4, 4), np.float32), LOW, 0.02, None, np.eye(4))
    return maps


def stretches(points: _F32, count: int, half: float) -> tuple[NDArray[np.intp], _F32, _F32, _F32]:
    """Strands (N,), places (N,) along them, points (N, 3) there and ways (N, 2, 3) to both sides, `half` [m] long."""
    rng = np.random.default_rng(2)
    own, t = rng.integers(0, len(points), count), rng.uniform(0.1, 0.4, count).astype(np.float32)
    first, second = points[own, 0], points[own, 1]
    axis = first + 2 * t[:, None] * (second - first)
    along = (second - first) / np.linalg.norm(second - first, axis=1, keepdims=True)
    ways = np.stack([-half * along, half * along], axis=1)
    return own, t, axis.astype(np.float32), ways.astype(np.float32)


@pytest.mark.parametrize("light", range(3))
def test_light_goes_past_single_strands_as_exact_rays_do(light: int) -> None:
    """At the 16 places of each way, of rays from the strand's axis."""
    points, _ = straight(1500, 1)
    own, t, axis, ways = stretches(points, 400, 1e-3)
    lit = shadows(points).lit(light, axis, ways, points[own, 0].copy(), t)
    parts = (np.arange(PLACES) + 0.5) / PLACES
    places = (axis[:, None, None] + parts[:, None] * ways[:, :, None]).reshape(-1, 3).astype(float)
    free = passed(points, places, np.repeat(own, 2 * PLACES), LIGHTS[light].astype(float)) == 0
    exact = free.reshape(len(axis), -1).mean(axis=1)
    off = np.abs(lit - exact)
    print(
        f"light {light}: lit {lit.mean():.4f}, exact {exact.mean():.4f}; off by {off.mean():.4f}, {off.max():.3f} at most"
    )
    assert 0.1 < exact.mean() < 0.9
    assert lit.mean() == pytest.approx(exact.mean(), abs=0.004)
    assert off.mean() < 0.01


def test_a_curl_shades_its_own_next_turns() -> None:
    """Of a coil that light runs along only the turns before which no other lies are lit; a straight strand is."""
    turn = np.linspace(0, 6 * np.pi, 241)
    coil = np.stack([0.005 * np.cos(turn), 0.002 * turn / (2 * np.pi) - 0.003, 0.005 * np.sin(turn)], -1)
    rod = np.stack([0.02 + 0 * turn, 0 * turn, 0.0016 * turn - 0.015], -1)
    points = np.stack([coil, rod]).astype(np.float32)
    maps = shadows(points)
    j = np.arange(2, 239)
    lit = []
    for strand in points:
        ways = np.stack([strand[j - 1] - strand[j], strand[j + 1] - strand[j]], axis=1) / 2
        roots = np.repeat(strand[:1], len(j), axis=0)
        lit.append(maps.lit(1, strand[j].copy(), ways, roots, (j / 240).astype(np.float32)))
    before = turn[j] > 4 * np.pi  # light comes along y, and meets the last turn first
    print(f"lit: the turn in front {lit[0][before].mean():.3f}, behind it {lit[0][~before].mean():.3f}")
    assert lit[0][before].mean() > 0.98
    assert lit[0][~before].mean() < 0.02
    assert lit[1].min() == 1


def test_what_is_lit_depends_neither_on_threads_nor_chunks_nor_order() -> None:
    points, _ = straight(500, 5)
    own, t, axis, ways = stretches(points, 200, 2e-3)
    roots = points[own, 0].copy()
    kernels.set_threads(1)
    whole = [shadows(points).lit(light, axis, ways, roots, t) for light in range(3)]
    for threads, chunk in ((1, 7), (2, 500), (3, 64)):
        kernels.set_threads(threads)
        for strands in (points, points[::-1].copy()):
            maps = shadows(strands, chunk)
            for light in range(3):
                assert np.array_equal(whole[light], maps.lit(light, axis, ways, roots, t))
                assert np.array_equal(whole[light][9:], maps.lit(light, axis[9:], ways[9:], roots[9:], t[9:]))
    assert 0.05 < np.mean(whole) < 0.95


def test_broken_strands_hide_nothing() -> None:
    points, _ = straight(4, 6)
    points[0] += 10
    points[1, 1] = np.nan
    points[2, :, 0] = 1e30
    maps = shadows(points)
    axis = np.array([[0, 0, 0], [5, 5, 5], [np.nan, 0, 0], [1e30, 0, 0]], np.float32)
    ways = np.full((4, 2, 3), 1e-3, np.float32)
    lit = maps.lit(0, axis, ways, np.ones((4, 3), np.float32), np.zeros(4, np.float32))
    assert np.isfinite(lit).all()
    assert lit[1] == 1


def test_where_strands_are_not_told_apart_none_can_be_asked_for() -> None:
    maps = kernels.Shadows(LIGHTS)
    maps.begin(LOW, HIGH, SPACING, WIDTH)
    maps.finish(np.zeros((1, 1, 1), np.float32), LOW, 1.0, None, np.eye(4))
    with pytest.raises(ValueError, match="told apart"):
        maps.lit(
            0,
            np.zeros((1, 3), np.float32),
            np.zeros((1, 2, 3), np.float32),
            np.zeros((1, 3), np.float32),
            np.zeros(1, np.float32),
        )
