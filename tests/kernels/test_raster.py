"""Strands by coverage: exact coverage, hidden hair, the backdrop, clipping; nothing depends on chunks or threads."""

from typing import Any

import numpy as np
import pytest
import raster_twin as twin
from numpy.typing import NDArray
from own_colours import own_colours

from pipeline import kernels

F32 = NDArray[np.float32]

LINEAR = (np.arange(256) / 255).astype(np.float32)


def backdrop(
    height: int, width: int, per_side: int = 1, depth: Any = 1.0, level: int = 51
) -> kernels.Backdrop:
    shape = (height * per_side, width * per_side)
    samples = np.full((*shape, 3), level, np.uint8)
    return kernels.Backdrop(np.array(np.broadcast_to(depth, shape), np.float32), samples, LINEAR, per_side)


def shader(colours: F32) -> kernels.FibreShader:
    """Strands under a sky of radiance 1 that show the colours (S, P, 3) of their roots."""
    sums = np.zeros((2, 2, 8), np.float32)
    sums[1, :, 0] = 1
    flat = np.ones(4, np.float32)
    tables = kernels.FibreTables(
        np.zeros((2, 2, 2, 8), np.float32), sums, own_colours(colours[:, 0] ** 2)[0], flat, 0 * flat, 1.0
    )
    none, around = np.zeros((0, 3), np.float32), np.zeros((2, 2, 2, 16), np.float32)
    around[..., :8] = 1
    everywhere = np.ones((2, 2, 2, 4), np.float32)
    sky = np.ones(3, np.float32)
    light = kernels.Illumination(none, none, sky, kernels.Shadows(none), around, everywhere)
    return kernels.FibreShader(light, tables, np.array([0.0, 0.0, twin.EYE]))


def raster_of(size: tuple[int, int], layers: float = 20.0) -> kernels.Raster:
    raster = kernels.Raster(size, layers)
    raster.begin(twin.matrix(*size), twin.scale(size[1]), (twin.NEAR, twin.FAR))
    return raster


def shown(colours: F32) -> tuple[F32, NDArray[np.uint32]]:
    """Variation (S, 3) and keys (S,) of strands that show the colours (S, P, 3) of their roots."""
    return own_colours(colours[:, 0] ** 2)[1], np.zeros(len(colours), np.uint32)


def draw(
    points: F32,
    widths: F32,
    colours: F32,
    size: tuple[int, int],
    layers: float = 30.0,
    chunk: int = 1000,
    **behind: Any,
) -> F32:
    """The picture (H, W, 3) of strands (S, P, 3) with widths (S, P) and linear colours (S, P, 3), each its root's."""
    width, height = size
    back = backdrop(height, width, **behind)
    raster = raster_of(size, layers)
    variation, key = shown(colours)
    for first in range(0, len(points), chunk):
        raster.count(points[first : first + chunk], widths[first : first + chunk], first)
    raster.cut_off(back)
    picture = np.zeros((height, width, 3), np.float32)
    wrong = 1
    for _ in range(2):
        for first in range(0, len(points), chunk):
            part = slice(first, first + chunk)
            raster.add(points[part], widths[part], variation[part], key[part])
        wrong = raster.compose(back, shader(colours), picture)
        if not wrong:
            break
    assert not wrong
    return picture


def bundle(strands: int, points: int, seed: int, pixels: float, height: int) -> tuple[F32, F32, F32]:
    """Wavy strands all over the picture, some of them deep, about so many pixels wide."""
    random = np.random.default_rng(seed)
    root = random.uniform([-1, -1, -0.4], [1, 1, 0.4], (strands, 3))
    step = random.normal(0, 0.5 / points, (strands, 1, 3)) + random.normal(
        0, 0.25 / points, (strands, points, 3)
    )
    at = root[:, None] + np.cumsum(step * [1, 1, 0.3], axis=1)
    widths = np.full((strands, points), pixels * 2 / height)
    colours = random.uniform(0, 1, (strands, 1, 3)) + np.zeros((1, points, 1))
    return at.astype(np.float32), widths.astype(np.float32), colours.astype(np.float32)


@pytest.mark.parametrize("pixels", [0.1, 0.35, 0.75, 2.0])
def test_coverage_of_one_segment_is_its_area(pixels: float) -> None:
    size, errors = (16, 16), []
    random = np.random.default_rng(5)
    for _ in range(12):
        ends = random.uniform(-0.7, 0.7, (1, 2, 3)) * [1, 1, 0]
        points, widths = ends.astype(np.float32), np.full((1, 2), pixels * 2 / 16, np.float32)
        white = np.ones((1, 2, 3), np.float32)
        found = draw(points, widths, white, size, level=0)
        errors.append(found - twin.drawn(points, widths, white, np.zeros((16, 16, 3)), 64))
    rms, bias = np.sqrt(np.mean(np.square(errors))), np.mean(errors) / max(pixels, 1e-9)
    print(f"{pixels} px: rms {rms:.4f}, bias {bias:.5f} of the width")
    assert rms < 0.003
    assert abs(bias) < 0.003


