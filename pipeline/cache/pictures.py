"""Frames: PNG files that appear whole and that say in their text chunks what they were made from."""

import io
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
from isal import isal_zlib
from numpy.typing import NDArray

from pipeline.cache.atomic import replacing
from pipeline.cache.columns import Damaged
from pipeline.cache.store import Missing

_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_DEFLATE = 3  # half the time of the default for a few per cent more bytes


def write_picture(
    path: Path, pixels: NDArray[np.uint8], key: str, provenance: dict[str, Any], **texts: str
) -> None:
    """Write sRGB pixels (H, W, 3) uint8, whole or not at all.

    Text chunks: ringlet.key, ringlet.provenance (JSON) and ringlet.<name> for each of `texts`.
    Raises InputError when the disk is full.
    """
    from PIL import Image, PngImagePlugin

    texts |= {"key": key, "provenance": json.dumps(provenance, sort_keys=True)}
    info = PngImagePlugin.PngInfo()
    for name, text in sorted(texts.items()):
        info.add_text(f"ringlet.{name}", text)
    with replacing(path) as temporary:
        Image.fromarray(pixels).save(temporary, "PNG", pnginfo=info, compress_level=_DEFLATE)


def picture_record(path: Path) -> tuple[str, dict[str, Any]]:
    """Return key and provenance of a frame after checking every byte of it; raises Missing or Damaged."""
    from PIL import Image

    try:
        data = path.read_bytes()
        _verify(data)
        with Image.open(io.BytesIO(data), formats=["PNG"]) as picture:
            info = picture.info
        return info["ringlet.key"], json.loads(info["ringlet.provenance"])
    except FileNotFoundError:
        raise Missing(path) from None
    except (OSError, SyntaxError, LookupError, ValueError, TypeError, struct.error) as error:
        raise Damaged(path, "not a frame of ringlet, or broken") from error


def _verify(data: bytes) -> None:
    """Check the sum of every chunk, which Pillow does not do for all of them."""
    if not data.startswith(_SIGNATURE):
        raise ValueError("not a PNG")
    at, kind = len(_SIGNATURE), b""
    while at < len(data):
        (length,) = struct.unpack_from(">I", data, at)
        kind = data[at + 4 : at + 8]
        (checksum,) = struct.unpack_from(">I", data, at + 8 + length)
        if isal_zlib.crc32(data[at + 4 : at + 8 + length]) != checksum:
            raise ValueError(f"wrong checksum of chunk {kind!r}")
        at += 12 + length
    if kind != b"IEND":
        raise ValueError("ends too early")
