"""From samples to pixels: averages in linear light, tone curves, sRGB of 8 and 16 bits."""

import numpy as np
import pytest
from numpy.typing import NDArray

from pipeline import kernels
from pipeline.config.schema import Render
from pipeline.render.target import DECODED, encode
from pipeline.render.tone import (
    CURVES,
    SHOULDER,
    WHITE,
    average,
    before_roll_off,
    develop,
    filmic,
    roll_off,
    to_srgb,
)


def test_samples_are_averaged_in_linear_light() -> None:
    black_and_white = encode(np.indices((4, 4)).sum(axis=0)[..., None] % 2 * np.ones(3))
    pixels = develop(average(black_and_white, 2), 1.0)
    assert pixels.shape == (2, 2, 3)
    assert np.abs(pixels.astype(int) - round(255 * float(to_srgb(np.array(0.5))))).max() <= 1


def test_developing_follows_its_formula_in_numpy() -> None:
    samples = np.random.default_rng(3).integers(0, 256, (12, 18, 3), np.uint8)
    for per_side in (1, 2, 3):
        blocks = DECODED[samples].reshape(12 // per_side, per_side, 18 // per_side, per_side, 3)
        wanted = 255 * to_srgb(roll_off(np.minimum(1.25 * blocks.mean(axis=(1, 3), dtype=np.float64), WHITE)))
        error = np.abs(develop(average(samples, per_side), 1.25) - wanted).max()
        print(f"{per_side} x {per_side} samples: largest error {error:.3f} of a byte")
        assert error < 0.52


@pytest.mark.parametrize("tone", ["soft", "filmic"])
@pytest.mark.parametrize("bits", [8, 16])
def test_pixels_are_the_curve_of_linear_light_to_the_last_bit(tone: str, bits: int) -> None:
    curve = CURVES[tone]
    linear = np.concatenate([np.geomspace(1e-6, 20, 300_000), [0.0]]).astype(np.float32)
    pixels = develop(linear[:, None, None] * np.ones((1, 1, 3), np.float32), 0.7, tone, bits)
    exposed = np.minimum(0.7 * linear.astype(np.float64), curve.white)
    wanted = (2**bits - 1) * to_srgb(curve.shown(exposed))
    error = np.abs(pixels[:, 0, 0] - wanted).max()
    print(f"{tone}, {bits} bits: largest error {error:.3f} of a step, {len(np.unique(pixels))} values")
    assert pixels.dtype == (np.uint8 if bits == 8 else np.uint16)
    assert pixels[-1].max() == 0
    assert pixels.max() == 2**bits - 1
    assert error < (0.6 if bits == 8 else 0.9)


def test_the_filmic_curve_rises_from_black_to_white_and_can_be_taken_back() -> None:
    linear = np.linspace(0, CURVES["filmic"].white, 20_001)
    shown = filmic(linear)
    slope = np.diff(shown) / np.diff(linear)
    error = np.abs(CURVES["filmic"].linear(shown) - linear).max()
    print(
        f"slope {slope.min():.4f} to {slope.max():.2f}; white at {CURVES['filmic'].white:.3f}; back to {error:.1e}"
    )
    assert (slope > 0).all()
    assert shown[0] == 0
    assert shown[-1] == pytest.approx(1)
    assert filmic(np.array(1.0)) == pytest.approx(2.54 / 3.16)
    assert error < 1e-9


def test_a_stop_doubles_the_light() -> None:
    plain, brighter = Render(), Render(stops=1.0)
    assert brighter.gain == 2 * plain.gain
    assert Render(stops=-2.0, exposure=1.0).gain == 0.25


def test_highlights_roll_off_smoothly_and_reversibly() -> None:
    linear = np.linspace(0, 2, 2001)
    shown = roll_off(linear)
    slope = np.diff(shown) / np.diff(linear)
    error = float(np.abs(roll_off(before_roll_off(shown)) - shown).max())
    print(
        f"slope {slope.min():.3f} .. {slope.max():.3f}, largest step of it {np.abs(np.diff(slope)).max():.1e}; back {error:.1e}"
    )
    assert np.array_equal(shown[linear < SHOULDER], linear[linear < SHOULDER])
    assert (slope >= -1e-12).all()
    assert np.abs(np.diff(slope)).max() < 2e-3
    assert shown[linear >= WHITE] == pytest.approx(1)
    assert error < 1e-12


@pytest.mark.parametrize(
    "picture", [np.arange(30, dtype=np.uint8).reshape(5, 2, 3), np.eye(4, 3, dtype=np.float32)]
)
def test_turning_a_picture_over_reverses_its_rows(picture: NDArray[np.uint8] | NDArray[np.float32]) -> None:
    turned = picture.copy()
    kernels.turn_over(turned)
    assert np.array_equal(turned, picture[::-1])
