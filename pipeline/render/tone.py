"""From samples in the framebuffer to pixels: decode, average, expose, sRGB."""

import numpy as np
from numpy.typing import NDArray

from pipeline.render.target import DECODED

_STEPS = 1 << 14


def develop(samples: NDArray[np.uint8], per_side: int, exposure: float) -> NDArray[np.uint8]:
    """Pixels (H, W, 3) sRGB of encoded samples (H n, W n, 3), averaged over n x n in linear light."""
    linear = average(DECODED[samples], per_side)
    index = np.minimum(linear * np.float32(exposure * (_STEPS - 1)), _STEPS - 1).astype(np.int32)
    return np.asarray(_SRGB[index])


def average(linear: NDArray[np.float32], per_side: int) -> NDArray[np.float32]:
    """Mean over blocks of n x n of (H n, W n, 3)."""
    if per_side == 1:
        return linear
    rows = np.add.reduce([linear[i::per_side] for i in range(per_side)])
    blocks = np.add.reduce([rows[:, i::per_side] for i in range(per_side)])
    return np.asarray(blocks / np.float32(per_side**2), np.float32)


def to_srgb(linear: NDArray[np.float64]) -> NDArray[np.float64]:
    """Encode linear values in 0..1 (IEC 61966-2-1)."""
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


_SRGB = (to_srgb(np.arange(_STEPS) / (_STEPS - 1)) * 255 + 0.5).astype(np.uint8)
