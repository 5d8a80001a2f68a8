"""Pictures in memory: (H, W, 3), uint8 or uint16 sRGB from PNG and the like, float32 linear from OpenEXR."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.compare.deep import load_deep
from pipeline.compare.opened import opened
from pipeline.errors import InputError

Picture = NDArray[np.uint8] | NDArray[np.uint16] | NDArray[np.float32]
Display = NDArray[np.uint8]

ENDINGS = (".png", ".exr")  # what folders are searched for
FINGERPRINT = "ringlet.fingerprint"
_BEHIND = (128, 128, 128)  # sRGB behind what is transparent


def load_picture(path: Path) -> Picture:
    """Read a picture; what is transparent lies on grey. Raises InputError when it cannot be read.

    OpenEXR needs the extra `exr`; of its channels R, G and B are read, or Y.
    """
    from PIL import Image

    try:
        if path.suffix.lower() == ".exr":
            return _load_exr(path)
        deep = load_deep(path)
        if deep is not None:
            return deep
        with opened(path) as image:
            if not image.has_transparency_data:
                return np.asarray(image.convert("RGB"))
            over = image.convert("RGBA")
            return np.asarray(
                Image.alpha_composite(Image.new("RGBA", over.size, _BEHIND), over).convert("RGB")
            )
    except (InputError, MemoryError):
        raise
    except Exception as error:
        raise InputError(f"{path}: not a readable picture ({error})") from error


def renderer_of(path: Path) -> str | None:
    """The fingerprint that the renderer wrote into a picture: what pixels depend on besides the config; None without."""
    if path.suffix.lower() == ".exr":
        found = _exr_file(path).header().get(FINGERPRINT)
        return None if found is None else str(found)
    try:
        with opened(path) as image:
            found = image.info.get(FINGERPRINT)
    except Exception:  # noqa: BLE001, whatever the library raises
        return None
    return None if found is None else str(found)


def displayed(picture: Picture) -> Display:
    """The picture as a screen shows it: linear values clipped to 0..1 and encoded as sRGB (IEC 61966-2-1)."""
    if picture.dtype == np.uint8:
        return np.asarray(picture, np.uint8)
    return np.asarray(encoded(picture) * 255 + 0.5, np.uint8)


def encoded(picture: Picture) -> NDArray[np.float32]:
    """Values in 0..1 as sRGB encodes them, (H, W, 3) float32; what is not a number is black."""
    if picture.dtype != np.float32:
        largest = np.float32(65535 if picture.dtype == np.uint16 else 255)
        return np.asarray(np.ascontiguousarray(picture, np.float32) / largest, np.float32)
    linear = np.clip(finite(picture), 0, 1)
    curve = 1.055 * np.power(np.maximum(linear, 0.0031308), 1 / 2.4) - 0.055
    return np.asarray(np.where(linear <= 0.0031308, 12.92 * linear, curve), np.float32)


def finite(picture: Picture) -> NDArray[np.float32]:
    """Linear values that are numbers and not negative."""
    return np.maximum(np.nan_to_num(np.asarray(picture, np.float32), posinf=65504.0), 0)


def _load_exr(path: Path) -> NDArray[np.float32]:
    channels = _exr_file(path).channels()
    names = ("R", "G", "B") if {"R", "G", "B"} <= channels.keys() else ("Y", "Y", "Y")
    if names[0] not in channels:
        raise InputError(
            f"{path}: no colour among its channels {', '.join(sorted(channels))}; expected R, G and B"
        )
    return np.stack([np.asarray(channels[name].pixels, np.float32) for name in names], axis=-1)


def _exr_file(path: Path) -> Any:
    try:
        import OpenEXR
    except ImportError as error:
        raise InputError(
            f'{path}: reading it needs OpenEXR; install it by: pip install "ringlet[exr]"'
        ) from error
    if not path.is_file():
        raise InputError(f"{path}: no such file or folder")
    try:
        return OpenEXR.File(str(path), separate_channels=True)
    except (RuntimeError, ValueError, OSError) as error:
        raise InputError(f"{path}: not a readable picture ({error})") from error
