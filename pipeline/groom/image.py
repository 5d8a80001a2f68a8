"""Painted images, looked up by texture coordinates."""

from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.compare.opened import opened
from pipeline.errors import InputError

Values = NDArray[np.float64]
Points = NDArray[np.floating[Any]]


@lru_cache(maxsize=16)
def brightness(path: str) -> Values:
    """Brightness (H, W) of an image, 0 to 1. Raises InputError for a file that is none."""
    try:
        with opened(Path(path)) as image:
            deep = image.mode.startswith("I")
            values = np.asarray(image if deep else image.convert("L"), np.float64)
    except MemoryError:
        raise
    except Exception as error:  # noqa: BLE001, whatever the library raises
        raise InputError(f"{path}: cannot be read as an image ({error})") from None
    return values / (65535.0 if deep else 255.0)


def sampled(image: Values, uv: Points) -> Values:
    """Bilinear samples (N,) at texture coordinates (N, 2): u to the right, v upwards from the lower left corner."""
    high, wide = image.shape
    x = np.clip(uv[:, 0] * wide - 0.5, 0, wide - 1)
    y = np.clip((1 - uv[:, 1]) * high - 0.5, 0, high - 1)
    i, j = (np.minimum(a.astype(np.int64), max(n - 2, 0)) for a, n in ((y, high), (x, wide)))
    a, b = y - i, x - j
    lower, right = np.minimum(i + 1, high - 1), np.minimum(j + 1, wide - 1)
    top = image[i, j] * (1 - b) + image[i, right] * b
    return np.asarray(top * (1 - a) + (image[lower, j] * (1 - b) + image[lower, right] * b) * a)
