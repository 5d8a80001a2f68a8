"""The two gates of the image regression.

Gate 1: pictures of one renderer fingerprint (GL renderer, library versions, kernels, processor) are
equal to the last pixel. Gate 2: between fingerprints each figure stays within its limit. No limit tells
another rasteriser from a loss of 5 % of the strands, so data tests on the guides stand beside gate 2.
"""

from dataclasses import dataclass

from pipeline.compare.metrics import Metrics


@dataclass(frozen=True)
class Limits:
    """What gate 2 accepts; the defaults pass another Mesa version and fail a curl changed by 3 %."""

    flip: float = 0.065
    ssim: float = 0.80
    blurred: float = 0.012
    luminance: float = 0.02


def judge(metrics: Metrics, same_fingerprint: bool, limits: Limits | None = None) -> list[str]:
    """Why the pictures differ too much, one line a reason; empty when they pass."""
    if same_fingerprint:
        if metrics.identical:
            return []
        return [f"{metrics.changed:.2%} of the pixels differ under the same renderer fingerprint"]
    limits = limits or Limits()
    found = [
        ("FLIP", metrics.flip, limits.flip, metrics.flip <= limits.flip),
        ("SSIM", metrics.ssim, limits.ssim, metrics.ssim >= limits.ssim),
        ("blurred difference", metrics.blurred, limits.blurred, metrics.blurred <= limits.blurred),
        ("luminance", metrics.luminance, limits.luminance, abs(metrics.luminance) <= limits.luminance),
    ]
    return [f"{name} {value:.4f} is beyond {limit}" for name, value, limit, passed in found if not passed]
