"""Damages to files in the ways that disks, networks and enemies do them.

Bits flipped, the end cut off, pieces moved, doubled or left out, numbers of headers and of text replaced by those that
break programs.
"""

import struct
from collections.abc import Callable

import numpy as np

EVIL = [0, 1, 2, 3, 0x7F, 0x80, 0xFF, 0x7FFF, 0x8000, 0xFFFF, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFE, 0xFFFFFFFF]
WORDS = [
    b"-1",
    b"0",
    b"1e308",
    b"nan",
    b"99999999999",
    b"4294967295",
    b"2147483648",
    b"",
    b"(",
    b"]",
    b"}",
    b'"',
    b"\0",
]

Rng = np.random.Generator


def flipped(data: bytearray, rng: Rng) -> None:
    for at in rng.integers(len(data), size=rng.integers(1, 9)):
        data[at] ^= 1 << rng.integers(8)


def overwritten(data: bytearray, rng: Rng) -> None:
    for at in rng.integers(len(data), size=rng.integers(1, 5)):
        data[at] = rng.integers(256)


def cut(data: bytearray, rng: Rng) -> None:
    del data[rng.integers(len(data)) :]


def number(data: bytearray, rng: Rng) -> None:
    """Numbers of headers, which stand at the begin of most formats, and anywhere."""
    for _ in range(rng.integers(1, 4)):
        size = int(rng.choice([2, 4, 8]))
        end = min(len(data), 320) if rng.random() < 0.7 else len(data)
        if end >= size:
            at = int(rng.integers(end // size)) * size
            value = int(rng.choice(EVIL)) if rng.random() < 0.7 else int(rng.integers(2 * len(data)))
            struct.pack_into({2: "<H", 4: "<I", 8: "<Q"}[size], data, at, value % (1 << 8 * size))


def spliced(data: bytearray, rng: Rng) -> None:
    """A piece of the file again, at another place: in place of what was there, or between."""
    a, b = sorted(rng.integers(len(data) + 1, size=2))
    piece = data[a : min(b, a + 512)]
    at = rng.integers(len(data) + 1)
    data[at : at + len(piece) * (rng.random() < 0.5)] = piece


def shortened(data: bytearray, rng: Rng) -> None:
    at = rng.integers(len(data))
    del data[at : at + rng.integers(1, 65)]


def word(data: bytearray, rng: Rng) -> None:
    """A number or a word of a text."""
    marks = [i for i, byte in enumerate(data) if byte in b' ,()[]="\n']
    if len(marks) > 1:
        i = int(rng.integers(len(marks) - 1))
        data[marks[i] + 1 : marks[i + 1]] = WORDS[rng.integers(len(WORDS))]


DAMAGES: list[Callable[[bytearray, Rng], None]] = [
    flipped,
    overwritten,
    cut,
    number,
    spliced,
    shortened,
    word,
]


def damaged(data: bytes, rng: Rng) -> bytes:
    """One to three damages."""
    found = bytearray(data)
    for _ in range(rng.integers(1, 4)):
        if found:
            DAMAGES[rng.integers(len(DAMAGES))](found, rng)
    return bytes(found)
