"""A whole page in one string: one style, its scripts, and a policy that lets the browser do nothing else.

Scripts and styles are allowed by their hash (W3C, "Content Security Policy Level 3", 2.3.1), so that a name that
slipped through as markup could still not run, and nothing is fetched from anywhere.
"""

import base64
import hashlib
from collections.abc import Iterable, Sequence
from pathlib import Path

from pipeline.pages.markup import Html, join, tag

_STYLE = Path(__file__).with_name("page.css")


def document(
    title: str, body: Iterable[object], styles: Sequence[Path] = (), scripts: Sequence[Path] = ()
) -> str:
    """A page with the shared style, then `styles`, and `scripts` at its end; all its pictures are inside it."""
    style = "".join(path.read_text("utf-8") for path in (_STYLE, *styles))
    script = "".join(path.read_text("utf-8") for path in scripts)
    policy = (
        f"default-src 'none'; style-src {_allowed(style)}; script-src {_allowed(script)}; "
        f"img-src data:; base-uri 'none'; form-action 'none'"
    )
    head = tag(
        "head",
        tag("meta", charset="utf-8"),
        tag("meta", http_equiv="Content-Security-Policy", content=policy),
        tag("meta", name="viewport", content="width=device-width"),
        tag("meta", name="color-scheme", content="light dark"),
        tag("title", title),
        tag("style", Html(style)),
    )
    end = tag("script", Html(script)) if script else Html()
    return f"<!doctype html>\n{tag('html', head, tag('body', join(body), end), lang='en')}\n"


def table(head: Sequence[object], rows: Iterable[Sequence[object]], **attributes: object) -> Html:
    """A table; a column whose head begins with a space holds numbers and stands on the right."""
    numbers = [str(cell).startswith(" ") for cell in head]
    first = tag(
        "tr",
        *(
            tag("th", cell, scope="col", class_=_side(right))
            for cell, right in zip(head, numbers, strict=True)
        ),
    )
    lines = [
        tag("tr", *(tag("td", cell, class_=_side(right)) for cell, right in zip(row, numbers, strict=True)))
        for row in rows
    ]
    return tag("table", tag("thead", first), tag("tbody", *lines), **attributes)


def _side(right: bool) -> str | None:
    return "number" if right else None


def _allowed(source: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(source.encode()).digest()).decode()}'"
