"""Shadow maps: counts against exact rays, thin layers, edges of the head, determinism."""

import numpy as np
import pytest
from numpy.typing import NDArray

from pipeline import kernels

_F32 = NDArray[np.float32]
_F64 = NDArray[np.float64]

LOW, HIGH = np.array([-0.03, -0.02, -0.03]), np.array([0.03, 0.02, 0.03])
LIGHTS = np.array([[0.36, 0.48, 0.8], [0.0, 1.0, 0.0], [-0.6, 0.0, -0.8]], np.float32)
WIDTH, SPACING = 2e-4, 5e-4


def straight(count: int, seed: int) -> tuple[_F32, _F32]:
    """Strands of 3 points along x and nearly straight, anywhere in a box."""
    rng = np.random.default_rng(seed)
    middle = rng.uniform(LOW * 0.8, HIGH * 0.8, (count, 3)) * [0, 1, 1]
    along = np.array([1.0, 0, 0]) + 0.2 * rng.normal(size=(count, 3))
    points = middle[:, None] + along[:, None] * np.array([-0.024, 0, 0.024])[:, None]
    return points.astype(np.float32), np.full((count, 3), WIDTH, np.float32)


def shadows(points: _F32, widths: _F32, chunk: int = 10**9, share: float = 1.0) -> kernels.Shadows:
    maps = kernels.Shadows(LIGHTS)
    maps.begin(LOW, HIGH, SPACING, WIDTH, share)
    for first in range(0, len(points), chunk):
        maps.add(points[first : first + chunk], widths[first : first + chunk])
    maps.finish(np.zeros((4, 4, 4), np.float32), LOW, 0.02, None, np.eye(4))
    return maps


def passed(points: _F32, x: _F64, own: NDArray[np.intp], L: _F64) -> NDArray[np.intp]:
    """How many other strands rays (N,) from x (N, 3) towards L meet: distance of lines under half a width."""
    counts = np.zeros(len(x), np.intp)
    for j in range(2):
        a, e = (points[:, j].astype(float), (points[:, j + 1] - points[:, j]).astype(float))
        normal = np.cross(e, L)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        offset = a[None] - x[:, None]
        near = np.abs((offset * normal).sum(-1)) < WIDTH / 2
        # Where the ray passes: along the segment, and ahead of the point
        across = np.cross(normal, L)
        along = -(offset * across).sum(-1) / (e * across).sum(-1)
        ahead = ((offset + along[..., None] * e) @ L) > 0
        hit = near & (along >= 0) & (along < 1) & ahead
        hit[np.arange(len(x)), own] = False
        counts += hit.sum(1)
    return counts


@pytest.mark.parametrize("light", range(3))
def test_counts_are_those_of_exact_rays(light: int) -> None:
    points, widths = straight(1500, 1)
    rng = np.random.default_rng(2)
    own, t = rng.integers(0, len(points), 1500), rng.uniform(0.2, 0.8, (1500, 1))
    x = points[own, 0] * (1 - t) + points[own, 1] * t
    exact = passed(points, x.astype(float), own, LIGHTS[light].astype(float))
    n = shadows(points, widths).reach(light, x.astype(np.float32), 1.0)[:, 0]
    seen = (exact == 0).mean(), np.exp(-n).mean()
    print(
        f"light {light}: strands {n.mean():.2f}, exact {exact.mean():.2f}; lit {seen[1]:.3f}, exact {seen[0]:.3f}"
    )
    assert n.mean() == pytest.approx(exact.mean(), rel=0.12)
    assert seen[1] == pytest.approx(seen[0], abs=0.02)


def test_points_that_are_seen_are_lit_as_exact_rays_say() -> None:
    """Looked up a quarter of a node nearer the eye: what is seen lies before the mean of the strands around it."""
    points, widths = straight(3000, 7)
    rng = np.random.default_rng(8)
    own, t = rng.integers(0, len(points), 12000), rng.uniform(0.2, 0.8, (12000, 1))
    x = (points[own, 0] * (1 - t) + points[own, 1] * t).astype(float)
    maps = shadows(points, widths)
    for light, eye in (
        (0, [0.5, 0.1, 0.86]),
        (0, [-0.2, 0.9, 0.3]),
        (1, [0.3, 0.3, -0.9]),
        (2, [0.6, 0.5, 0.6]),
    ):
        toward = np.array(eye) / np.linalg.norm(eye)
        seen = passed(points, x, own, toward) == 0
        lit = (passed(points, x[seen], own[seen], LIGHTS[light].astype(float)) == 0).mean()
        on_axis, nearer = (
            np.exp(-maps.reach(light, (x[seen] + before * SPACING * toward).astype(np.float32))[:, 0]).mean()
            for before in (0.0, 0.25)
        )
        print(
            f"light {light}, {seen.sum()} seen: lit {nearer:.3f}, on the axis {on_axis:.3f}, exact {lit:.3f}"
        )
        assert nearer == pytest.approx(lit, abs=0.04)
        if toward @ LIGHTS[light] > 0:
            assert abs(nearer - lit) < 0.6 * abs(on_axis - lit)


