"""Shapes of strands, and the way from samples to pixels."""

import numpy as np
import pytest

from pipeline.body.placement import Placement
from pipeline.config.schema import Camera, Render
from pipeline.render.camera import CameraPath
from pipeline.render.geometry import (
    choose_shapes,
    drawn_width,
    one_fibre_each,
    projected_width,
    ribbons,
    smooth,
    taper,
)
from pipeline.render.target import BRIGHTEST, DECODED, encode


@pytest.mark.parametrize(("pixels", "shape"), [(0.2, "coverage"), (3.0, "coverage"), (4.0, "tubes")])
def test_auto_draws_by_projected_width(pixels: float, shape: str) -> None:
    assert choose_shapes(Render(), pixels) == ((shape, 1.0),)
    assert choose_shapes(Render(geometry="lines"), pixels) == (("lines", 1.0),)


def test_auto_fades_from_coverage_to_tubes_without_a_step() -> None:
    widths = np.linspace(2.9, 4.1, 241)
    parts = [dict(choose_shapes(Render(), width)) for width in widths]
    tubes = np.array([part.get("tubes", 0.0) for part in parts])
    assert all(sum(part.values()) == pytest.approx(1) for part in parts)
    assert (np.diff(tubes) >= 0).all()
    assert (tubes[0], tubes[-1]) == (0, 1)
    assert np.diff(tubes).max() < 0.01


def test_projected_width_is_that_of_a_pinhole_camera() -> None:
    camera = CameraPath.of(
        Camera(position=(0, 0, 1), look_at=(0, 0, 0), field_of_view=2 * np.arctan(0.5)), Placement()
    ).at(0.0)
    width = projected_width(Render(size=(640, 480)), camera, 0.01, np.zeros(3))
    print(f"1 cm at 1 m, 1 m high picture of 480 px: {width:.3f} px")
    assert width == pytest.approx(4.8)


def test_fewer_strands_are_drawn_wider_so_that_coverage_stays() -> None:
    few, many = (drawn_width(Render(), count) for count in (25_000, 100_000))
    assert few == pytest.approx(2 * many)
    assert drawn_width(Render(), 1_000_000) == many
    assert drawn_width(Render(width=1e-3), 10) == 1e-3


def test_strands_that_stand_for_several_fibres_show_no_sides_of_one() -> None:
    assert one_fibre_each(Render(), 100_000)
    assert one_fibre_each(Render(), 60_000)
    assert not one_fibre_each(Render(), 40_000)
    assert not one_fibre_each(Render(), 50_000, of=100_000)
    assert one_fibre_each(Render(width=1e-4), 10)


def test_tips_thin_out_and_roots_do_not() -> None:
    profile = taper(Render(taper=0.2), 32)
    assert (profile[:25] == 1).all()
    assert (np.diff(profile[25:]) < 0).all()
    assert 0 < profile[-1] < 0.1


def test_ribbons_face_the_eye_and_have_the_width_they_were_given() -> None:
    rng = np.random.default_rng(1)
    points = np.cumsum(rng.normal(size=(5, 9, 3)), axis=1).astype(np.float32)
    eye = np.array([0.0, 0.0, 50.0])
    widths = np.full((5, 9), 0.3, np.float32)
    drawn = np.ones((5, 8), bool)
    drawn[2, 3:5] = False
    edges, triangles = ribbons(points, widths, eye, drawn)
    side = edges[:, :, 1] - edges[:, :, 0]
    print(f"widths {np.linalg.norm(side, axis=2).min():.6f} to {np.linalg.norm(side, axis=2).max():.6f}")
    assert np.allclose(np.linalg.norm(side, axis=2), 0.3, rtol=1e-5)
    assert np.abs(np.einsum("spk,spk->sp", side, points - eye)).max() < 1e-3
    assert triangles.shape == (2 * (5 * 8 - 2), 3)
    assert triangles.max() == edges[..., 0].size - 1


def test_subdivision_keeps_the_points_and_is_exact_on_a_parabola() -> None:
    t = np.linspace(-1, 1, 9)
    points = np.stack([t, t**2, 0 * t], axis=-1)[None].astype(np.float32)
    fine = smooth(points, 4)
    worst = np.abs(fine[0, 4:-4, 1] - fine[0, 4:-4, 0] ** 2).max()
    print(f"off the parabola by {worst:.1e}")
    assert np.array_equal(fine[:, ::4], points)
    assert worst < 1e-6


def test_encoding_and_decoding_lose_less_than_half_a_step() -> None:
    linear = np.geomspace(1e-3, BRIGHTEST, 200)
    back = DECODED[encode(linear)]
    step = 3 * np.cbrt(linear / BRIGHTEST) ** 2 * BRIGHTEST / 255
    assert (np.abs(back - linear) <= 0.51 * step + 1e-7).all()
    assert encode(np.array([100.0]))[0] == 255
