"""The performance page: every benchmark at a tiny size, and a row for each."""

import io
import json
from contextlib import redirect_stdout
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("distributed", reason='needs the extra "farm"')
from pipeline.bench import command, render_table
from pipeline.bench.page import write_page
from pipeline.bench.performance import Sizes, measure, sections
from pipeline.cli.main import call
from pipeline.errors import InputError

TINY = Sizes(16, 32, 2000, 300, 10_000, whole=False, frames=2, pixels=32, experiments=2)
CONFIG = """\
[groom]
guides = 16
[groom.style.frizz]
op = "frizz"
amplitude = "0.4 mm"
"""


def here(*words: object) -> dict[str, Any]:
    """A benchmark in this process, which saves its start."""
    printed = io.StringIO()
    with redirect_stdout(printed):
        assert call(["bench", *map(str, words), "--json"]) == 0
    found: dict[str, Any] = json.loads(printed.getvalue())
    return found


def known(what: str, *_: object) -> render_table.Row:
    """A frame that takes no time to draw: the bench of rendering has tests of its own."""
    return render_table.Row(what, 0.5, 0.25, "picture")


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Any], Path]:
    """The report of a tiny measurement, and its page."""
    folder = tmp_path_factory.mktemp("performance")
    config = folder / "tiny.toml"
    config.write_text(CONFIG)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(command, "figures", here)
        patch.setattr(render_table, "_row", known)
        report = measure(TINY, config)
    page = folder / "performance.md"
    write_page(report, sections(TINY, config), page)
    return report, page


def test_the_page_has_a_row_of_figures_for_every_benchmark(found: tuple[dict[str, Any], Path]) -> None:
    report, page = found
    lines = page.read_text().splitlines()
    config = page.parent / "tiny.toml"
    tables = sections(TINY, config)
    print(*lines, sep="\n")
    assert [measured["command"] for measured in report["measured"]] == [
        task.command for table in tables for task in table.tasks
    ]
    for table in tables:
        assert f"## {table.title}" in lines
        for task in table.tasks:
            assert any(task.command in line for line in lines)
    tables_end = lines.index(f"## {tables[0].title}")
    rows = [
        line.split("|")[2:-1] for line in lines[tables_end:] if line.startswith("| ") and "---" not in line
    ]
    assert len(rows) > len(report["measured"])
    for row in rows:
        figures = [cell for cell in row if cell.strip() and not cell.startswith(" `")]
        assert figures or not any(cell.strip() for cell in row), f"no figure: {row}"
    assert json.loads(page.with_suffix(".json").read_text()) == report


def test_the_page_tells_the_machine(found: tuple[dict[str, Any], Path]) -> None:
    report, page = found
    text = page.read_text()
    for name in ("processor", "processors", "instruction_set", "memory_gb", "date", "ringlet"):
        assert str(report["machine"][name]) in text
    assert 1 < report["machine"]["peak_gflops_float64"] < report["machine"]["peak_gflops_float32"]


def test_a_sweep_of_lights_makes_all_but_the_frames_once(found: tuple[dict[str, Any], Path]) -> None:
    sweep = found[0]["measured"][-1]["figures"]
    print(f"{sweep['overhead_s_per_experiment']} s of overhead for an experiment")
    assert sweep["experiments"] == sweep["times_render"] == 2
    assert sweep["times_groom"] == sweep["times_simulate"] == sweep["times_interpolate"] == 1
    assert 0 < sweep["overhead_s_per_experiment"] < sweep["seconds"]


def test_workers_and_one_process_draw_on_the_same_processors(found: tuple[dict[str, Any], Path]) -> None:
    farm = found[0]["measured"][-2]["figures"]
    print(farm)
    assert farm["threads"] == max(1, farm["processors"] // farm["workers"])
    assert farm["speed_up"] == pytest.approx(farm["seconds_one"] / farm["seconds_workers"], rel=0.05)
    assert min(farm[f"cpu_ms_per_frame_{who}"] for who in ("one", "held", "workers")) > 0


def test_what_is_wrong_with_a_config_is_told_as_such(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such config"):
        command.timed("groom", tmp_path / "nowhere.toml")
