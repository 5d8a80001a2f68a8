"""The page of comparisons, in a browser: what it shows, what keys and pointer do, and that names stay text."""

import io
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image, PngImagePlugin

from pipeline.compare import Limits, compare
from pipeline.compare.page import comparison_page, environment_rows

Visit = Callable[[Path], Any]

HOSTILE = "<img src=x onerror=alert(1)>\"'&amp;<script>alert(2)<"
RENDERERS = ("llvmpipe; vtk 9.5; <b>x</b>", "softpipe; vtk 9.5; <i>y</i>")


def save(path: Path, pixels: np.ndarray, renderer: str) -> None:
    info = PngImagePlugin.PngInfo()
    info.add_text("ringlet.fingerprint", renderer)
    Image.fromarray(pixels).save(path, pnginfo=info)


@pytest.fixture
def page(tmp_path: Path) -> Path:
    """Four pairs: equal, within the limits, beyond them, and without a reference; one has a hostile name."""
    a, b = tmp_path / "a", tmp_path / "b"
    a.mkdir()
    b.mkdir()
    grey = np.full((60, 90, 3), 120, np.uint8)
    red = grey.copy()
    red[:, 45:] = (200, 30, 30)
    dot = grey.copy()
    dot[5, 5] = 160
    for name, new in (("equal", grey), ("near", dot), (f"far{HOSTILE}", red)):
        save(a / f"{name}.png", grey, RENDERERS[0])
        save(b / f"{name}.png", new, RENDERERS[1] if name != "equal" else RENDERERS[0])
    save(b / "only.png", red, RENDERERS[1])
    page = tmp_path / "page.html"
    page.write_text(
        comparison_page(
            f"golden {HOSTILE}", compare(a, b, Limits(flip=0.01, ssim=0.9, blurred=0.01)).pairs, [HOSTILE]
        ),
        "utf-8",
    )
    return page


def shown(page: Any) -> list[str]:
    names: list[str] = page.locator(".pair:visible h2").all_inner_texts()
    return names


def test_failures_come_first_and_the_filter_shows_the_rest(page: Path, visit: Visit) -> None:
    open_page = visit(page)
    far = f"far{HOSTILE}.png"
    assert sorted(shown(open_page)) == [far, "only.png"]
    assert "4 compared: 2 failed, 1 differ and pass, 1 equal" in open_page.inner_text("body")
    open_page.keyboard.press("f")
    assert sorted(shown(open_page)) == [far, "near.png", "only.png"]
    open_page.click("button[data-filter=equal]")
    assert len(shown(open_page)) == 4
    open_page.fill("#search", "NEA")
    assert shown(open_page) == ["near.png"]
    open_page.fill("#search", "zzz")
    assert open_page.locator("#nothing").is_visible()


def test_names_notes_and_renderers_stay_text(page: Path, visit: Visit) -> None:
    open_page = visit(page)
    assert open_page.title() == f"golden {HOSTILE}"
    assert open_page.inner_text("h1") == f"golden {HOSTILE}"
    assert "<b>x</b>" in open_page.inner_text("#environment")
    assert open_page.locator("script").count() == 1
    assert open_page.locator("img:not([src^='data:'])").count() == 0


def test_the_policy_stops_a_script_that_came_in_by_other_ways(page: Path, chromium: Any) -> None:
    text = page.read_text("utf-8").replace("</h1>", "</h1><script>document.title = 'owned'</script>", 1)
    page.write_text(text, "utf-8")
    open_page = chromium.new_page()
    open_page.goto(page.as_uri())
    assert open_page.title() != "owned"
    open_page.close()


def test_the_swipe_uncovers_the_reference(page: Path, visit: Visit) -> None:
    """Right of the handle is the new picture, left of it the reference; by pointer and by keys."""
    open_page = visit(page)
    open_page.fill("#search", "far")
    open_page.locator("#search").blur()
    open_page.keyboard.press("2")
    new = open_page.locator(".pair:visible .new img")
    box = new.bounding_box()

    def red(part: float) -> bool:
        """Whether the picture is red at a part of its width."""
        clip = {"x": box["x"] + part * box["width"] - 1, "y": box["y"] + 10, "width": 2, "height": 2}
        picture = open_page.screenshot(clip=clip)
        with Image.open(io.BytesIO(picture)) as image:
            r, g, _ = image.convert("RGB").getpixel((0, 0))
        return bool(r > 150 and g < 80)

    assert red(0.75)
    assert not red(0.25)
    open_page.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 20)
    open_page.mouse.down()
    open_page.mouse.move(box["x"] + 0.9 * box["width"], box["y"] + 20, steps=3)
    open_page.mouse.up()
    assert not red(0.75)
    assert red(0.97)
    open_page.keyboard.press("j")
    for _ in range(20):
        open_page.keyboard.press("ArrowLeft")
    assert open_page.locator(".pair:visible input[type=range]").input_value() == "0"
    assert red(0.75)


def test_views_zoom_and_the_way_from_pair_to_pair_need_no_pointer(page: Path, visit: Visit) -> None:
    open_page = visit(page)
    open_page.click("button[data-filter=equal]")
    names = []
    for _ in range(4):
        open_page.keyboard.press("j")
        names.append(open_page.evaluate("document.activeElement.querySelector('h2').innerText"))
    assert len(set(names)) == 4
    open_page.keyboard.press("k")
    assert open_page.evaluate("document.activeElement.querySelector('h2').innerText") == names[2]
    before = open_page.locator(".pair[data-name^=far] .new img").bounding_box()["width"]
    open_page.keyboard.press("z")
    assert open_page.locator(".pair[data-name^=far] .new img").bounding_box()["width"] == 3 * before
    open_page.keyboard.press("4")
    visible = open_page.locator(".pair[data-name^=far] figure:visible figcaption").all_inner_texts()
    assert visible == ["difference (FLIP)"]
    for name in ("side", "swipe", "blink", "heat"):
        open_page.click(f"button[data-view={name}]")
        assert open_page.locator("button[data-view][aria-pressed=true]").count() == 1


def test_every_picture_is_in_the_page_once(page: Path) -> None:
    text = page.read_text("utf-8")
    assert text.count("data:image/webp") == 3 + 3 + 1
    assert text.count("data:image/jpeg") == 1


def test_a_name_that_is_no_unicode_is_shown_all_the_same(tmp_path: Path) -> None:
    pixels = np.zeros((8, 8, 3), np.uint8)
    folder = tmp_path / "a"
    folder.mkdir()
    save(folder / os.fsdecode(b"\xff\x01.png"), pixels, "x")
    text = comparison_page("t", compare(folder, folder).pairs)
    assert "��.png" in text
    text.encode("utf-8")


def test_environments_are_compared_part_by_part() -> None:
    assert environment_rows([("a; b; c", "a; x; c"), ("a; b; c", "a; x; c"), ("q", "q")]) == [("b", "x")]
    assert environment_rows([("a", None)]) == [("a", "no fingerprint")]