def test_many_strands_look_as_by_16_x_16_samples() -> None:
    points, widths, colours = bundle(700, 6, 1, 0.8, 48)
    found = draw(points, widths, colours, (48, 48))
    wanted = twin.drawn(points, widths, colours, np.full((48, 48, 3), 0.2), 16)
    error = np.sqrt(np.mean((found - wanted) ** 2))
    coarse = np.sqrt(
        np.mean((twin.drawn(points, widths, colours, np.full((48, 48, 3), 0.2), 4) - wanted) ** 2)
    )
    print(f"rms {error:.4f}; of 4 x 4 samples {coarse:.4f}")
    assert error < coarse
    assert abs(float(np.mean(found - wanted))) < 0.002


def test_thick_layers_are_parted_where_they_cross() -> None:
    """Two sheets of strands pass through one another away from a tile's middle, where its strands are sorted."""
    random, across, cross, slope, size = np.random.default_rng(8), 400, 0.15, 0.5, 48
    x, y = random.uniform(-1, 1, (2, across, 1)) + np.zeros(2), np.array([-1.2, 1.2])
    sheet = np.array([1.0, -1.0])[:, None, None] * slope * (y - cross) + random.normal(0, 0.1, (2, across, 1))
    points = np.stack(np.broadcast_arrays(x, y, sheet), axis=-1).reshape(-1, 2, 3).astype(np.float32)
    colours = (np.repeat(np.eye(3)[:2], across, axis=0)[:, None] + np.zeros((1, 2, 1))).astype(np.float32)
    widths = np.full(points.shape[:2], 0.7 * 2 / size, np.float32)
    found = draw(points, widths, colours, (size, size))
    wanted = twin.drawn(points, widths, colours, np.full((size, size, 3), 0.2), 8)
    rows, right = (each[:, 4:-4].mean(axis=1)[:, 0] for each in (found, wanted))
    print("red in rows 12 to 32:", np.round(rows[12:33], 2), "for", np.round(right[12:33], 2))
    assert np.abs(rows - right).max() < 0.25


def test_a_strand_is_one_band_however_many_points_it_has() -> None:
    ends = np.array([[-0.6, -0.5, 0.1], [0.7, 0.4, -0.2]])
    pictures = []
    for count in (2, 33):
        # equal parts on the screen are not equal in space: the colour is constant, so that only coverage counts
        points = (ends[0] + np.linspace(0, 1, count)[:, None] * (ends[1] - ends[0])).astype(np.float32)[None]
        white = np.ones((1, count, 3), np.float32)
        pictures.append(draw(points, np.full((1, count), 0.02, np.float32), white, (40, 40)))
    apart = float(np.abs(pictures[0] - pictures[1]).max())
    print(f"{apart:.4f}")
    assert apart < 0.002


def test_more_points_on_the_same_lines_cover_the_same_pixels() -> None:
    """Joints lose nothing: parallel to the picture, so that the segments of a strand are equal on the screen, too."""
    ends = np.random.default_rng(11).uniform(-0.9, 0.9, (12, 2, 3)) * [1, 1, 0]
    sums, worst = [], []
    for pixels in (0.2, 0.7, 3.0):
        pictures = []
        for count in (2, 16, 64, 200):
            part = np.linspace(0, 1, count)[:, None]
            points = (ends[:, :1] + part * (ends[:, 1:] - ends[:, :1])).astype(np.float32)
            widths = np.full(points.shape[:2], pixels * 2 / 64, np.float32)
            pictures.append(draw(points, widths, np.ones_like(points), (64, 64), level=0))
        sums.append([float(each.sum() / pictures[0].sum()) for each in pictures[1:]])
        worst.append(max(float(np.abs(each - pictures[0]).max()) for each in pictures[1:]))
        print(f"{pixels} px: {np.round(sums[-1], 5)} of the coverage, pixels apart by {worst[-1]:.4f}")
    assert np.abs(np.subtract(sums, 1)).max() < 0.001
    assert max(worst) < 0.1  # a cell's centre that lies on a joint may go to both segments, or to none


@pytest.mark.parametrize("threads", [1, 2])
def test_the_picture_depends_neither_on_threads_nor_on_chunks(threads: int) -> None:
    points, widths, colours = bundle(3000, 8, 2, 0.6, 64)
    kernels.set_threads(2)
    whole = draw(points, widths, colours, (64, 64))
    kernels.set_threads(threads)
    for chunk in (17, 1000, 5000):
        assert np.array_equal(draw(points, widths, colours, (64, 64), chunk=chunk), whole), chunk


def test_what_is_cut_off_would_not_have_been_seen() -> None:
    """Cut off at half a layer nearly every tile is wrong at first, and drawn again."""
    points, widths, colours = bundle(4000, 8, 3, 1.5, 64)
    everything = draw(points, widths, colours, (64, 64), layers=1e6)
    for layers in (0.5, 4, 20):
        assert np.array_equal(draw(points, widths, colours, (64, 64), layers=layers), everything), layers


