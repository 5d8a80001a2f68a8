"""Groom files: what is written is read back, and no header is believed."""

import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from pipeline.errors import InputError
from pipeline.strands.formats import Ragged, read_groom
from pipeline.strands.formats.hair import write_hair
from pipeline.strands.formats.tfx import write_tfx
from pipeline.strands.formats.usc_data import write_data

SHARED = Path(__file__).parents[2].parent / "shared/data"
WRITERS = {".tfx": write_tfx, ".hair": write_hair, ".data": write_data}


def groom(counts: list[int], root: int = 2, tip: int = 0) -> Ragged:
    points = np.random.default_rng(3).normal(size=(sum(counts), 3)).astype(np.float32)
    pins = np.tile(np.array([root, tip], np.uint8), (len(counts), 1))
    return Ragged(points.astype(np.float64), np.array(counts, np.int64), pins)


def tfx_3(path: Path, strands: Ragged, both_ends: int = 0) -> None:
    """TressFX 3.x, which ringlet reads only: the positions are three numbers each."""
    header = struct.pack("<f3Ii", 3.0, len(strands), int(strands.counts[0]), 0, both_ends)
    header = header.ljust(144, b"\0") + struct.pack("<I", 296)
    path.write_bytes(header.ljust(296, b"\0") + strands.points.astype("<f4").tobytes())


def patched(path: Path, offset: int, kind: str, value: float) -> Path:
    data = bytearray(path.read_bytes())
    struct.pack_into("<" + kind, data, offset, value)
    path.write_bytes(data)
    return path


def refusal(path: Path) -> str | None:
    """The message for a file that does not hold up; None for strands that fit together."""
    try:
        read = read_groom(path)
    except InputError as refused:
        return str(refused)
    assert read.counts.min() >= 0
    assert read.counts.sum() == len(read.points)
    assert read.points.nbytes <= 2 * len(path.read_bytes())
    return None


