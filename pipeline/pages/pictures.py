"""Pictures inside a page, as data addresses; (H, W, 3) uint8 sRGB."""

import base64
import io
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Pixels = NDArray[np.uint8]


def data_address(pixels: Pixels, kind: Literal["exact", "small"] = "exact") -> str:
    """A picture as an address: "exact" keeps every pixel (WebP without loss), "small" is for thumbnails (JPEG)."""
    from PIL import Image

    buffer = io.BytesIO()
    image = Image.fromarray(pixels)
    if kind == "exact":
        image.save(buffer, "WEBP", lossless=True, quality=40, method=2, exact=True)
    else:
        image.save(buffer, "JPEG", quality=85)
    name = "webp" if kind == "exact" else "jpeg"
    return f"data:image/{name};base64,{base64.b64encode(buffer.getvalue()).decode()}"


def shrunk(pixels: Pixels, width: int) -> Pixels:
    """A smaller copy, `width` pixels wide at most."""
    from PIL import Image

    height, full = pixels.shape[:2]
    if full <= width:
        return pixels
    size = (width, max(round(width * height / full), 1))
    return np.asarray(Image.fromarray(pixels).resize(size, Image.Resampling.LANCZOS, reducing_gap=2.0))
