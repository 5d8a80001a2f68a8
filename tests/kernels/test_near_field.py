"""Strands wider than cells of pixels: what they show across, and that nothing else changes."""

from functools import cache

import numpy as np
import pytest
import raster_twin as twin
from numpy.typing import NDArray

from pipeline import kernels
from pipeline.render import fibre

_F32 = NDArray[np.float32]
_F64 = NDArray[np.float64]

SIGMA = 0.5
ROUGH = 0.3
LINEAR = (np.arange(256) / 255).astype(np.float32)
EYE = np.array([0.0, 0.0, twin.EYE])


@cache
def tables() -> kernels.FibreTables:
    """Of one kind of fibre without tilt, the same from root to tip."""
    return fibre.Scattering(ROUGH, ROUGH, 0.0).tables(pigment())


def pigment() -> _F32:
    own = np.ones((2, 2, 4), np.float32)
    own[..., :3] = SIGMA
    return own


@cache
def lit(azimuth: float, upwards: float = 0.0) -> kernels.Illumination:
    """One light without shadows, this far [rad] from the eye about strands along y, to the right; and above."""
    L = np.array(
        [
            [
                np.sin(azimuth) * np.cos(upwards),
                np.sin(upwards),
                np.cos(azimuth) * np.cos(upwards),
            ]
        ],
        np.float32,
    )
    shadows = kernels.Shadows(L)
    low, high = np.full(3, -1.0), np.full(3, 1.0)
    shadows.begin(low, high, 0.1, 1e-3)
    shadows.finish(np.zeros((4, 4, 4), np.float32), low, 0.5, None, np.eye(4))
    around, everywhere = np.ones((2, 2, 2, 16), np.float32), np.ones((2, 2, 2, 4), np.float32)
    none = np.zeros(3, np.float32)
    return kernels.Illumination(L, np.ones((1, 3), np.float32), none, shadows, around, everywhere)


def draw(points: _F32, pixels: float, light: kernels.Illumination, side: int, chunk: int = 1000) -> _F32:
    """The picture (side, side, 3) of strands (S, P, 3) that are `pixels` wide where z is 0, over black."""
    widths = np.full(points.shape[:2], pixels * twin.EYE / twin.scale(side), np.float32)
    variation = np.tile(np.array([0, 1, 0], np.float32), (len(points), 1))
    key = np.zeros(len(points), np.uint32)
    raster = kernels.Raster((side, side), 30.0)
    raster.begin(twin.matrix(side, side), twin.scale(side), (twin.NEAR, twin.FAR))
    back = kernels.Backdrop(np.ones((side, side), np.float32), np.zeros((side, side, 3), np.uint8), LINEAR, 1)
    raster.count(points, widths, 0)
    raster.cut_off(back)
    shader = kernels.FibreShader(light, tables(), EYE)
    picture, wrong = np.zeros((side, side, 3), np.float32), 1
    while wrong:
        for first in range(0, len(points), chunk):
            part = slice(first, first + chunk)
            raster.add(points[part], widths[part], variation[part], key[part])
        wrong = raster.compose(back, shader, picture)
    return picture


def upright(x: _F64, z: _F64 | float = 0.0) -> _F32:
    """Straight strands (S, 9, 3) upwards through the picture at x [m], as deep as z."""
    points = np.zeros((len(x), 9, 3), np.float32)
    points[..., 0], points[..., 2] = x[:, None], np.broadcast_to(z, x.shape)[:, None]
    points[..., 1] = np.linspace(-0.9, 0.9, 9)
    return points


def of_rays(h: _F64, azimuth: float) -> _F64:
    """Radiance at offsets h to the right of a strand seen and lit from in front of it, by the formulas."""
    one, s = np.ones_like(h), fibre.scale(ROUGH)
    leaving = fibre.attenuation(one, h, SIGMA * one)
    # A light at theta 0: M is that of cos ti cos to = 1
    M = [1 / (v * (1 - np.exp(-2 / v))) * np.i0(1 / v) * np.exp(-1 / v) for v in fibre.variances(ROUGH)]
    around = [fibre.logistic(azimuth - fibre.deflection(p, one, -h), s) for p in range(3)]
    return np.sum(
        [m * a * d for m, a, d in zip(M, leaving, [*around, one / (2 * np.pi)], strict=True)], axis=0
    )


