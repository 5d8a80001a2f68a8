"""Which other layers an OpenUSD file names: a change of those changes what the file says.

Read without the library, which is not always there and may crash on a damaged file. In text every path stands between
@ signs, or between three of them. A binary file ("crate") keeps all of its words in one section TOKENS: two u64 numbers
of words and bytes, a u64 size, and the words, zero-terminated, as one LZ4 block after a byte 0. Words that are the path
of a layer beside the file are taken for one: a groom that is made once too often does no harm.
Sources: Pixar, "crateFile.h" of OpenUSD; Collet, "LZ4 block format description" (2022).
"""

import re
import struct
from functools import lru_cache
from pathlib import Path

ENDINGS = (".usd", ".usda", ".usdc")

_TEXT, _CRATE = b"#usda", b"PXR-USDC"
_MOST_LAYERS = 1000
_MOST_WORDS = 1 << 28  # [bytes]
_NAMED = re.compile(rb"@@@(.+?)@@@|@([^@\r\n]+)@")


def layers_of(path: Path) -> tuple[Path, ...]:
    """The layers that a file names, and those that these name, without itself, in the order of their names."""
    if path.suffix.lower() not in ENDINGS or not path.is_file():
        return ()
    found, left = {path.resolve()}, [path]
    while left and len(found) < _MOST_LAYERS:
        layer = left.pop()
        status = layer.stat()
        for named in _named_in(layer, status.st_size, status.st_mtime_ns):
            if named not in found:
                found.add(named)
                left.append(named)
    return tuple(sorted(found - {path.resolve()}))


@lru_cache(maxsize=256)
def _named_in(path: Path, size: int, time: int) -> tuple[Path, ...]:  # noqa: ARG001, they are the memory's key
    """The layers, on this machine, that a layer itself names."""
    data = path.read_bytes()
    if data.startswith(_TEXT):
        words = [three or one for three, one in _NAMED.findall(data)]
    elif data.startswith(_CRATE):
        words = _tokens(data)
    else:
        words = []
    endings = tuple(ending.encode() for ending in ENDINGS)
    names = (word.decode(errors="replace") for word in words if word.lower().endswith(endings))
    places = {path.parent / name for name in names if "\0" not in name and len(name) < 4096}
    return tuple(place.resolve() for place in places if _is_file(place))


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except OSError:  # a name that no file can have
        return False


def _tokens(data: bytes) -> list[bytes]:
    """The words of a binary layer; none where it is damaged, which its reader says."""
    try:
        (place,) = struct.unpack_from("<q", data, 16)
        (count,) = struct.unpack_from("<Q", data, place)
        for k in range(min(count, 64)):
            name, begin, size = struct.unpack_from("<16sqq", data, place + 8 + 32 * k)
            if name.rstrip(b"\0") == b"TOKENS":
                _, whole, packed = struct.unpack_from("<QQQ", data, begin)
                block = data[begin + 24 : begin + min(24 + packed, size)]
                return _unpacked(block[1:], min(whole, _MOST_WORDS)).split(b"\0")
    except (struct.error, IndexError):
        pass
    return []


def _unpacked(block: bytes, whole: int) -> bytes:
    """What an LZ4 block says, up to `whole` bytes. Raises IndexError where it ends too early."""
    out, at = bytearray(), 0
    while at < len(block) and len(out) < whole:
        token = block[at]
        at, literals = _length(block, at + 1, token >> 4)
        out += block[at : at + literals]
        at += literals
        if at >= len(block):
            break
        back = block[at] | block[at + 1] << 8
        at, match = _length(block, at + 2, token & 15)
        match = min(match + 4, whole - len(out))
        if not 0 < back <= len(out):
            raise IndexError("a match before the begin")
        piece = out[-back:] if match >= back else out[-back : len(out) - back + match]
        out += (piece * (match // back + 1))[:match]
    return bytes(out)


def _length(block: bytes, at: int, length: int) -> tuple[int, int]:
    """A length of which four bits are known, and where it ends."""
    if length == 15:
        while True:
            length += block[at]
            at += 1
            if block[at - 1] != 255:
                break
    return at, length
