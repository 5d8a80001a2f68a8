"""One static HTML page that shows pairs of pictures: side by side, swiped, blinking, their FLIP map, and their figures.

Everything is inside the file, so it opens from disk and can be stored as an artefact of CI. Pairs that are equal
get a thumbnail; each picture of the others is in the file once.
"""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipeline.compare.folders import Pair
from pipeline.compare.gates import Limits, figures
from pipeline.compare.metrics import flip_map
from pipeline.compare.pictures import Display, displayed, load_picture, renderer_of
from pipeline.errors import InputError
from pipeline.pages import Html, data_address, document, shrunk, table, tag

_HERE = Path(__file__).parent
_THUMBNAIL = 240  # [px]
_VIEWS = (
    ("side", "side by side", "1"),
    ("swipe", "swipe", "2"),
    ("blink", "blink", "3"),
    ("heat", "difference", "4"),
)
_KEYS = "Keys: j and k go from pair to pair, 1 to 4 choose the view, arrow keys move the swipe, z zooms, f filters."


def comparison_page(title: str, pairs: Sequence[Pair], notes: Sequence[str] = ()) -> str:
    """The page as a string; `notes` are lines under its title, such as unused golden pictures."""
    kinds = [_kind(pair) for pair in pairs]
    counts = {kind: kinds.count(kind) for kind in ("failed", "differs", "equal")}
    summary = f"{len(pairs)} compared: {counts['failed']} failed, {counts['differs']} differ and pass, {counts['equal']} equal"
    body = [
        tag("h1", title),
        tag("p", summary, class_="bad" if counts["failed"] else "good"),
        *(tag("p", note, class_="bad") for note in notes),
        _environments(pairs),
        _bar(counts),
        tag("main", *(_section(pair, kind) for pair, kind in zip(pairs, kinds, strict=True))),
        tag("p", "Nothing is left under this filter.", class_="faint", id="nothing", hidden=True),
        tag("footer", tag("p", _KEYS, class_="faint")),
    ]
    return document(title, body, [_HERE / "page.css"], [_HERE / "page.js"])


def heat(values: NDArray[np.float32]) -> Display:
    """Colours for (H, W) values in 0..1: black, red, yellow, white; small values are lifted by a square root."""
    v = np.sqrt(np.clip(values, 0, 1))[..., None] * 3.0 - np.array([0.0, 1.0, 2.0])
    return np.asarray(np.clip(v, 0, 1) * 255 + 0.5, np.uint8)


def environment_rows(renderers: Iterable[tuple[str | None, str | None]]) -> list[tuple[str, str]]:
    """Parts of two fingerprints that differ: (reference, new), each pair of parts once."""
    rows: dict[tuple[str, str], None] = {}
    for one, other in renderers:
        if one == other:
            continue
        left, right = ((text or "no fingerprint").split("; ") for text in (one, other))
        length = max(len(left), len(right))
        left, right = ([*parts, *[""] * (length - len(parts))] for parts in (left, right))
        rows |= {both: None for both in zip(left, right, strict=True) if both[0] != both[1]}
    return list(rows)


def _environments(pairs: Sequence[Pair]) -> Html:
    both = [(pair.reference, pair.picture) for pair in pairs]
    renderers = [(renderer_of(a), renderer_of(b)) for a, b in both if a is not None and b is not None]
    rows = environment_rows(renderers)
    if not rows:
        known = bool(renderers) and all(one for one, _ in renderers)
        same = "one renderer, one set of libraries" if known else "the pictures do not tell their renderer"
        return tag("p", f"Environment: {same}.", class_="faint")
    return tag(
        "section",
        tag("h2", "The environments differ"),
        tag("div", table(("reference", "new"), rows), class_="wide"),
        class_="card",
        id="environment",
    )


