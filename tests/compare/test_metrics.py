"""The metrics rank what users care about, and the gates let through what they should."""

import struct
import zlib
from pathlib import Path

import numpy as np
import pytest
from PIL import Image, PngImagePlugin

from pipeline import cache
from pipeline.compare import Limits, compare, judge, load_picture, measure
from pipeline.compare.pictures import Display
from pipeline.errors import InputError


def strands(count: int = 400, shift: float = 0.0) -> Display:
    """A picture of thin dark lines on grey, like hair seen from near."""
    rng = np.random.default_rng(3)
    image = np.full((200, 200, 3), 150.0)
    rows = np.arange(200)
    for left, slope, tone in rng.random((400, 3))[:count]:
        column = 200 * left + 40 * (slope - 0.5) * rows / 200 + shift * np.sin(rows / 15)
        image[rows, np.clip(column.astype(int), 0, 199)] = [90 * tone, 60 * tone, 40 * tone]
    return image.astype(np.uint8)


def test_equal_pictures_have_no_difference() -> None:
    metrics = measure(strands(), strands())
    assert metrics.identical
    assert (metrics.flip, metrics.ssim, metrics.blurred, metrics.luminance) == (0, 1, 0, 0)


def test_dropped_strands_are_seen_and_grow_with_their_number() -> None:
    few, many = (measure(strands(), strands(count)) for count in (396, 380))
    print(f"1 % dropped: FLIP {few.flip:.4f}, 5 % dropped: FLIP {many.flip:.4f}")
    assert 0 < few.flip < many.flip


def test_gate_1_fails_on_a_single_pixel_and_gate_2_passes_it() -> None:
    changed = strands()
    changed[100, 100] += 40
    metrics = measure(strands(), changed)
    assert judge(metrics, exact=True) != []
    assert judge(metrics, exact=False) == []


def test_gate_2_fails_when_the_strands_bend_otherwise() -> None:
    metrics = measure(strands(), strands(shift=6.0))
    reasons = judge(metrics, exact=False, limits=Limits())
    print(reasons)
    assert reasons != []


def test_gate_2_fails_on_a_brighter_picture() -> None:
    brighter = np.clip(strands() * 1.04, 0, 255).astype(np.uint8)
    reasons = judge(measure(strands(), brighter), exact=False)
    assert any("luminance" in reason for reason in reasons)


def test_folders_report_what_is_missing_unreadable_or_of_another_size(tmp_path: Path) -> None:
    for folder, names in (("a", ["1.png", "2.png", "4.png"]), ("b", ["2.png", "3.png", "4.png"])):
        (tmp_path / folder).mkdir()
        for name in names:
            Image.fromarray(strands()).save(tmp_path / folder / name)
    Image.fromarray(strands()[:50]).save(tmp_path / "b" / "4.png")
    found = compare(tmp_path / "a", tmp_path / "b")
    assert not found.identical
    assert not found.passed
    assert [pair.reasons for pair in found.pairs] == [
        ["the new picture is missing"],
        [],
        ["the reference is missing"],
        ["pictures differ in size: 200x200 and 200x50"],
    ]


def test_with_limits_another_renderer_passes_and_the_same_one_does_not(tmp_path: Path) -> None:
    changed = strands()
    changed[100, 100] += 40
    for name, pixels, renderer in (("a", strands(), "x"), ("b", changed, "x"), ("c", changed, "y")):
        info = PngImagePlugin.PngInfo()
        info.add_text("ringlet.fingerprint", renderer)
        Image.fromarray(pixels).save(tmp_path / f"{name}.png", pnginfo=info)
    assert not compare(tmp_path / "a.png", tmp_path / "b.png", Limits()).passed
    assert compare(tmp_path / "a.png", tmp_path / "c.png", Limits()).passed
    assert not compare(tmp_path / "a.png", tmp_path / "c.png").passed