@pytest.mark.parametrize("degrees", [0, 40, -100, 180])
def test_places_across_a_strand_show_what_rays_that_meet_it_there_see(degrees: float) -> None:
    """A profile across 60 px, with light from before, from either side and from behind."""
    phi, side, wide = np.radians(degrees), 128, 60.0
    row = draw(upright(np.zeros(1)), wide, lit(phi), side)[side // 2, :, 0]
    h = (np.arange(side) + 0.5 - side / 2) / (wide / 2)
    well = np.abs(h) < 0.97
    # Each place shows the mean over a sixteenth, and colours are linear from one to the next
    fine = (np.arange(4000) + 0.5) / 2000 - 1
    places = of_rays(fine, phi).reshape(16, -1).mean(1)
    rays = np.interp(h[well], fine.reshape(16, -1).mean(1), places)
    error = np.abs(row[well] - rays).mean() / rays.mean()
    print(f"{degrees} degrees: mean error {error:.3f} of the mean, peak {row.max():.2f} for {rays.max():.2f}")
    assert error < 0.05
    assert row.max() == pytest.approx(rays.max(), rel=0.1)


@pytest.mark.parametrize("degrees", [5, 40, -100, 180])
def test_the_mean_over_the_width_is_that_of_a_thin_strand_at_any_width(degrees: float) -> None:
    """A zoom from 0.1 to 12 px: light by width goes on evenly, to the 1/32 at which a pixel counts as closed."""
    side, light, at = 64, lit(np.radians(degrees), 0.3), upright(np.array([0.0137]))
    widths = np.geomspace(0.1, 12, 49)
    found = np.array([draw(at, w, light, side)[31:33].sum() / (2 * w) for w in widths])
    thin = found[0]  # its mean colour
    print(f"{degrees} degrees: {found.min() / thin:.4f} to {found.max() / thin:.4f} of a thin strand's light")
    assert found == pytest.approx(np.full(found.shape, thin), rel=0.02)


def packed() -> tuple[_F64, _F64]:
    """Places and depths [m] of 600 strands in a layer four of them thick."""
    rng = np.random.default_rng(5)
    return rng.uniform(-0.9, 0.9, 600), rng.uniform(-0.02, 0.02, 600)


def test_packed_strands_show_in_each_column_what_a_picture_eight_times_as_fine_does() -> None:
    """Half a pixel wide and nearly four layers deep, as lit hair in a close-up: which side is hidden tells the colour."""
    side, fine, wide = 96, 8, 0.55
    x, z = packed()
    points = upright(x[: int(3.5 * 0.9 * side / wide)], z[: int(3.5 * 0.9 * side / wide)])
    light = lit(0.0, 0.4)
    ours = draw(points, wide, light, side)[32:64, 8:-8, 0]
    truth = draw(points, wide * fine, light, side * fine)
    truth = truth.reshape(side, fine, side, fine, 3).mean(axis=(1, 3))[32:64, 8:-8, 0]
    column, true = ours.mean(0), truth.mean(0)
    together = float(np.corrcoef(column, true)[0, 1])
    contrast = column.std() / column.mean(), true.std() / true.mean()
    print(
        f"mean {column.mean() / true.mean():.3f}, contrast {contrast[0]:.3f} for {contrast[1]:.3f}, "
        f"correlation {together:.3f}"
    )
    assert column.mean() == pytest.approx(true.mean(), rel=0.02)
    assert contrast[0] == pytest.approx(contrast[1], rel=0.12)
    assert together > 0.9


@pytest.mark.parametrize("threads", [1, 3])
def test_wide_strands_depend_neither_on_threads_nor_on_chunks(threads: int) -> None:
    x, z = packed()
    points, light = upright(x[:200], z[:200]), lit(0.7)
    whole = draw(points, 2.0, light, 96)
    before = kernels.threads()
    kernels.set_threads(threads)
    parts = draw(points, 2.0, light, 96, chunk=37)
    kernels.set_threads(before)
    print(f"largest difference {np.abs(whole - parts).max():.1e}")
    assert np.array_equal(whole, parts)
