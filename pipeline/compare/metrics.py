"""Figures of how far two pictures of hair lie apart.

FLIP is the perceptual difference of Andersson et al., "FLIP: A Difference Evaluator for Alternating
Images" (2020); SSIM the structural similarity of Wang et al., "Image Quality Assessment: From Error
Visibility to Structural Similarity" (2004). Neither alone sees that strands were dropped, and strands
that moved by a pixel upset both: hence the blurred difference, which follows tone and mass.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.compare.pictures import Picture, encoded, finite
from pipeline.errors import InputError

BLUR = 9  # [px] side of the box that averages strands to tone


@dataclass(frozen=True)
class Metrics:
    """What `measure` found; all zero (SSIM one) for equal pictures."""

    changed: float  # fraction of pixels that differ at all
    flip: float  # mean FLIP, 0..1
    ssim: float  # mean structural similarity, 1 is equal
    blurred: float  # mean absolute difference after a 9 x 9 box, 0..1
    luminance: float  # relative change of the mean luminance

    @property
    def identical(self) -> bool:
        return self.changed == 0


def measure(reference: Picture, picture: Picture) -> Metrics:
    """Compare two pictures (H, W, 3) of one size, both uint8 or uint16 sRGB, or both float32 linear.

    Linear ones are compared by FLIP for high dynamic range and, for the rest, as a screen shows them. Raises
    InputError when sizes or types differ or the optional packages of the extra `compare` are missing.
    """
    if reference.shape != picture.shape:
        raise InputError(f"pictures differ in size: {_size(reference)} and {_size(picture)}")
    if reference.dtype != picture.dtype:
        raise InputError(
            f"pictures differ in kind: {reference.dtype} and {picture.dtype} a channel; linear ones are float32"
        )
    changed = float(_differs(reference, picture).mean())
    if changed == 0:
        return Metrics(changed=0.0, flip=0.0, ssim=1.0, blurred=0.0, luminance=0.0)
    a, b = encoded(reference), encoded(picture)
    return Metrics(
        changed=changed,
        flip=float(flip_map(reference, picture).mean()),
        ssim=_ssim(a, b),
        blurred=float(np.abs(_blur(a) - _blur(b)).mean()),
        luminance=float(_luminance(b).mean() / max(_luminance(a).mean(), 1e-6) - 1),
    )


def flip_map(reference: Picture, picture: Picture) -> NDArray[np.float32]:
    """FLIP of each pixel, (H, W) float32 in 0..1, as seen from 0.7 m on a 4K screen.

    Linear pictures: the largest over all exposures (Andersson et al., "Visualizing Errors in Rendered High Dynamic
    Range Images", 2021).
    """
    try:
        import flip_evaluator
    except ImportError as error:
        raise _missing("flip-evaluator") from error
    linear = reference.dtype == np.float32
    pair = [np.ascontiguousarray(finite(each) if linear else encoded(each)) for each in (reference, picture)]
    errors, _, _ = flip_evaluator.evaluate(
        *pair, "HDR" if linear else "LDR", applyMagma=False, computeMeanError=False
    )
    return np.asarray(errors, np.float32).reshape(reference.shape[:2])


def _differs(reference: Picture, picture: Picture) -> NDArray[np.bool_]:
    """Pixels that differ, (H, W) bool; what is not a number equals itself."""
    both = np.isnan(reference) & np.isnan(picture)
    return np.asarray(((reference != picture) & ~both).any(axis=-1))


def _ssim(a: NDArray[np.float32], b: NDArray[np.float32]) -> float:
    try:
        from skimage.metrics import structural_similarity
    except ImportError as error:
        raise _missing("scikit-image") from error
    window = min(7, *(side - 1 + side % 2 for side in a.shape[:2]))
    return float(structural_similarity(a, b, channel_axis=-1, data_range=1.0, win_size=window))


def _blur(image: NDArray[np.float32]) -> NDArray[np.float32]:
    from scipy.ndimage import uniform_filter

    return np.asarray(uniform_filter(image, (BLUR, BLUR, 1), mode="nearest"), np.float32)


def _luminance(image: NDArray[np.float32]) -> NDArray[np.float32]:
    return image @ np.array([0.2126, 0.7152, 0.0722], np.float32)


def _size(picture: Picture) -> str:
    return f"{picture.shape[1]}x{picture.shape[0]}"


def _missing(package: str) -> InputError:
    return InputError(
        f'comparing pictures needs the package {package}; install it by: pip install "ringlet[compare]"'
    )
