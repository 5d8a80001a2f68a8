import sys
from pathlib import Path

import numpy as np
import pytest

from pipeline import cache
from pipeline.errors import InputError


@pytest.fixture
def picture(tmp_path: Path) -> Path:
    pixels = np.random.default_rng(0).integers(0, 255, (9, 16, 3), np.uint8)
    cache.write_picture(tmp_path / "0001.png", pixels, "key", {"seed": 1})
    return tmp_path / "0001.png"


def test_a_frame_says_what_it_was_made_from(picture: Path) -> None:
    assert cache.picture_record(picture) == ("key", {"seed": 1})


def test_every_damaged_byte_of_a_frame_is_found(picture: Path) -> None:
    whole = picture.read_bytes()
    for at in range(len(whole)):
        picture.write_bytes(whole[:at] + bytes([whole[at] ^ 1]) + whole[at + 1 :])
        with pytest.raises(cache.Damaged, match=r"0001\.png"):
            cache.picture_record(picture)


def test_a_truncated_frame_is_found(picture: Path) -> None:
    whole = picture.read_bytes()
    for length in range(0, len(whole), 7):
        picture.write_bytes(whole[:length])
        with pytest.raises(cache.Damaged, match=r"0001\.png"):
            cache.picture_record(picture)


def test_a_missing_frame_is_told(tmp_path: Path) -> None:
    with pytest.raises(cache.Missing, match=r"0002\.png"):
        cache.picture_record(tmp_path / "0002.png")


@pytest.mark.parametrize("kind", [np.uint8, np.uint16])
def test_every_bit_of_the_pixels_comes_back(kind: type, tmp_path: Path) -> None:
    """Read by VTK, which keeps 16 bits: bottom row first."""
    import vtk
    from vtkmodules.util.numpy_support import vtk_to_numpy

    pixels = np.random.default_rng(0).integers(0, np.iinfo(kind).max, (31, 17, 3), kind, endpoint=True)
    cache.write_picture(tmp_path / "a.png", pixels, "key", {})
    reader = vtk.vtkPNGReader()
    reader.SetFileName(str(tmp_path / "a.png"))
    reader.Update()
    read = vtk_to_numpy(reader.GetOutput().GetPointData().GetScalars())
    assert read.dtype == kind
    assert np.array_equal(read.reshape(31, 17, 3)[::-1], pixels)
    assert cache.picture_record(tmp_path / "a.png") == ("key", {})


def test_what_is_no_picture_is_not_written(tmp_path: Path) -> None:
    for pixels in (np.zeros((4, 4), np.uint8), np.zeros((4, 4, 3), np.float32)):
        with pytest.raises(ValueError, match="uint8 or uint16"):
            cache.write_picture(tmp_path / "a.png", pixels, "key", {})
    assert not list(tmp_path.iterdir())


def layers(rows: int = 5) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(0)
    return {
        **{name: rng.random((rows, 4)).astype(np.float16) for name in ("R", "G", "B", "A", "tangent.X")},
        "Z": rng.random((rows, 4)).astype(np.float32),
        "id": rng.integers(0, 2**32, (rows, 4), np.uint32),
    }


def test_layers_are_read_as_they_were_written(tmp_path: Path) -> None:
    exr = pytest.importorskip("OpenEXR")
    path = tmp_path / "0001.exr"
    cache.write_layers(path, layers(), "key", {"seed": 1}, fingerprint="here")
    with exr.File(str(path), separate_channels=True) as file:
        read = {name: channel.pixels for name, channel in file.channels().items()}
        assert file.header()["ringlet.fingerprint"] == "here"
    assert read.keys() == layers().keys()
    for name, layer in layers().items():
        assert read[name].dtype == layer.dtype
        assert np.array_equal(read[name], layer)
    assert cache.picture_record(path) == ("key", {"seed": 1})


def test_layers_have_the_same_bytes_every_time_and_no_byte_is_damaged_unnoticed(tmp_path: Path) -> None:
    pytest.importorskip("OpenEXR")
    path = tmp_path / "0001.exr"
    cache.write_layers(path, layers(), "key", {"seed": 1})
    whole = path.read_bytes()
    cache.write_layers(path, layers(), "key", {"seed": 1})
    assert path.read_bytes() == whole
    for at in range(len(whole)):
        path.write_bytes(whole[:at] + bytes([whole[at] ^ 1]) + whole[at + 1 :])
        with pytest.raises(cache.Damaged, match=r"0001\.exr"):
            cache.picture_record(path)
    for length in range(0, len(whole), 7):
        path.write_bytes(whole[:length])
        with pytest.raises(cache.Damaged, match=r"0001\.exr"):
            cache.picture_record(path)


def test_without_openexr_the_extra_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "OpenEXR", None)
    with pytest.raises(InputError, match=r'pip install "ringlet\[exr\]"'):
        cache.write_layers(tmp_path / "0001.exr", layers(), "key", {})
    assert not list(tmp_path.iterdir())