def test_few_points_of_dense_hair_are_shaded() -> None:
    points, widths, colours = bundle(20000, 8, 4, 1.5, 64)
    back, raster = backdrop(64, 64), raster_of((64, 64))
    raster.count(points, widths, 0)
    raster.cut_off(back)
    raster.add(points, widths, *shown(colours))
    assert raster.shaded == 0
    raster.compose(back, shader(colours), np.zeros((64, 64, 3), np.float32))
    part = raster.shaded / (points.size / 3)
    print(f"{part:.1%} of the points")
    assert 0 < part < 0.2


def test_hair_behind_the_backdrop_is_hidden_to_the_sample() -> None:
    """The backdrop is in front in the right half, whose edge goes through the middle of pixels."""
    points = np.array([[[-0.9, 0.013, 0], [0.9, 0.013, 0]]], np.float32)
    widths, white = np.full((1, 2), 0.4, np.float32), np.ones((1, 2, 3), np.float32)
    depth = np.ones((1, 2 * 21), np.float32)
    depth[:, 21:] = 0.1
    found = draw(points, widths, white, (21, 21), per_side=2, depth=depth, level=0)
    row = found[10, :, 0]
    print(row.round(2))
    assert np.allclose(row[3:10], 1, atol=1e-3)
    assert row[10] == pytest.approx(0.5, abs=1e-3)
    assert np.all(row[11:] == 0)


def test_without_hair_the_backdrop_is_averaged() -> None:
    random = np.random.default_rng(6)
    for per_side in (1, 2, 3, 4):
        samples = random.integers(0, 256, (8 * per_side, 8 * per_side, 3)).astype(np.uint8)
        back = kernels.Backdrop(np.ones(samples.shape[:2], np.float32), samples, LINEAR, per_side)
        raster = raster_of((8, 8))
        raster.cut_off(back)
        picture = np.zeros((8, 8, 3), np.float32)
        assert raster.compose(back, shader(np.zeros((2, 2, 3), np.float32)), picture) == 0
        mean = (samples / 255).reshape(8, per_side, 8, per_side, 3).mean(axis=(1, 3))
        assert np.abs(picture - mean).max() < 1e-6


def test_a_strand_that_passes_the_camera_is_cut_at_the_near_plane() -> None:
    """The part in front of it is drawn as if the rest were not there."""
    to_camera = np.array([[[-0.9, -0.6, 0.0], [0.9, 0.5, 2.4]]])
    part = (twin.EYE - twin.NEAR) / 2.4
    cut = to_camera.copy()
    cut[:, 1] = to_camera[:, 0] + part * (to_camera[:, 1] - to_camera[:, 0])
    widths, white = np.full((1, 2), 0.1, np.float32), np.ones((1, 2, 3), np.float32)
    whole = draw(to_camera.astype(np.float32), widths, white, (40, 40))
    short = draw(cut.astype(np.float32), widths, white, (40, 40))
    assert (whole > 0.5).sum() > 10
    assert np.abs(whole - short).max() < 1e-3


@pytest.mark.parametrize("bad", [np.nan, np.inf, -1e30, 1e30])
def test_broken_strands_leave_the_others_alone(bad: float) -> None:
    points, widths, colours = bundle(50, 6, 7, 0.8, 32)
    broken = points.copy()
    broken[10, 3] = bad
    broken[20] = bad
    found = draw(broken, widths, colours, (32, 32))
    with_it, without = (
        draw(*(np.delete(of, gone, axis=0) for of in (points, widths, colours)), (32, 32))
        for gone in ([20], [10, 20])
    )
    beside = (with_it == without).all(axis=2)
    same = (np.abs(found - without)[beside] < 1e-6).all(axis=1).mean()
    print(
        f"beside the broken strand, {beside.mean():.1%} of the picture, {same:.1%} of the pixels are the same"
    )
    assert np.isfinite(found).all()
    assert beside.mean() > 0.8
    assert same == 1 if not np.isfinite(bad) else same > 0.9  # a point far away is one: a segment leads there


def test_wrong_shapes_are_refused() -> None:
    points, widths, colours = bundle(5, 6, 8, 0.8, 32)
    variation, key = shown(colours)
    raster = kernels.Raster((32, 32), 20.0)
    with pytest.raises(ValueError, match="before begin"):
        raster.count(points, widths, 0)
    raster = raster_of((32, 32))
    with pytest.raises(ValueError, match="before cut_off"):
        raster.add(points, widths, variation, key)
    with pytest.raises(ValueError, match="another size"):
        raster.cut_off(backdrop(16, 16))
    raster.cut_off(backdrop(32, 32))
    with pytest.raises(ValueError, match="do not fit"):
        raster.add(points, widths[:, 1:].copy(), variation, key)
    with pytest.raises(ValueError, match="do not fit"):
        raster.add(points, widths, variation[1:], key)
    raster.add(points, widths, variation, key)
    with pytest.raises(ValueError, match="another number of points"):
        raster.add(points[:, 1:].copy(), widths[:, 1:].copy(), variation, key)
    with pytest.raises(ValueError, match="another size"):
        raster.compose(backdrop(32, 32), shader(colours), np.zeros((16, 16, 3), np.float32))
