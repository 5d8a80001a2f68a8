"""How alike two linear pictures are where hair covers whole pixels.

Colour: ratio of the means. Place of light and shadow: correlation of means of 17 x 17 pixels. Fibre detail: contrast,
the root mean square difference between a pixel and the mean around it over the mean; and the 99th percentile over the
mean, both of luminance. Open curls cover hardly any pixel wholly: where it is known how much of each pixel hair covers, means
of 17 x 17 pixels are the light of all hair in them by what it covers.
"""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter

_F32 = NDArray[np.float32]
_F64 = NDArray[np.float64]

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
_REGION = 17  # [px]
_MOST = 0.35  # of a region that hair must cover


@dataclass(frozen=True)
class Likeness:
    """Of a picture, and of the path-traced one."""

    ratio: tuple[float, float, float]
    """Mean of ours by the reference's: R, G, B."""
    correlation: float
    """Of means of 17 x 17 pixels."""
    contrast: tuple[float, float]
    """Of ours and of the reference."""
    highlights: tuple[float, float]
    """99th percentile over the mean, of ours and of the reference."""


def compare(
    ours: _F32,
    reference: _F32,
    mask: NDArray[np.bool_],
    region: int = _REGION,
    covered: tuple[_F32, _F32] | None = None,
) -> Likeness:
    """Compare pictures (H, W, 3) where the mask (H, W) is set; hair over black has `covered` (H, W) of each of both."""
    means = [picture[mask].mean(axis=0, dtype=np.float64) for picture in (ours, reference)]
    light = [picture.astype(np.float64) @ LUMINANCE for picture in (ours, reference)]
    near = [_around(each, mask, region) for each in light]
    regions = (
        near if covered is None else [_around(*each, region) for each in zip(light, covered, strict=True)]
    )
    weight = uniform_filter((mask if covered is None else covered[0]).astype(np.float64), region)
    well = (mask if covered is None else covered[0] > 0) & (weight > _MOST)
    r, g, b = (float(x) for x in means[0] / means[1])
    return Likeness(
        (r, g, b),
        float(np.corrcoef(regions[0][well], regions[1][well])[0, 1]) if well.sum() > 2 else np.nan,
        _pair(_contrast(each, around, mask) for each, around in zip(light, near, strict=True)),
        _pair(float(np.percentile(each[mask], 99) / each[mask].mean()) for each in light),
    )


def _around(light: _F64, covered: NDArray[np.bool_] | _F32, region: int) -> _F64:
    """Mean of light (H, W) around each pixel, (H, W), of what is covered (H, W): whole pixels, or parts of them over black."""
    shown = light * covered if covered.dtype == np.bool_ else light
    within = uniform_filter(covered.astype(np.float64), region)
    mean: _F64 = uniform_filter(shown, region) / np.maximum(within, 1e-9)
    return mean


def _pair(values: Iterable[float]) -> tuple[float, float]:
    a, b = values
    return a, b


def _contrast(light: _F64, near: _F64, mask: NDArray[np.bool_]) -> float:
    return float(np.sqrt(np.mean((light - near)[mask] ** 2)) / light[mask].mean())
