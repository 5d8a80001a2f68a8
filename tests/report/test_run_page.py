"""The report of a run tells what was made, from what, how long it took, and what was wrong."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from small_runs import Make, add_to_log

Visit = Callable[[Path], Any]
HOSTILE = "<img src=x onerror=alert(1)>"


def lines(folder: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in (folder / "log.jsonl").read_text().splitlines()]


def test_a_run_leaves_its_report(make: Make, visit: Visit) -> None:
    folder = make("x", "simulate.theta=0.7")
    page = visit(folder / "report.html")
    assert page.title() == "x: report"
    text = page.inner_text("body")
    assert "5 frames at 24 a second, 1280 x 720, all made from this config" in text
    assert page.locator(".sheet img").count() == 5
    assert page.locator(".sheet img").evaluate_all(
        "all => all.every(image => image.complete && image.naturalWidth > 0)"
    )
    stages = page.locator("#stages tbody tr").all_inner_texts()
    assert [row.split()[:2] for row in stages] == [
        [stage, "fresh"] for stage in ("groom", "simulate", "interpolate", "render")
    ]
    keys = {record["key"] for record in lines(folder) if record["event"] == "begin"}
    assert len(keys) == 4
    assert all(key in text for key in keys)
    values = page.locator("#values tbody tr").all_inner_texts()
    assert any(row.startswith("simulate.theta\t0.7\t0.6\t-s simulate.theta") for row in values)
    assert any("x.toml:3" in row and row.startswith("simulate.frames\t5\t") for row in values)
    assert any("base.toml:6" in row for row in values)
    assert not any("\tdefault" in row for row in values)
    assert "numpy" in page.inner_text("#versions")
    assert "gl <1>; vtk 1" in page.inner_text("#versions")


def test_plots_have_one_curve_for_each_figure(make: Make, visit: Visit) -> None:
    page = visit(make("x") / "report.html")
    assert page.locator("#plots figcaption").all_inner_texts() == [
        "Energy of the guides [µJ]",
        "Worst strain",
        "Deepest penetration [mm]",
        "Points in contact",
    ]
    assert page.locator("#plots svg").first.locator("path").count() == 4
    assert "gravity, from the first frame" in page.inner_text("#plots")


def test_warnings_are_those_of_the_files_that_are_there(make: Make, visit: Visit) -> None:
    folder = make("x")
    key = next(r["key"] for r in lines(folder) if r["event"] == "begin" and r["stage"] == "simulate")
    for run, made_from, text in (("1", key, f"now {HOSTILE}"), ("2", "another", "long ago")):
        add_to_log(folder, run=run, stage="simulate", event="begin", key=made_from)
        add_to_log(folder, run=run, stage="simulate", event="warning", text=text)
    for broken in ([1, 2], "text", {"event": "warning"}, {"run": [1], "stage": {}, "event": 3}):
        with (folder / "log.jsonl").open("a") as file:
            file.write(json.dumps(broken) + "\n")
    make("x", command="report")
    page = visit(folder / "report.html")
    assert page.inner_text("#warnings").splitlines()[-1] == f"simulate: now {HOSTILE}"
    assert "long ago" not in page.inner_text("body")


def test_what_is_stale_missing_or_damaged_is_told(make: Make, visit: Visit) -> None:
    folder = make("x")
    (folder / "frames" / "0002.png").write_bytes(b"no picture")
    (folder / "strands.h5").write_bytes(b"no file")
    make("x", "simulate.theta=0.7", command="report")
    page = visit(folder / "report.html")
    assert "not up to date: simulate, interpolate, render" in page.inner_text("body")
    assert "simulate.theta: 0.6 -> 0.7" in page.inner_text("#stages")
    assert "0002.png: not a readable picture" in page.inner_text(".sheet")


def test_a_report_of_nothing_is_a_page_too(make: Make, visit: Visit) -> None:
    folder = make("y", command="report")
    page = visit(folder / "report.html")
    assert page.inner_text("#stages").count("not made yet") == 4