def test_linear_pictures_are_compared_beyond_white(tmp_path: Path) -> None:
    exr = pytest.importorskip("OpenEXR")
    bright = np.full((24, 24, 3), 4.0, np.float32)
    brighter = bright.copy()
    brighter[12, 12] = 8.0  # both are white on a screen
    nan = bright.copy()
    nan[3, 3] = np.nan
    paths = [tmp_path / f"{name}.exr" for name in "abn"]
    for path, pixels in zip(paths, (bright, brighter, nan), strict=True):
        exr.File({"type": exr.scanlineimage}, {"RGB": pixels}).write(str(path))
    found = compare(paths[0], paths[1]).pairs[0].metrics
    assert found is not None
    print(found)
    assert found.changed == 1 / 24**2
    assert found.flip > 0
    assert not compare(paths[0], paths[2]).identical
    assert compare(paths[2], paths[2]).identical
    Image.fromarray(strands()[:24, :24]).save(tmp_path / "a.png")
    with pytest.raises(InputError, match="float32 and uint8"):
        compare(paths[0], tmp_path / "a.png")


def test_the_low_bits_of_sixteen_are_seen(tmp_path: Path) -> None:
    """Pillow reads 16 bits a channel as 8; rows by every filter of PNG."""
    pixels = np.random.default_rng(5).integers(0, 65536, (5, 7, 3), np.uint16)
    other = pixels.copy()
    other[2, 3, 1] ^= 1
    cache.write_picture(tmp_path / "a.png", pixels, "", {})
    cache.write_picture(tmp_path / "b.png", other, "", {})
    found = compare(tmp_path / "a.png", tmp_path / "b.png").pairs[0].metrics
    assert found is not None
    assert found.changed == pytest.approx(1 / 35)
    coded = filtered(pixels)
    header = struct.pack(">IIBBBBB", 7, 5, 16, 2, 0, 0, 0)
    chunks = ((b"IHDR", header), (b"IDAT", zlib.compress(coded)), (b"IEND", b""))
    parts = [
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        for kind, data in chunks
    ]
    (tmp_path / "c.png").write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(parts))
    np.testing.assert_array_equal(load_picture(tmp_path / "c.png"), pixels)
    (tmp_path / "c.png").write_bytes((tmp_path / "a.png").read_bytes()[:-60])
    with pytest.raises(InputError, match="not a readable picture"):
        load_picture(tmp_path / "c.png")


def filtered(pixels: np.ndarray) -> bytes:
    """Row i by filter i: none, sub, up, average, Paeth, as the specification defines them."""
    rows = pixels.astype(">u2").view(np.uint8).reshape(len(pixels), -1).astype(int)
    out = bytearray()
    for kind, row in enumerate(rows):
        above = rows[kind - 1] if kind else 0 * row
        left, corner = (np.concatenate([np.zeros(6, int), line[:-6]]) for line in (row, above))
        p = left + above - corner
        far = np.abs([p - left, p - above, p - corner])
        paeth = np.where(
            (far[0] <= far[1]) & (far[0] <= far[2]), left, np.where(far[1] <= far[2], above, corner)
        )
        guess = (0 * row, left, above, (left + above) // 2, paeth)[kind]
        out += bytes([kind]) + ((row - guess) % 256).astype(np.uint8).tobytes()
    return bytes(out)


def test_transparency_is_seen(tmp_path: Path) -> None:
    pixels = np.full((16, 16, 4), 90, np.uint8)
    pixels[..., 3] = 255
    Image.fromarray(pixels).save(tmp_path / "a.png")
    pixels[4, 4, 3] = 100
    Image.fromarray(pixels).save(tmp_path / "b.png")
    assert not compare(tmp_path / "a.png", tmp_path / "b.png").identical


def test_bad_paths_and_pictures_give_one_clear_message(tmp_path: Path) -> None:
    good, bad, small = tmp_path / "good.png", tmp_path / "bad.png", tmp_path / "small.png"
    Image.fromarray(strands()).save(good)
    Image.fromarray(strands()[:100]).save(small)
    bad.write_bytes(good.read_bytes()[:300])
    for other, message in (
        (tmp_path / "none.png", "no such file"),
        (bad, "not a readable picture"),
        (small, "differ in size: 200x200 and 200x100"),
        (tmp_path, "two files or two folders"),
    ):
        with pytest.raises(InputError, match=message):
            compare(good, other)
