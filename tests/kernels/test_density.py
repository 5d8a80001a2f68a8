"""The density grid and its sweeps: mass, determinism, line integrals."""

from collections.abc import Iterator

import numpy as np
import pytest
from numpy.typing import NDArray

from pipeline import kernels

_F32 = NDArray[np.float32]

ORIGIN, SPACING, SHAPE = np.array([-0.1, -0.05, 0.2]), 2.5e-3, (40, 48, 36)
LIGHTS = np.array([[0.6, 0.0, 0.8], [0.0, -1.0, 0.0], [-0.48, 0.64, -0.6], [1.0, 0.0, 0.0]], np.float32)


@pytest.fixture
def threads() -> Iterator[None]:
    """Puts the number of threads back."""
    before = kernels.threads()
    yield
    kernels.set_threads(before)


def random_strands(count: int, points: int, seed: int = 3) -> tuple[_F32, _F32]:
    """Random walks well inside the grid, with random widths."""
    rng = np.random.default_rng(seed)
    low, high = ORIGIN + 4 * SPACING, ORIGIN + (np.array(SHAPE) - 4) * SPACING
    steps = rng.normal(size=(count, points, 3)) * 2e-3
    walk = rng.uniform(low, high, (count, 1, 3)) + np.cumsum(steps, axis=1)
    widths = rng.uniform(0.5e-4, 2e-4, (count, points))
    return np.clip(walk, low, high).astype(np.float32), widths.astype(np.float32)


def filled(points: _F32, widths: _F32, chunk: int) -> _F32:
    grid = kernels.DensityGrid(SHAPE, ORIGIN, SPACING, 1e-4)
    for first in range(0, len(points), chunk):
        grid.add(points[first : first + chunk], widths[first : first + chunk])
    return grid.density()


def test_density_conserves_area() -> None:
    points, widths = random_strands(500, 12)
    density = filled(points, widths, 500)
    length = np.linalg.norm(np.diff(points.astype(np.float64), axis=1), axis=-1)
    area = length * (widths[:, 1:] + widths[:, :-1]) / 2
    error = abs(density.sum(dtype=np.float64) * SPACING**3 / area.sum() - 1)
    print(f"area lost or made: {error:.1e}")
    assert error < 2e-5


def test_density_is_the_same_for_any_threads_and_chunks(threads: None) -> None:
    points, widths = random_strands(1000, 9)
    kernels.set_threads(1)
    whole = filled(points, widths, 1000)
    for count, chunk in ((1, 7), (2, 1000), (3, 64), (8, 333)):
        kernels.set_threads(count)
        assert np.array_equal(filled(points, widths, chunk), whole), (count, chunk)
    assert np.array_equal(filled(points[::-1].copy(), widths[::-1].copy(), 100), whole)


def test_density_has_the_centre_of_mass_of_the_strand() -> None:
    points, widths = random_strands(1, 6)
    density = filled(points, np.full_like(widths, 1e-4), 1).astype(np.float64)
    middles = [ORIGIN[i] + (np.arange(SHAPE[i]) + 0.5) * SPACING for i in range(3)]
    found = (
        np.array([(density.sum(tuple({0, 1, 2} - {i})) * middles[i]).sum() for i in range(3)]) / density.sum()
    )
    p = points[0].astype(np.float64)
    length = np.linalg.norm(np.diff(p, axis=0), axis=1)
    expected = (length[:, None] * (p[1:] + p[:-1]) / 2).sum(0) / length.sum()
    error = np.abs(found - expected).max() / SPACING
    print(f"centre of mass off by {error:.1e} voxels")
    assert error < 1e-2


def test_strands_outside_the_grid_or_broken_are_left_out() -> None:
    points, widths = random_strands(3, 8)
    points[0] += 10
    points[1, 3] = np.nan
    points[2, :, 0] = 1e30
    density = filled(points, widths, 3)
    assert np.isfinite(density).all()
    assert density.sum() * SPACING**3 < 8 * 1e-2 * 2e-4


def test_optical_depth_of_a_slab_is_its_slanted_thickness() -> None:
    n, h, rho = 64, 1e-3, 30.0
    density = np.zeros((1, n, n, n), np.float32)
    density[:, :, 20:40] = rho
    L = np.array([[0.3, 0.9, -0.2]], np.float32)
    L /= np.linalg.norm(L)
    depth = kernels.optical_depth(density, h, L)[0]
    below = depth[32, :20, 32]
    error = np.abs(below[2:] / (rho * 20 * h / L[0, 1]) - 1).max()
    print(f"slab: relative error {error:.1e}")
    assert error < 1e-5
    assert np.abs(depth[:, 41:]).max() == 0


