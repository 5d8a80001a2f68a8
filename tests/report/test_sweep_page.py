"""The page of a sweep in a browser: films in step, a table that sorts, and no name that becomes markup."""

import io
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from pipeline.errors import InputError
from pipeline.report import write_sweep_page

Visit = Callable[[Path], Any]
HOSTILE = '"><img src=x onerror=alert(1)>'
STAGES = ("groom", "simulate", "interpolate", "render")


def sweep_of(folder: Path) -> Path:
    """Three experiments: 10 frames at 10/s, 5 at 5/s, and one that has not begun."""
    runs = []
    for index, (count, fps, strain) in enumerate([(10, 10.0, 2e-5), (5, 5.0, 1e-4), (0, 5.0, None)]):
        name = f"s@a={index}{'#%' if index else HOSTILE.replace('/', '')}"
        frames = folder / name / "frames"
        frames.mkdir(parents=True)
        for number in range(1, count + 1):
            tone = np.full((36, 64, 3), 20 * number, np.uint8)
            Image.fromarray(tone).save(frames / f"{number:04d}.png")
        runs.append(
            {
                "name": name,
                "folder": f"../{name}",
                "complete": count > 0,
                "values": {"a": index, "b": [HOSTILE, "9", "10"][index]},
                "frames": count,
                "fps": fps,
                "size": [64, 36],
                "pictures": [f"../{name}/frames/{number:04d}.png" for number in range(1, count + 1)],
                "stages": {
                    stage: {
                        "key": "k",
                        "seconds": None if index else 1.5,
                        "shared_with": None if not index else "first",
                    }
                    for stage in STAGES
                },
                "metrics": {"strain": strain, "energy_bending": strain, "contacts": None},
            }
        )
    path = folder / "s" / "sweep.json"
    path.parent.mkdir()
    path.write_text(
        json.dumps(
            {
                "format": 1,
                "name": f"s{HOSTILE}",
                "config": "c",
                "mode": "zip",
                "keys": ["a", "b"],
                "runs": runs,
            }
        )
    )
    return write_sweep_page(path)


def tones(page: Any) -> list[float]:
    """Mean grey of the films as they are shown."""
    found = []
    for film in page.locator(".film").all():
        with Image.open(io.BytesIO(film.screenshot())) as image:
            found.append(float(np.asarray(image.convert("L")).mean()))
    return found


def test_films_play_in_step_by_their_own_clock(tmp_path: Path, visit: Visit) -> None:
    page = visit(sweep_of(tmp_path))
    assert page.locator(".card .film").count() == 2
    assert tones(page) == pytest.approx([20, 20], abs=6)
    page.locator("#time").fill("0.45")  # frame 5 of ten a second, frame 3 of five a second
    assert tones(page) == pytest.approx([100, 60], abs=6)
    page.keyboard.press("ArrowRight")
    assert page.inner_text("#clock") == "0.50 s"
    assert tones(page) == pytest.approx([120, 60], abs=6)
    page.locator("#time").fill("9")
    assert tones(page) == pytest.approx([200, 100], abs=6)
    page.keyboard.press("ArrowLeft")
    assert page.inner_text("#clock") == "0.80 s"


def test_playing_goes_on_by_itself_and_stops(tmp_path: Path, visit: Visit) -> None:
    page = visit(sweep_of(tmp_path))
    page.locator("body").press("Space")
    for _ in range(100):
        page.wait_for_timeout(50)
        if float(page.locator("#time").input_value()) > 0.1:
            break
    else:
        pytest.fail("the films stand still")
    page.locator("#play").click()
    page.wait_for_timeout(100)
    held = page.locator("#time").input_value()
    page.wait_for_timeout(100)
    assert page.locator("#time").input_value() == held


def test_a_film_links_to_the_full_frame_that_it_shows(tmp_path: Path, visit: Visit) -> None:
    page = visit(sweep_of(tmp_path))
    page.locator("#time").fill("0.45")
    for film, number in zip(page.locator(".film").all(), (5, 3), strict=True):
        target = film.evaluate("link => decodeURIComponent(new URL(link.href).pathname)")
        assert Path(target).name == f"{number:04d}.png"
        assert Path(target).is_file()


def test_the_table_sorts_numbers_words_and_films_and_what_is_missing_comes_last(
    tmp_path: Path, visit: Visit
) -> None:
    page = visit(sweep_of(tmp_path))

    def order() -> list[str]:
        rows = page.locator("#figures tbody tr td:nth-child(2)").all_inner_texts()
        films = page.locator(".films .card").evaluate_all("all => all.map(card => card.dataset.run)")
        assert films == rows  # a is the number of the run
        return list(rows)

    heads = page.locator("#figures th").all_inner_texts()
    assert "contacts" not in heads  # no run has it
    strain = page.locator("#figures th button", has_text="strain")
    strain.click()
    assert order() == ["0", "1", "2"]
    strain.click()
    assert page.locator("#figures th[aria-sort=descending]").inner_text().startswith("strain")
    assert order() == ["1", "0", "2"]
    words = page.locator("#figures th:nth-child(3) button")
    words.click()
    assert order() == ["0", "1", "2"]  # signs before numbers, 9 before 10
    words.click()
    assert order() == ["2", "1", "0"]


def test_names_and_values_stay_text(tmp_path: Path, visit: Visit) -> None:
    page = visit(sweep_of(tmp_path))
    assert page.inner_text("h1") == f"s{HOSTILE}"
    assert page.locator("img:not([src^='data:'])").count() == 0
    assert HOSTILE in page.locator(".card").first.inner_text()
    assert "1 not up to date" in page.inner_text("body")
    figures = page.inner_text("#figures")
    assert figures.count("1.5") == len(STAGES)
    assert figures.count("shared") == 2 * len(STAGES)


def test_a_file_that_is_no_table_is_refused(tmp_path: Path) -> None:
    for text, message in (("{", "not JSON"), ("[]", "not a table"), ('{"format": 9}', "not a table")):
        (tmp_path / "sweep.json").write_text(text)
        with pytest.raises(InputError, match=message):
            write_sweep_page(tmp_path / "sweep.json")
    with pytest.raises(InputError, match="no such file"):
        write_sweep_page(tmp_path / "none.json")
