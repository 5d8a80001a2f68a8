"""Frames: PNG files that appear whole and that say in their text chunks what they were made from."""

import io
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.cache import png
from pipeline.cache.atomic import replacing
from pipeline.cache.columns import Damaged
from pipeline.cache.store import Missing


def write_picture(
    path: Path,
    pixels: NDArray[np.uint8] | NDArray[np.uint16],
    key: str,
    provenance: dict[str, Any],
    **texts: str,
) -> None:
    """Write sRGB pixels (H, W, 3), 8 or 16 bits a channel, whole or not at all.

    Text chunks: ringlet.key, ringlet.provenance (JSON) and ringlet.<name> for each of `texts`.
    Raises InputError when the disk is full.
    """
    texts |= {"key": key, "provenance": json.dumps(provenance, sort_keys=True)}
    data = png.encode(pixels, {f"ringlet.{name}": text for name, text in texts.items()})
    with replacing(path) as temporary:
        temporary.write_bytes(data)


def picture_record(path: Path) -> tuple[str, dict[str, Any]]:
    """Return key and provenance of a frame after checking every byte of it; raises Missing or Damaged."""
    from PIL import Image

    try:
        data = path.read_bytes()
        png.verify(data)
        with Image.open(io.BytesIO(data), formats=["PNG"]) as picture:
            info = picture.info
        return info["ringlet.key"], json.loads(info["ringlet.provenance"])
    except FileNotFoundError:
        raise Missing(path) from None
    except (OSError, SyntaxError, LookupError, ValueError, TypeError, struct.error) as error:
        raise Damaged(path, "not a frame of ringlet, or broken") from error
