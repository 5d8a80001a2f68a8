"""OpenEXR files of named layers, which say in their header what they were made from, with a sum over the whole file.

The header is a list of attributes, each a name, a type and a size before its value, and ends with an empty name:
"OpenEXR File Layout" (Academy Software Foundation). The sum stands in an attribute of its own and counts as zeros there,
so that a file is verified, and its key read, without the library that writes it (extra `exr`).
"""

import hashlib
import struct
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import InputError

_MAGIC = b"\x76\x2f\x31\x01"
_SUM, _DIGITS = "ringlet.sum", 32
_NO_SUM = "0" * _DIGITS


def library() -> Any:
    """The module OpenEXR. Raises InputError where it is not installed."""
    try:
        import OpenEXR
    except ImportError:
        raise InputError(
            'render.exr needs OpenEXR; pip install "ringlet[exr]", or set render.exr = false'
        ) from None
    return OpenEXR


def write(path: Path, layers: Mapping[str, NDArray[Any]], texts: Mapping[str, str]) -> None:
    """Write layers (H, W), float16, float32 or uint32, by their channels' names. Raises InputError without OpenEXR."""
    exr = library()
    header = {
        "compression": exr.ZIP_COMPRESSION,
        "type": exr.scanlineimage,
        _SUM: _NO_SUM,
        **{name: texts[name] for name in sorted(texts)},
    }
    exr.File(header, {name: np.ascontiguousarray(layer) for name, layer in layers.items()}).write(str(path))
    data = bytearray(path.read_bytes())
    at = _attributes(data)[_SUM][0]
    data[at : at + _DIGITS] = _digest(bytes(data)).encode()
    path.write_bytes(data)


def texts(data: bytes) -> dict[str, str]:
    """The texts of a file's header after checking every byte of it; raises ValueError, LookupError or struct.error."""
    found = _attributes(data)
    at, size = found[_SUM]
    blank = data[:at] + _NO_SUM.encode() + data[at + size :]
    if data[at : at + size].decode("latin-1") != _digest(blank):
        raise ValueError("wrong sum")
    return {name: data[at : at + size].decode() for name, (at, size) in found.items() if "." in name}


def _digest(data: bytes) -> str:
    return hashlib.blake2b(data, digest_size=_DIGITS // 2).hexdigest()


def _attributes(data: bytes | bytearray) -> dict[str, tuple[int, int]]:
    """Where the values of the attributes are, and their sizes."""
    if not data.startswith(_MAGIC):
        raise ValueError("not an OpenEXR file")
    found, at = {}, 8
    while data[at]:
        name_end = data.index(0, at)
        kind_end = data.index(0, name_end + 1)
        (size,) = struct.unpack_from("<i", data, kind_end + 1)
        value = kind_end + 5
        if size < 0:
            raise ValueError("an attribute of negative size")
        found[data[at:name_end].decode("latin-1")] = (value, size)
        at = value + size
    return found