@pytest.mark.parametrize("seed", range(4))
def test_optical_depth_agrees_with_a_ray_march(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n, h = 64, 1e-3
    x, y, z = np.meshgrid(*[np.linspace(-1, 1, n)] * 3, indexing="ij")
    density = (40 * np.exp(-8 * (x**2 + (y - 0.1) ** 2 + 0.5 * z**2)) * (1 + 0.3 * np.sin(9 * x) * z)).astype(
        np.float32
    )
    L = rng.normal(size=3)
    L /= np.linalg.norm(L)
    swept = kernels.optical_depth(density[None], h, L[None].astype(np.float32))[0]
    starts = rng.integers(16, 48, (40, 3))
    steps = np.arange(0, 2 * n, 0.25)
    along = starts[:, None] + (steps[:, None] + 0.125) * L
    low = np.clip(np.floor(along).astype(int), -1, n)
    padded = np.pad(density, 2)
    marched = np.zeros(along.shape[:2])
    for corner in np.ndindex(2, 2, 2):
        at = np.clip(low + corner, -2, n + 1) + 2
        weight = np.prod(np.where(corner, along - low, 1 - (along - low)), axis=-1)
        marched += np.where(
            ((along > -1) & (along < n)).all(-1), weight * padded[tuple(np.moveaxis(at, -1, 0))], 0
        )
    marched = marched.sum(1) * 0.25 * h
    difference = (swept[tuple(starts.T)] - marched) / marched.mean()
    bias, scatter = difference.mean(), np.abs(difference).mean()
    print(f"sweep against march: mean {bias:+.1e}, scatter {scatter:.1e}")
    assert abs(bias) < 0.015
    assert scatter < 0.02


def test_optical_depths_towards_and_away_add_up_to_the_line() -> None:
    points, widths = random_strands(300, 12)
    density = filled(points, widths, 300)[None]
    for axis in range(3):
        L = np.zeros((2, 3), np.float32)
        L[:, axis] = 1, -1
        both = kernels.optical_depth(density, SPACING, L).sum(0)
        line = density[0].sum(axis, keepdims=True) * SPACING
        error = np.abs(both - line).max() / line.max()
        print(f"axis {axis}: {error:.1e}")
        assert error < 1e-6


def test_body_density_is_the_head_one_voxel_thinner() -> None:
    n, h = 48, 5e-3
    x = (np.stack(np.meshgrid(*[np.arange(n)] * 3, indexing="ij"), axis=-1) - n / 2) * h
    field = kernels.DistanceField(
        (np.linalg.norm(x, axis=-1) - 0.08).astype(np.float32), np.full(3, -n / 2 * h), h
    )
    pose = np.eye(4)
    pose[:3, 3] = 0.01, -0.02, 0.005
    spacing, shape = 4e-3, (60, 60, 60)
    origin = np.full(3, -0.12)
    body = kernels.body_density(field, pose, shape, origin, spacing)
    volume = body.sum(dtype=np.float64) * spacing**3 / (1.5 / spacing)
    radius = np.cbrt(volume * 3 / (4 * np.pi))
    print(f"radius {radius * 1e3:.2f} mm")
    assert radius == pytest.approx(0.08 - spacing, abs=2e-4)
    middles = origin[0] + (np.arange(60) + 0.5) * spacing
    centre = (body.sum((1, 2)) * middles).sum() / body.sum()
    assert centre == pytest.approx(0.01, abs=1e-4)


def test_surroundings_of_nothing_see_the_whole_sky_and_normals_point_out_of_the_hair() -> None:
    n = 32
    directions = np.concatenate([np.eye(3), -np.eye(3)]).astype(np.float32)
    loss = np.array([0.0, 0.3, 0.9], np.float32)
    empty, body = np.zeros((n, n, n), np.float32), np.zeros((n // 2, n // 2, n // 2), np.float32)
    even, lopsided = np.zeros((2, 6, 17), np.float32)
    even[:, :3], lopsided[:, :3] = 1, 6 * (directions[:, :1] > 0)
    for answers in (even, lopsided):
        for open_sky in kernels.surroundings(empty, body, 1e-3, loss, directions, answers):
            assert np.abs(open_sky[..., :3] - 1).max() < 1e-6
    hair = empty.copy()
    hair[8:24, 8:24, 8:24] = 500
    sky, plain = kernels.surroundings(hair, body, 1e-3, loss, directions, even)
    assert np.array_equal(sky[..., :3], plain[..., :3])
    assert not sky[..., 8:].any()
    # No loss, no shadow; more loss, more shadow
    assert np.abs(sky[..., 0] - 1).max() < 1e-6
    inside = sky[8, 8, 8]
    assert inside[2] < inside[1] < inside[0]
    expected = np.exp(-loss[1] * 500 * 1e-3 * 8)
    assert inside[1] == pytest.approx(expected, rel=0.2)
    assert sky[4, 8, 8, 4] < 0 < sky[11, 8, 8, 4]
    # Where hair answers only to light that comes along x, what lies there counts alone
    from_x, _ = kernels.surroundings(hair, body, 1e-3, loss, directions, lopsided)
    assert from_x[13, 8, 8, 1] == pytest.approx(1, abs=1e-6)
    assert from_x[2, 8, 8, 1] < 0.1 < sky[2, 8, 8, 1]
    # Answers that turn across the grid do so from its middle on; what fibres mirror is summed as it comes through
    turned = even.copy()
    turned[0, 6], turned[:, 12:] = 100, [1, -1, 0.5, -0.5, 0.25]
    across, _ = kernels.surroundings(hair, None, 1e-3, loss, directions, turned)
    for x in (0, 15):
        more = 100 * (x - 7.5) * 2e-3 / 6 * (from_x if x else plain)[x, 0, 0, 1]
        assert across[x, 0, 0, 1] - plain[x, 0, 0, 1] == pytest.approx(more, abs=1e-6)
    assert np.abs(across[..., 8:13] - plain[..., 1:2] * [1, -1, 0.5, -0.5, 0.25]).max() < 1e-6


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: kernels.DensityGrid((2, 8, 8), ORIGIN, 1e-3, 1e-4), "voxels"),
        (lambda: kernels.DensityGrid((8, 8, 8), ORIGIN, 0.0, 1e-4), "spacing"),
        (lambda: kernels.optical_depth(np.zeros((1, 4, 4, 4), np.float32), 1e-3, 2 * LIGHTS), "unit"),
        (lambda: kernels.optical_depth(np.zeros((2, 4, 4, 4), np.float32), 1e-3, LIGHTS), "one density"),
    ],
)
def test_wrong_grids_are_refused(call: object, message: str) -> None:
    assert callable(call)
    with pytest.raises(ValueError, match=message):
        call()
