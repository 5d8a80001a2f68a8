"""Movies of every codec: all frames, their colours, the same bytes."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from pipeline import cache
from pipeline.render.movie import Codec, write_movie, write_sheet

av = pytest.importorskip("av")
COLOURS = np.array([[200, 40, 30], [30, 180, 60], [20, 50, 210], [230, 220, 30], [128, 128, 128]])


def frames(folder: Path, bits: int = 8, size: tuple[int, int] = (66, 130)) -> list[Path]:
    """Flat colours with a white corner; 16 bits have values that 8 do not."""
    paths = []
    for i, colour in enumerate(COLOURS):
        picture = np.empty((*size, 3), np.uint8 if bits == 8 else np.uint16)
        picture[:] = colour if bits == 8 else colour * 257 + 100
        picture[:16, :16] = np.iinfo(picture.dtype).max
        paths.append(folder / f"{i + 1:04d}.png")
        cache.write_picture(paths[-1], picture, "key", {})
    return paths


def decoded(path: Path, form: str) -> list[np.ndarray]:
    with av.open(str(path)) as container:
        return [frame.reformat(format=form).to_ndarray() for frame in container.decode(video=0)]


@pytest.mark.parametrize(("codec", "name"), [("h264", "avc1"), ("av1", "av01")])
def test_movies_hold_all_frames_in_their_colours_and_say_which_they_are(
    tmp_path: Path, codec: Codec, name: str
) -> None:
    path = write_movie(frames(tmp_path), tmp_path, 24, codec)
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        assert stream.average_rate == 24
        assert stream.codec_context.codec_tag == name
        context = stream.codec_context
        assert (context.color_primaries, context.colorspace, context.color_range) == (1, 1, 1)
    pictures = decoded(path, "rgb24")
    worst = max(np.abs(p[40, 60] - c).max() for p, c in zip(pictures, COLOURS, strict=True))
    print(f"{codec}: {path.stat().st_size} bytes, colours off by {worst} of 255")
    assert worst <= 4
    assert min(p[8, 8].min() for p in pictures) >= 250


@pytest.mark.parametrize("bits", [8, 16])
def test_lossless_movies_keep_every_bit(tmp_path: Path, bits: int) -> None:
    made = frames(tmp_path, bits, size=(33, 65))
    path = write_movie(made, tmp_path, 25, "ffv1")
    form = "rgb24" if bits == 8 else "gbrp16le"
    wanted = [next(av.open(str(p)).decode(video=0)).reformat(format=form).to_ndarray() for p in made]
    assert path.suffix == ".mkv"
    assert np.array_equal(decoded(path, form), wanted)


@pytest.mark.parametrize("codec", ["h264", "ffv1"])
def test_the_same_frames_give_the_same_bytes(tmp_path: Path, codec: Codec) -> None:
    made = frames(tmp_path)
    first = write_movie(made, tmp_path, 24, codec).read_bytes()
    assert write_movie(made, tmp_path, 24, codec).read_bytes() == first


def test_odd_sides_are_cropped_where_the_codec_needs_it(tmp_path: Path) -> None:
    path = write_movie(frames(tmp_path, size=(33, 65)), tmp_path, 24)
    assert decoded(path, "rgb24")[0].shape == (32, 64, 3)


def test_a_contact_sheet_shows_the_frames(tmp_path: Path) -> None:
    sheet = write_sheet(frames(tmp_path), tmp_path)
    with Image.open(sheet) as image:
        picture = np.asarray(image)
    assert picture.shape[1] == 5 * 320
    middles = picture[picture.shape[0] // 2, 160::320]
    assert np.abs(middles.astype(int) - COLOURS).max() <= 1