def _bar(counts: Mapping[str, int]) -> Html:
    first = "failed" if counts["failed"] else "differs" if counts["differs"] else "equal"
    names = (
        ("failed", "failed", counts["failed"]),
        ("differs", "all that differ", counts["failed"] + counts["differs"]),
    )
    filters = [*names, ("equal", "all", sum(counts.values()))]
    return tag(
        "nav",
        tag(
            "div",
            *(
                tag(
                    "button",
                    f"{text} ({count})",
                    type="button",
                    data_filter=name,
                    aria_pressed=str(name == first).lower(),
                )
                for name, text, count in filters
            ),
            role="group",
            aria_label="filter",
        ),
        tag(
            "div",
            *(
                tag(
                    "button",
                    f"{text} ",
                    tag("kbd", key),
                    type="button",
                    data_view=view,
                    aria_pressed=str(view == "side").lower(),
                )
                for view, text, key in _VIEWS
            ),
            tag("button", "zoom ", tag("kbd", "z"), type="button", id="zoom", aria_pressed="false"),
            role="group",
            aria_label="view",
        ),
        tag("input", type="search", id="search", placeholder="name", aria_label="show only names with"),
        class_="bar",
    )


def _kind(pair: Pair) -> str:
    return "failed" if pair.reasons else "equal" if pair.identical else "differs"


def _section(pair: Pair, kind: str) -> Html:
    word = {"failed": "failed", "differs": "differs, passes", "equal": "equal"}[kind]
    return tag(
        "section",
        tag("header", tag("h2", pair.name), tag("span", word, class_=f"mark {kind}")),
        *(tag("p", reason, class_="bad") for reason in pair.reasons),
        _shown(pair),
        class_="card pair",
        data_kind=kind,
        data_name=pair.name.lower(),
        tabindex="-1",
    )


def _shown(pair: Pair) -> Html:
    pictures = {
        name: _load(path)
        for name, path in (("reference", pair.reference), ("new", pair.picture))
        if path is not None
    }
    if pair.identical and pair.picture is not None:
        small = pictures["new"]
        if isinstance(small, str):
            return tag("p", small)
        return tag(
            "img",
            src=data_address(shrunk(small, _THUMBNAIL), "small"),
            alt=f"{pair.name}, equal to its reference",
        )
    figures_of = [
        tag("figure", _picture(pair.name, name, picture), tag("figcaption", name), class_=name)
        for name, picture in pictures.items()
    ]
    if pair.metrics is None or pair.reference is None or pair.picture is None:
        return tag("div", tag("div", *figures_of, class_="stage"), class_="shown")
    errors = heat(flip_map(load_picture(pair.reference), load_picture(pair.picture)))
    figures_of.append(
        tag(
            "figure",
            _picture(pair.name, "difference", errors),
            tag("figcaption", "difference (FLIP)"),
            class_="heat",
        )
    )
    swipe = tag(
        "input",
        type="range",
        min=0,
        max=100,
        step="any",
        value=50,
        aria_label=f"swipe {pair.name}: reference left, new right",
    )
    return tag(
        "div",
        tag("div", tag("div", *figures_of, class_="stage"), swipe, class_="pictures"),
        _figures(pair),
        class_="shown",
    )


def _figures(pair: Pair) -> Html:
    assert pair.metrics is not None
    changed = ("pixels that differ", f"{pair.metrics.changed:.3%}", "" if pair.limits else "none", "")
    rows = [
        (name, f"{value:.5f}", f"{limit:g}" if pair.limits else "", _verdict(kept) if pair.limits else "")
        for name, value, limit, kept in figures(pair.metrics, pair.limits or Limits())
    ]
    return tag("div", table(("figure", " value", " limit", ""), [changed, *rows]), class_="wide")


def _verdict(kept: bool) -> Html:
    return tag("span", "kept" if kept else "beyond", class_="good" if kept else "bad")


def _load(path: Path) -> Display | str:
    try:
        return displayed(load_picture(path))
    except InputError as error:
        return str(error)


def _picture(pair: str, name: str, picture: Display | str) -> Html:
    if isinstance(picture, str):
        return tag("p", picture, class_="bad")
    height, width = picture.shape[:2]
    return tag(
        "img", src=data_address(picture), alt=f"{pair}, {name}", width=width, height=height, draggable="false"
    )
