"""The report of one run, outputs/<name>/report.html: frames, times, energies, versions, warnings, values, keys."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from pipeline import cache
from pipeline.batch.stages import Batch
from pipeline.cache.atomic import remove_stale
from pipeline.compare import load_picture
from pipeline.compare.pictures import displayed
from pipeline.config import STAGES, Loaded
from pipeline.config.export import differing
from pipeline.errors import InputError
from pipeline.pages import Html, Line, data_address, document, plot, shrunk, table, tag
from pipeline.pages.plots import number
from pipeline.report.facts import Facts, Said, facts_of, frames_of, peaks_of, said_of

_HERE = Path(__file__).parent
_FRAMES, _WIDTH = 24, 320  # on the contact sheet, and how wide [px]


def run_page(loaded: Loaded, experiment: cache.Experiment) -> str:
    """The page as a string; what is not made yet is told on it."""
    batch = Batch(loaded.config, experiment)
    facts = facts_of(experiment)
    said = said_of(experiment, batch.keys)
    states = [batch.state(stage) for stage in STAGES]
    stale = [state.name for state in states if not state.fresh]
    body = [
        tag("h1", loaded.config.name),
        tag("p", _summary(loaded, stale), class_="bad" if stale else "good"),
        tag("p", "from ", tag("code", loaded.files[0]), class_="faint"),
        _warnings(said),
        _sheet(frames_of(experiment)),
        _stages(batch, facts, {state.name: state.reason for state in states}),
        _plots(experiment, loaded),
        _values(loaded),
        _versions(facts),
        _messages(said),
    ]
    return document(f"{loaded.config.name}: report", body, [_HERE / "report.css"])


def write_run_page(loaded: Loaded, experiment: cache.Experiment) -> Path:
    """Write the page into the experiment's folder; returns its path."""
    # Of a process that was killed here; a run with nothing to do removes nothing else
    remove_stale(experiment.folder)
    with cache.replacing(experiment.report) as temporary:
        temporary.write_text(run_page(loaded, experiment), "utf-8")
    return experiment.report


def _summary(loaded: Loaded, stale: Sequence[str]) -> str:
    config = loaded.config
    width, height = config.render.size
    what = f"{config.simulate.frames} frames at {config.simulate.fps:g} a second, {width} x {height}"
    return f"{what}; not up to date: {', '.join(stale)}" if stale else f"{what}, all made from this config"


def _sheet(frames: Sequence[Path]) -> Html:
    count = min(len(frames), _FRAMES)
    chosen = [frames[round(i * (len(frames) - 1) / max(count - 1, 1))] for i in range(count)]
    return (
        tag("section", tag("h2", "Frames"), tag("div", *map(_small, chosen), class_="sheet"), class_="card")
        if chosen
        else Html()
    )


def _small(frame: Path) -> Html:
    try:
        pixels = shrunk(displayed(load_picture(frame)), _WIDTH)
    except InputError as error:
        return tag("figure", tag("p", error, class_="bad"), tag("figcaption", frame.stem))
    picture = tag(
        "img",
        src=data_address(pixels, "small"),
        alt=f"frame {frame.stem}",
        width=pixels.shape[1],
        height=pixels.shape[0],
    )
    return tag(
        "figure", tag("a", picture, href=f"{frame.parent.name}/{frame.name}"), tag("figcaption", frame.stem)
    )


def _stages(batch: Batch, facts: dict[str, Facts], reasons: dict[str, str]) -> Html:
    peaks = peaks_of(batch.experiment, batch.keys)
    rows, total = [], 0.0
    for stage in STAGES:
        seconds = _seconds(batch, stage) if facts[stage].key else None
        total += seconds or 0.0
        rows.append(
            (
                stage,
                tag("span", reasons[stage], class_="good" if reasons[stage] == "fresh" else "bad"),
                f"{seconds:.1f}" if seconds is not None else "",
                f"{peaks[stage]:.2f}" if stage in peaks else "",
                facts[stage].host,
                facts[stage].written[:19].replace("T", " "),
                tag("code", facts[stage].key),
            )
        )
    head = ("stage", "state", " seconds", " peak GB", "host", "written", "key")
    return tag(
        "section",
        tag("h2", f"Stages, {total:.1f} s in all"),
        tag("div", table(head, rows), class_="wide"),
        class_="card",
        id="stages",
    )


