"""Image files as the library opens them, with no more room made than their bytes can stand for."""

import io
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from PIL.Image import Image

_PIXELS, _PIXELS_A_BYTE = 1 << 16, 1024  # deflate makes 1032 bytes of one


def opened(path: Path) -> "Image":
    """Open a file that the caller closes. What is raised here or while it is decoded may be anything but MemoryError.

    All of it is read first: of a file the library makes room for as many bytes as its chunks say that they have.
    """
    from PIL import Image

    data = path.read_bytes()
    image = Image.open(io.BytesIO(data))
    if image.width * image.height > _PIXELS + _PIXELS_A_BYTE * len(data):
        raise ValueError(f"{image.width} x {image.height} pixels in {len(data)} bytes")
    return image
