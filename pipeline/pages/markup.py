"""HTML by construction: whatever is not markup already is escaped, in text and in attributes.

tag("p", "1 < 2", class_="note")  ->  <p class="note">1 &lt; 2</p>
"""

import html
from collections.abc import Iterable
from typing import Any

_VOID = frozenset({"br", "img", "input", "link", "meta"})


class Html(str):
    """Markup; only this room and constants of the program make it."""

    __slots__ = ()


def text(value: object) -> Html:
    """Escape anything that is not markup; characters that no document may hold become U+FFFD."""
    if isinstance(value, Html):
        return value
    return Html(html.escape("".join(map(_allowed, str(value)))))


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


def _allowed(character: str) -> str:
    """What HTML calls a character: no lone surrogate (a broken file name has some) and no control character."""
    code = ord(character)
    control = (code < 32 and character not in "\t\n") or 127 <= code < 160
    return "\ufffd" if control or 0xD800 <= code < 0xE000 else character