def test_a_few_wide_strands_cast_the_shadows_of_all() -> None:
    points, widths = straight(8000, 3)
    x = points[::8, 1].copy()
    all_of, some = (
        np.exp(-shadows(p, w, share=share).reach(0, x)[:, 0]).mean()
        for p, w, share in ((points, widths, 1.0), (points[::4].copy(), 4 * widths[::4], 0.25))
    )
    print(f"lit: {all_of:.4f} by all strands, {some:.4f} by every fourth")
    assert some == pytest.approx(all_of, abs=0.01)


def test_a_layer_thinner_than_a_node_is_resolved() -> None:
    """Strands in a layer of 0.3 mm: the count grows evenly within it."""
    rng = np.random.default_rng(4)
    y = rng.uniform(0, 3e-4, 4000)
    z = rng.uniform(-0.02, 0.02, 4000)
    ends = np.array([-0.025, 0.025])
    points = np.stack([np.broadcast_to(ends, (4000, 2)), *(np.stack([c, c], 1) for c in (y, z))], -1)
    points = points.astype(np.float32)
    maps = shadows(points, np.full((4000, 2), WIDTH, np.float32))
    depth = np.linspace(2e-5, 2.8e-4, 14)
    x = np.zeros((2000, 14, 3), np.float32)
    x[..., 1], x[..., 2] = 3e-4 - depth, rng.uniform(-0.018, 0.018, (2000, 1))
    x[..., 0] = rng.uniform(-0.01, 0.01, (2000, 1))
    n = maps.reach(1, x.reshape(-1, 3))[:, 0].reshape(2000, 14).mean(0)
    expected = 4000 * WIDTH / 0.04 * depth / 3e-4
    error = np.abs(n - expected).max() / expected[-1]
    print(f"strands at 14 depths within 0.3 mm off by {error:.3f} of all {expected[-1]:.1f}")
    assert error < 0.12


def test_the_heads_shadow_has_its_edge_where_it_should() -> None:
    n, h = 41, 2e-3
    grid = (np.stack(np.meshgrid(*[np.arange(n)] * 3, indexing="ij"), axis=-1) - n // 2) * h
    ball = kernels.DistanceField(
        (np.linalg.norm(grid, axis=-1) - 0.01).astype(np.float32), np.full(3, -(n // 2) * h), h
    )
    maps = kernels.Shadows(LIGHTS)
    maps.begin(LOW, HIGH, SPACING, WIDTH)
    maps.finish(np.zeros((1, 1, 1), np.float32), LOW, 1.0, ball, np.eye(4))
    radii = np.linspace(0.005, 0.015, 201)
    turn = np.linspace(0, 2 * np.pi, 40)[:, None]
    x = np.stack([radii * np.cos(turn), np.full((40, 201), -0.018), radii * np.sin(turn)], -1)
    lit = maps.reach(1, x.reshape(-1, 3).astype(np.float32))[:, 2].reshape(40, 201)
    edge = radii[(lit > 0.5).argmax(1)]
    print(
        f"edge at {edge.mean() * 1e3:.2f} mm, +- {np.abs(edge - edge.mean()).max() * 1e3:.2f}; the ball has 10"
    )
    assert np.abs(edge - 0.01).max() < SPACING
    assert lit[:, -1].min() == 1
    assert lit[:, 0].max() == 0
    above = x.reshape(-1, 3) * [1, -1, 1]
    assert maps.reach(1, above.astype(np.float32))[:, 2].min() == 1


def test_maps_do_not_depend_on_threads_chunks_or_order() -> None:
    points, widths = straight(500, 5)
    kernels.set_threads(1)
    whole = [shadows(points, widths).map(light) for light in range(3)]
    for threads, chunk in ((1, 7), (2, 500), (3, 64)):
        kernels.set_threads(threads)
        cut = shadows(points, widths, chunk)
        back = shadows(points[::-1].copy(), widths, chunk)
        for light in range(3):
            for a, b, c in zip(whole[light], cut.map(light), back.map(light), strict=True):
                assert np.array_equal(a, b)
                assert np.array_equal(a, c)


def test_broken_strands_and_points_outside_do_no_harm() -> None:
    points, widths = straight(3, 6)
    points[0] += 10
    points[1, 1] = np.nan
    points[2, :, 0] = 1e30
    maps = shadows(points, widths)
    places = np.array([[0, 0, 0], [5, 5, 5], [np.nan, 0, 0], [1e30, 0, 0]], np.float32)
    found = maps.reach(0, places)
    assert np.isfinite(found).all()
    assert found[1].tolist() == [0, 0, 1]


def test_wrong_shadows_are_refused() -> None:
    with pytest.raises(ValueError, match="unit"):
        kernels.Shadows(2 * LIGHTS)
    with pytest.raises(ValueError, match="2000 spacings"):
        kernels.Shadows(LIGHTS).begin(LOW, HIGH, 1e-5, WIDTH)
    with pytest.raises(ValueError, match="finish"):
        kernels.Shadows(LIGHTS).reach(0, np.zeros((1, 3), np.float32))
