"""Frames: PNG files that appear whole and that say in a text chunk, "ringlet", what they were made from."""

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.cache.atomic import replacing
from pipeline.cache.columns import Damaged
from pipeline.cache.store import Missing

_CHUNK = "ringlet"
_DEFLATE = 3  # half the time of the default for a few per cent more bytes


def write_picture(path: Path, pixels: NDArray[np.uint8], key: str, provenance: dict[str, Any]) -> None:
    """Write sRGB pixels (H, W, 3) uint8 with the key and provenance of the frame, whole or not at all."""
    from PIL import Image, PngImagePlugin

    text = PngImagePlugin.PngInfo()
    text.add_text(_CHUNK, json.dumps({"key": key, "provenance": provenance}, sort_keys=True))
    with replacing(path) as temporary:
        Image.fromarray(pixels).save(temporary, "PNG", pnginfo=text, compress_level=_DEFLATE)


def picture_record(path: Path) -> tuple[str, dict[str, Any]]:
    """Return key and provenance of a frame after checking every byte of it; raises Missing or Damaged."""
    from PIL import Image

    if not path.exists():
        raise Missing(path)
    try:
        with Image.open(path, formats=["PNG"]) as picture:
            record = json.loads(picture.info[_CHUNK])
            picture.verify()
        return record["key"], record["provenance"]
    except (OSError, SyntaxError, LookupError, ValueError, TypeError, struct.error) as error:
        raise Damaged(path, "not a frame of ringlet, or broken") from error
