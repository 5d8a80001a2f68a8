"""The page of a sweep, outputs/<name>/sweep.html: the experiments side by side, their frames in step, values and metrics.

Read from sweep.json: {"name", "config", "keys", "runs": [{"name", "folder", "complete", "values", "fps", "pictures",
"stages": {stage: {"seconds", "shared_with"}}, "metrics": {...}}]}, paths relative to its folder. Small copies of the frames are in
the page, one picture for each experiment, so that they play smoothly; the full ones are linked.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np

from pipeline.cache import replacing
from pipeline.compare import load_picture
from pipeline.compare.pictures import Display, displayed
from pipeline.config import STAGES
from pipeline.errors import InputError
from pipeline.pages import Html, data_address, document, shrunk, table, tag
from pipeline.pages.plots import number

FORMAT = 1
_HERE = Path(__file__).parent
_WIDTH, _COLUMNS = 320, 6  # of one frame [px]; frames in a row of a film
_FRAMES, _ALL = 24, 480  # frames of one film, of all films of a page

Row = dict[str, Any]


@dataclass(frozen=True)
class _Figure:
    """A column of metrics: its head, and what a value in SI units is multiplied by."""

    head: str
    factor: float = 1.0


_METRICS = {
    "energy_bending": _Figure("bending µJ", 1e6),
    "energy_torsion": _Figure("torsion µJ", 1e6),
    "energy_kinetic": _Figure("kinetic µJ", 1e6),
    "energy_gravity": _Figure("gravity µJ", 1e6),
    "strain": _Figure("strain"),
    "penetration": _Figure("penetration mm", 1e3),
    "contacts": _Figure("contacts"),
}


def write_sweep_page(table_path: Path) -> Path:
    """Write sweep.html beside a sweep.json; returns its path. Raises InputError for a file that is no such table."""
    page = table_path.with_suffix(".html")
    text = sweep_page(_read(table_path), table_path.parent)
    with replacing(page) as temporary:
        temporary.write_text(text, "utf-8")
    return page


def sweep_page(sweep: Row, folder: Path) -> str:
    """The page as a string; paths in `sweep` are relative to `folder`."""
    runs: list[Row] = sweep["runs"]
    each = max(4, min(_FRAMES, _ALL // max(len(runs), 1)))
    incomplete = sum(not run["complete"] for run in runs)
    summary = f"{len(runs)} experiments, {', '.join(map(str, sweep['keys']))}"
    body = [
        tag("h1", sweep["name"]),
        tag("p", summary, class_="faint"),
        tag("p", f"{incomplete} not up to date", class_="bad") if incomplete else Html(),
        _bar(),
        tag("main", *(_card(index, run, folder, each) for index, run in enumerate(runs)), class_="films"),
        tag(
            "section",
            tag("h2", "Values and figures"),
            tag("div", _table(sweep["keys"], runs), class_="wide"),
            class_="card",
        ),
        tag("footer", tag("p", _HELP, class_="faint")),
    ]
    return document(f"{sweep['name']}: sweep", body, [_HERE / "sweep.css"], [_HERE / "sweep.js"])


_HELP = (
    "Keys: space plays, arrow keys step. A click on a column's head sorts the table and the pictures. Energies, strain and "
    "penetration are the largest of all frames, gravity is its span; a stage that another experiment made says so."
)


def _read(path: Path) -> Row:
    try:
        sweep = json.loads(path.read_text("utf-8"))
    except FileNotFoundError:
        raise InputError(f"{path}: no such file; `ringlet sweep` writes it") from None
    except ValueError as error:
        raise InputError(f"{path}: not JSON ({error})") from None
    if not isinstance(sweep, dict) or sweep.get("format") != FORMAT:
        raise InputError(f"{path}: not a table of a sweep of format {FORMAT}")
    return sweep


def _bar() -> Html:
    return tag(
        "nav",
        tag(
            "div", tag("button", "play ", tag("kbd", "space"), type="button", id="play", aria_pressed="false")
        ),
        tag(
            "input",
            type="range",
            id="time",
            min=0,
            max=0,
            step="any",
            value=0,
            aria_label="time of all films",
        ),
        tag("output", "0.00 s", id="clock"),
        tag("label", "size ", tag("input", type="range", id="size", min=120, max=640, value=300)),
        class_="bar",
    )


def _card(index: int, run: Row, folder: Path, each: int) -> Html:
    chips = [
        tag("li", tag("span", f"{key} ", class_="faint"), tag("b", _word(value)))
        for key, value in run["values"].items()
    ]
    state = Html() if run["complete"] else tag("p", "not up to date", class_="bad")
    return tag(
        "section",
        tag("h2", run["name"]),
        tag("ul", *chips, class_="chips"),
        state,
        _film(run, folder, each),
        class_="card",
        data_run=index,
    )


def _film(run: Row, folder: Path, each: int) -> Html:
    """Small frames in one picture, with the time of each; a link to the full ones."""
    names: list[str] = run["pictures"]
    if not names:
        return tag("p", "no frames yet", class_="faint")
    count = min(len(names), each)
    chosen = [names[round(i * (len(names) - 1) / max(count - 1, 1))] for i in range(count)]
    try:
        small = [shrunk(displayed(load_picture(folder / name)), _WIDTH) for name in chosen]
    except InputError as error:
        return tag("p", error, class_="bad")
    columns, strip = _strip(small)
    times = [
        (int(Path(name).stem) - 1) / run["fps"] if Path(name).stem.isdigit() else i
        for i, name in enumerate(chosen)
    ]
    height, width = small[0].shape[:2]
    return tag(
        "a",
        tag("img", src=data_address(strip, "small"), alt=f"frames of {run['name']}", draggable="false"),
        class_="film",
        href=quote(chosen[0]),
        data_times=json.dumps(times),
        data_files=json.dumps([quote(name) for name in chosen]),
        data_columns=columns,
        data_rows=-(-count // columns),
        data_shape=f"{width} / {height}",
    )


def _strip(small: Sequence[Display]) -> tuple[int, Display]:
    """Pictures of one size in rows; those of another size are left black."""
    height, width = small[0].shape[:2]
    columns = min(_COLUMNS, len(small))
    rows = -(-len(small) // columns)
    strip = np.zeros((rows * height, columns * width, 3), np.uint8)
    for i, picture in enumerate(small):
        if picture.shape[:2] == (height, width):
            y, x = i // columns * height, i % columns * width
            strip[y : y + height, x : x + width] = picture
    return columns, strip


def _table(keys: Sequence[str], runs: Sequence[Row]) -> Html:
    metrics = [name for name in _METRICS if any(run["metrics"].get(name) is not None for run in runs)]
    heads = [
        "experiment",
        *keys,
        *(f" {_METRICS[name].head}" for name in metrics),
        *(f" {stage} s" for stage in STAGES),
    ]
    buttons = [_Head(head) for head in heads]
    rows = [
        [
            _cell(run["name"], index),
            *(_cell(_word(run["values"].get(key, ""))) for key in keys),
            *(_metric(run["metrics"].get(name), _METRICS[name].factor) for name in metrics),
            *(_seconds(run["stages"].get(stage) or {}) for stage in STAGES),
        ]
        for index, run in enumerate(runs)
    ]
    return table(buttons, rows, id="figures")


class _Head(Html):
    """A head of the table: a button that sorts by its column; `str` begins as the text does, which says the side."""

    def __new__(cls, text: str) -> "_Head":
        button = tag("button", text.strip(), type="button", class_="sort")
        return super().__new__(cls, f"{' ' if text.startswith(' ') else ''}{button}")


def _cell(text: str, run: int | None = None) -> Html:
    return tag("span", text, data_value=text, data_run=run)


def _metric(value: float | None, factor: float) -> Html:
    if value is None:
        return _cell("")
    return tag("span", number(factor * value), data_value=repr(factor * value))


def _seconds(stage: Row) -> Html:
    seconds, owner = stage.get("seconds"), stage.get("shared_with")
    if owner:
        return tag("span", "shared", data_value="", title=f"made by {owner}")
    return _cell("") if seconds is None else tag("span", f"{seconds:.1f}", data_value=repr(float(seconds)))


def _word(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)