def _seconds(batch: Batch, stage: str) -> float | None:
    try:
        return batch.seconds(stage)
    except InputError:  # damaged: the state tells
        return None


def _plots(experiment: cache.Experiment, loaded: Loaded) -> Html:
    """Energies, strain and penetration against what they may be, contacts and rounds over time."""
    try:
        with cache.open_guides(experiment.guides) as guides:
            figures, fps = guides.diagnostics, guides.fps
    except InputError:
        return Html()
    if not figures:
        return Html()
    time = (np.arange(len(next(iter(figures.values())))) / fps).tolist()
    names = ("bending", "torsion", "kinetic", "gravity")
    energies: dict[str, Any] = {name: 1e6 * figures[name] for name in names if name in figures}
    if "gravity" in energies:
        energies["gravity, from the first frame"] = energies.pop("gravity") - 1e6 * figures["gravity"][0]
    tolerance = loaded.config.simulate.tolerance
    groups: tuple[tuple[str, dict[str, Any]], ...] = (
        ("Energy of the guides [µJ]", energies),
        ("Worst strain", _with_limit(figures, "strain", 1.0, tolerance)),
        (
            "Deepest penetration [mm]",
            {"penetration": 1e3 * figures["penetration"]} if "penetration" in figures else {},
        ),
        ("Points in contact", {"contacts": figures["contacts"]} if "contacts" in figures else {}),
    )
    drawn = [
        plot(
            [Line(label, values.tolist(), label.startswith("tolerance")) for label, values in lines.items()],
            time,
            "time [s]",
            title,
        )
        for title, lines in groups
        if lines
    ]
    return tag(
        "section", tag("h2", "Simulation"), tag("div", *drawn, class_="plots"), class_="card", id="plots"
    )


def _with_limit(figures: dict[str, Any], name: str, factor: float, limit: float) -> dict[str, Any]:
    if name not in figures:
        return {}
    values = factor * figures[name]
    return {name: values, f"tolerance {number(limit)}": np.full(len(values), limit)}


def _values(loaded: Loaded) -> Html:
    rows = [
        (
            tag("code", key),
            tag("code", _short(value)),
            tag("code", _short(default)) if default is not None else "",
            tag("code", origin),
        )
        for key, (value, default, origin) in differing(loaded).items()
        if key != "name"
    ]
    shown = table(("key", "value", "default", "set in"), rows)
    return tag(
        "section",
        tag("h2", "Values that are not the default"),
        tag("div", shown, class_="wide"),
        class_="card",
        id="values",
    )


def _versions(facts: dict[str, Facts]) -> Html:
    """Libraries, kernels, renderer and code; where stages were made with different ones, each is listed."""
    rows: dict[tuple[str, str], list[str]] = {}
    for stage, fact in facts.items():
        found = fact.libraries | {"kernels": fact.kernels, "renderer": fact.renderer}
        for name, version in found.items():
            if version:
                rows.setdefault((name, str(version)), []).append(stage)
        if fact.code:
            rows.setdefault((f"code of {stage}", str(fact.code)), []).append(stage)
    lines = [(name, version, ", ".join(stages)) for (name, version), stages in rows.items()]
    shown = table(("what", "version", "stages"), lines)
    return tag(
        "section", tag("h2", "Versions"), tag("div", shown, class_="wide"), class_="card", id="versions"
    )


def _warnings(said: Sequence[Said]) -> Html:
    lines = [tag("li", f"{line.stage}: {line.text}") for line in said if line.event in ("warning", "error")]
    if not lines:
        return Html()
    return tag("section", tag("h2", "Warnings"), tag("ul", *lines), class_="card bad", id="warnings")


def _messages(said: Sequence[Said]) -> Html:
    lines = [
        (line.time[:19].replace("T", " "), line.stage, line.text) for line in said if line.event == "message"
    ]
    if not lines:
        return Html()
    shown = tag("div", table(("time", "stage", "said"), lines), class_="wide")
    return tag(
        "section",
        tag("details", tag("summary", f"What the stages said ({len(lines)} lines)"), shown),
        class_="card",
    )


def _short(value: Any) -> str:
    text = str(value)
    return text if len(text) <= 200 else f"{text[:200]}…"
