"""From samples in the framebuffer to linear pixels, and from those to sRGB: decode, average, expose, curve, encode.

Tone curves take exposed linear light x to what is shown, 0 to 1. "soft" is x itself up to 0.6, then the parabola that
ends with slope 0 at 1.4: lit skin keeps its hue. "filmic" is x (2.51 x + 0.03) / (x (2.43 x + 0.59) + 0.14), with a
film's dark toe and long shoulder, and reaches 1 at 7.24: Narkowicz, "ACES Filmic Tone Mapping Curve" (2016).
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline import kernels
from pipeline.render.target import DECODED

Values = NDArray[np.float64]
Pixels = NDArray[np.uint8] | NDArray[np.uint16]

SHOULDER, WHITE = 0.6, 1.4
"""Linear values where "soft" begins to compress highlights, and that become 1."""
_STEPS = {8: 1 << 17, 16: 1 << 22}
"""Of the tables: small enough that a step in the dark is less than one of the pixels."""


@dataclass(frozen=True)
class Curve:
    """A tone curve, and back: from what is shown to linear values."""

    shown: Callable[[Values], Values]
    linear: Callable[[Values], Values]
    white: float
    """The linear value that becomes 1."""


def average(samples: NDArray[np.uint8], per_side: int) -> NDArray[np.float32]:
    """Linear pixels (H, W, 3) of encoded samples (H n, W n, 3), averaged over n x n in linear light."""
    return kernels.average(np.ascontiguousarray(samples), per_side, DECODED)


def develop(linear: NDArray[np.float32], exposure: float, tone: str = "soft", bits: int = 8) -> Pixels:
    """Pixels (H, W, 3) sRGB, of 8 or 16 bits, of linear ones, through one of `CURVES`."""
    table = _table(tone, bits)
    return kernels.develop(
        np.ascontiguousarray(linear), table, exposure * (len(table) - 1) / CURVES[tone].white
    )


def roll_off(linear: Values) -> Values:
    """The curve "soft": compresses 0.6 .. 1.4 to 0.6 .. 1 by a parabola that starts with slope 1 and ends with slope 0."""
    above = np.clip(linear - SHOULDER, 0, WHITE - SHOULDER)
    return np.where(linear < SHOULDER, linear, SHOULDER + above - above**2 / (2 * (WHITE - SHOULDER)))


def before_roll_off(shown: Values) -> Values:
    """The linear values that `roll_off` turns into these; `WHITE` for 1 and beyond."""
    width = WHITE - SHOULDER
    above = width - np.sqrt(np.maximum(width**2 - 2 * width * (shown - SHOULDER), 0))
    return np.where(shown < SHOULDER, shown, SHOULDER + above)


def filmic(linear: Values) -> Values:
    """The curve "filmic"."""
    return np.minimum(linear * (2.51 * linear + 0.03) / (linear * (2.43 * linear + 0.59) + 0.14), 1.0)


def before_filmic(shown: Values) -> Values:
    """The linear values that `filmic` turns into these: the root of a quadratic; that of 1 beyond."""
    y = np.minimum(shown, 1.0)
    a, b, c = 2.51 - 2.43 * y, 0.03 - 0.59 * y, -0.14 * y
    return np.asarray((np.sqrt(b * b - 4 * a * c) - b) / (2 * a))


CURVES = {
    "soft": Curve(roll_off, before_roll_off, WHITE),
    "filmic": Curve(filmic, before_filmic, float(before_filmic(np.array(1.0)))),
}


def to_srgb(linear: Values) -> Values:
    """Encode linear values in 0..1 (IEC 61966-2-1)."""
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


@lru_cache(4)
def _table(tone: str, bits: int) -> NDArray[Any]:
    curve = CURVES[tone]
    middles = (np.arange(_STEPS[bits]) + 0.5) * (curve.white / (_STEPS[bits] - 1))
    shown = to_srgb(curve.shown(np.minimum(middles, curve.white)))
    codes: NDArray[Any] = (shown * (2**bits - 1) + 0.5).astype(np.uint8 if bits == 8 else np.uint16)
    return codes
