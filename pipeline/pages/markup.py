"""HTML by construction: whatever is not markup already is escaped, in text and in attributes.

tag("p", "1 < 2", class_="note")  ->  <p class="note">1 &lt; 2</p>
"""

import html
import re
from collections.abc import Iterable
from typing import Any

# Control characters, and lone surrogates, which a broken file name has.
_FORBIDDEN = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\ud800-\udfff]")
_VOID = frozenset({"br", "img", "input", "link", "meta"})


class Html(str):
    """Markup; only this room and constants of the program make it."""

    __slots__ = ()


def text(value: object) -> Html:
    """Escape anything that is not markup; characters that no document may hold become U+FFFD."""
    if isinstance(value, Html):
        return value
    return Html(html.escape(_FORBIDDEN.sub("\ufffd", str(value))))


def join(parts: Iterable[object]) -> Html:
    """Put parts one after the other, each escaped unless it is markup."""
    return Html("".join(map(text, parts)))


def tag(name: str, /, *children: object, **attributes: Any) -> Html:
    """One element. Attributes: `class_` is class, `data_at` is data-at; True has no value; None and False are left out."""
    inside = "".join(
        f" {_attribute(key)}" if value is True else f' {_attribute(key)}="{text(value)}"'
        for key, value in attributes.items()
        if value is not None and value is not False
    )
    start = f"<{name}{inside}>"
    return Html(start) if name in _VOID else Html(f"{start}{join(children)}</{name}>")


def _attribute(key: str) -> str:
    return key.rstrip("_").replace("_", "-")
