"""The metrics rank what users care about, and the gates let through what they should."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from pipeline.compare import Limits, compare, judge, measure
from pipeline.compare.metrics import Picture
from pipeline.errors import InputError


def strands(count: int = 400, shift: float = 0.0) -> Picture:
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
    assert judge(metrics, same_fingerprint=True) != []
    assert judge(metrics, same_fingerprint=False) == []


def test_gate_2_fails_when_the_strands_bend_otherwise() -> None:
    metrics = measure(strands(), strands(shift=6.0))
    reasons = judge(metrics, same_fingerprint=False, limits=Limits())
    print(reasons)
    assert reasons != []


def test_gate_2_fails_on_a_brighter_picture() -> None:
    brighter = np.clip(strands() * 1.04, 0, 255).astype(np.uint8)
    reasons = judge(measure(strands(), brighter), same_fingerprint=False)
    assert any("luminance" in reason for reason in reasons)


def test_folders_report_missing_pictures_and_the_page_shows_them(tmp_path: Path) -> None:
    for folder, names in (("a", ["1.png", "2.png"]), ("b", ["2.png", "3<b>.png"])):
        (tmp_path / folder).mkdir()
        for name in names:
            Image.fromarray(strands()).save(tmp_path / folder / name)
    page = tmp_path / "page.html"
    found = compare(tmp_path / "a", tmp_path / "b", page)
    assert not found.identical
    assert [pair.metrics is None for pair in found.pairs] == [True, False, True]
    text = page.read_text()
    assert "missing: the new picture" in text
    assert "missing: the reference" in text
    assert "3&lt;b&gt;.png" in text
    assert "3<b>" not in text


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
