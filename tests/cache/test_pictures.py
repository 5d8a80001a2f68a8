from pathlib import Path

import numpy as np
import pytest

from pipeline import cache


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
