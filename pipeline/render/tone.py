"""From samples in the framebuffer to linear pixels, and from those to sRGB: decode, average, expose, encode."""

import numpy as np
from numpy.typing import NDArray

from pipeline import kernels
from pipeline.render.target import DECODED

SHOULDER, WHITE = 0.6, 1.4
"""Linear values where compression of highlights begins, and that become 1."""
_STEPS = 1 << 15


def average(samples: NDArray[np.uint8], per_side: int) -> NDArray[np.float32]:
    """Linear pixels (H, W, 3) of encoded samples (H n, W n, 3), averaged over n x n in linear light."""
    return kernels.average(np.ascontiguousarray(samples), per_side, DECODED)


def develop(linear: NDArray[np.float32], exposure: float) -> NDArray[np.uint8]:
    """Pixels (H, W, 3) sRGB of linear ones. Highlights roll off instead of clipping, see `roll_off`."""
    return kernels.develop(np.ascontiguousarray(linear), _SRGB, exposure * (_STEPS - 1) / WHITE)


def roll_off(linear: NDArray[np.float64]) -> NDArray[np.float64]:
    """Compress 0.6 .. 1.4 to 0.6 .. 1 by a parabola that starts with slope 1 and ends with slope 0: lit skin keeps its hue."""
    above = np.clip(linear - SHOULDER, 0, WHITE - SHOULDER)
    return np.where(linear < SHOULDER, linear, SHOULDER + above - above**2 / (2 * (WHITE - SHOULDER)))


def before_roll_off(shown: NDArray[np.float64]) -> NDArray[np.float64]:
    """The linear values that `roll_off` turns into these; `WHITE` for 1 and beyond."""
    width = WHITE - SHOULDER
    above = width - np.sqrt(np.maximum(width**2 - 2 * width * (shown - SHOULDER), 0))
    return np.where(shown < SHOULDER, shown, SHOULDER + above)


def to_srgb(linear: NDArray[np.float64]) -> NDArray[np.float64]:
    """Encode linear values in 0..1 (IEC 61966-2-1)."""
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


_SRGB = (to_srgb(roll_off(np.linspace(0, WHITE, _STEPS))) * 255 + 0.5).astype(np.uint8)
