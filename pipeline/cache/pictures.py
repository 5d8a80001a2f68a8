"""Frames: PNG and EXR files that appear whole and that say in their headers what they were made from."""

import io
import json
import struct
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.cache import exr, png
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
    data = png.encode(pixels, _texts(key, provenance, texts))
    with replacing(path) as temporary:
        temporary.write_bytes(data)


def write_layers(
    path: Path, layers: Mapping[str, NDArray[Any]], key: str, provenance: dict[str, Any], **texts: str
) -> None:
    """Write layers (H, W), float16, float32 or uint32, as an EXR file by their channels' names, whole or not at all.

    String attributes: as the text chunks of `write_picture`. Raises InputError when OpenEXR is not installed or the
    disk is full.
    """
    with replacing(path) as temporary:
        exr.write(temporary, layers, _texts(key, provenance, texts))


def picture_record(path: Path) -> tuple[str, dict[str, Any]]:
    """Return key and provenance of a frame, PNG or EXR, after checking every byte of it; raises Missing or Damaged."""
    try:
        data = path.read_bytes()
        info = exr.texts(data) if path.suffix == ".exr" else _png_texts(data)
        return info["ringlet.key"], json.loads(info["ringlet.provenance"])
    except FileNotFoundError:
        raise Missing(path) from None
    except (OSError, SyntaxError, LookupError, ValueError, TypeError, struct.error) as error:
        raise Damaged(path, "not a frame of ringlet, or broken") from error


def _png_texts(data: bytes) -> dict[str, Any]:
    from PIL import Image

    png.verify(data)
    with Image.open(io.BytesIO(data), formats=["PNG"]) as picture:
        return {str(name): value for name, value in picture.info.items()}


def _texts(key: str, provenance: dict[str, Any], texts: dict[str, str]) -> dict[str, str]:
    texts = texts | {"key": key, "provenance": json.dumps(provenance, sort_keys=True)}
    return {f"ringlet.{name}": text for name, text in texts.items()}