@pytest.mark.parametrize("ending", [".hair", ".data"])
def test_strands_of_any_number_of_points_come_back(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"groom{ending}"
    WRITERS[ending](path, written := groom([2, 7, 3, 100]))
    read = read_groom(path)
    assert np.array_equal(read.counts, written.counts)
    assert np.array_equal(read.points, written.points)
    assert np.array_equal(read.pins, written.pins)


@pytest.mark.parametrize("pins", [(0, 0), (1, 0), (2, 0), (2, 2), (0, 1)])
def test_held_ends_come_back_from_tfx_4(tmp_path: Path, pins: tuple[int, int]) -> None:
    write_tfx(tmp_path / "groom.tfx", written := groom([8, 8, 8], *pins))
    read = read_groom(tmp_path / "groom.tfx")
    assert np.array_equal(read.points, written.points)
    assert np.array_equal(read.pins, written.pins)


@pytest.mark.parametrize("both_ends", [0, 1])
def test_tfx_3_holds_roots_and_on_its_flag_tips(tmp_path: Path, both_ends: int) -> None:
    tfx_3(tmp_path / "groom.tfx", written := groom([8, 8]), both_ends)
    read = read_groom(tmp_path / "groom.tfx")
    assert np.array_equal(read.points, written.points)
    assert np.array_equal(read.pins, [[2, 2 * both_ends]] * 2)


def test_hair_of_one_default_number_of_segments_comes_back(tmp_path: Path) -> None:
    strands = groom([5, 5, 5])
    header = b"HAIR" + struct.pack("<4I", 3, 15, 2, 4)
    path = tmp_path / "groom.hair"
    path.write_bytes(header.ljust(128, b"\0") + strands.points.astype("<f4").tobytes())
    read = read_groom(path)
    assert np.array_equal(read.counts, [5, 5, 5])
    assert np.array_equal(read.points, strands.points)


@pytest.mark.parametrize(
    ("file", "strands", "points", "pins"),
    [("sintel/sintel_16points.tfx", 11_400, 16, [1, 0]), ("ratboy/ratboy_mohawk.tfx", 2_228, 32, [2, 0])],
)
def test_real_files_hold_what_is_known_of_them(file: str, strands: int, points: int, pins: list[int]) -> None:
    if not (SHARED / file).exists():
        pytest.skip(f"the shared file {file} is not on this machine")
    read = read_groom(SHARED / file)
    assert len(read) == strands
    assert (read.counts == points).all()
    assert (read.pins == pins).all()
    assert np.isfinite(read.points).all()


LIES = [  # writer, byte, kind, value, and what the message must name
    (write_tfx, 0, "f", 5.0, "version 5"),
    (write_tfx, 4, "I", 0, "number of strands is 0"),
    (write_tfx, 4, "I", 4_000_000_000, "positions"),
    (write_tfx, 8, "I", 1, "points per strand is 1"),
    (write_tfx, 8, "I", 64, "positions"),
    (write_tfx, 12, "I", 12, "offset of positions is 12"),
    (write_tfx, 12, "I", 4_000_000_000, "positions"),
    (write_hair, 0, "I", 0, '"HAIR"'),
    (write_hair, 4, "I", 0, "number of strands is 0"),
    (write_hair, 4, "I", 4_000_000_000, "segments"),
    (write_hair, 8, "I", 4_000_000_000, "4000000000"),
    (write_hair, 12, "I", 1, "flags are 1"),
    (write_hair, 128, "H", 60_000, "header says"),
    (write_data, 0, "i", 0, "number of strands is 0"),
    (write_data, 0, "i", -5, "number of strands is -5"),
    (write_data, 0, "i", 2_000_000_000, "number of strands is 2000000000"),
    (write_data, 4, "i", -1, "strand 0 has -1 points"),
    (write_data, 4, "i", 2_000_000_000, "strand 0"),
]


@pytest.mark.parametrize(("write", "offset", "kind", "value", "named"), LIES)
def test_a_header_that_lies_is_refused_by_name(
    tmp_path: Path, write: Callable[[Path, Ragged], None], offset: int, kind: str, value: float, named: str
) -> None:
    path = tmp_path / f"groom{next(e for e, w in WRITERS.items() if w is write)}"
    write(path, groom([8, 8, 8]))
    with pytest.raises(InputError) as refused:
        read_groom(patched(path, offset, kind, value))
    assert str(path) in str(refused.value)
    assert named in str(refused.value)


@pytest.mark.parametrize("ending", WRITERS)
def test_a_truncated_file_is_refused_wherever_it_ends(tmp_path: Path, ending: str) -> None:
    path = tmp_path / f"groom{ending}"
    WRITERS[ending](path, groom([8, 8, 8]))
    whole = path.read_bytes()
    for end in range(len(whole)):
        path.write_bytes(whole[:end])
        with pytest.raises(InputError, match=str(path)):
            read_groom(path)


@pytest.mark.parametrize("ending", WRITERS)
@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    changes=st.lists(
        st.tuples(st.integers(0, 400), st.integers(0, 2**32 - 1) | st.sampled_from([0, 1, 2**31, 2**32 - 1])),
        max_size=4,
    ),
    tail=st.binary(max_size=64),
)
@example(changes=[(8, 2**31)], tail=b"")
def test_hostile_files_give_strands_or_a_message_and_nothing_else(
    tmp_path: Path, ending: str, changes: list[tuple[int, int]], tail: bytes
) -> None:
    path = tmp_path / f"groom{ending}"
    WRITERS[ending](path, groom([4, 4, 4]))
    data = bytearray(path.read_bytes() + tail)
    for offset, value in changes:
        offset = min(offset, len(data) - 4) // 2 * 2
        struct.pack_into("<I", data, offset, value)
    path.write_bytes(data)
    message = refusal(path)
    assert message is None or str(path) in message


@pytest.mark.parametrize("ending", WRITERS)
@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.binary(max_size=400))
def test_any_bytes_give_strands_or_a_message(tmp_path: Path, ending: str, data: bytes) -> None:
    path = tmp_path / f"noise{ending}"
    path.write_bytes(data)
    message = refusal(path)
    assert message is None or str(path) in message


def test_an_unknown_ending_and_a_missing_file_are_told(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"unknown kind of groom file.*\.data, \.hair, \.tfx"):
        read_groom(tmp_path / "groom.obj")
    with pytest.raises(InputError, match="no such groom file"):
        read_groom(tmp_path / "groom.tfx")
