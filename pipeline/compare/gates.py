"""The two gates of the image regression.

Gate 1: pictures of one renderer fingerprint (GL renderer, library versions, kernels, processor) are
equal to the last pixel. Gate 2: between fingerprints each figure stays within its limit. The default limits are for
strands drawn by coverage, which no OpenGL takes part in; strands that OpenGL draws may need wider ones, which let
losses of strands through: golden figures, such as counts and tips, stand beside gate 2.
"""

from dataclasses import dataclass

from pipeline.compare.metrics import Metrics


@dataclass(frozen=True)
class Limits:
    """What gate 2 accepts. Measured in tests/images/test_gates.py: another renderer stays below, changed hair does not."""

    flip: float = 0.004
    ssim: float = 0.999
    blurred: float = 0.0002
    luminance: float = 0.002


def judge(metrics: Metrics, exact: bool, limits: Limits | None = None) -> list[str]:
    """Why the pictures differ too much, one line a reason; empty when they pass. `exact` is gate 1."""
    if exact:
        return [] if metrics.identical else [f"{metrics.changed:.2%} of the pixels differ"]
    return [
        f"{name} {value:.5f} is beyond {limit:g}"
        for name, value, limit, passed in figures(metrics, limits or Limits())
        if not passed
    ]


def figures(metrics: Metrics, limits: Limits) -> list[tuple[str, float, float, bool]]:
    """What gate 2 looks at: name, value, limit, and whether it is kept. What is not a number is not."""
    return [
        ("FLIP", metrics.flip, limits.flip, metrics.flip <= limits.flip),
        ("SSIM", metrics.ssim, limits.ssim, metrics.ssim >= limits.ssim),
        ("blurred difference", metrics.blurred, limits.blurred, metrics.blurred <= limits.blurred),
        ("luminance", metrics.luminance, limits.luminance, abs(metrics.luminance) <= limits.luminance),
    ]
