"""The values of a config before validation, and where each of them was set."""

import re
from collections.abc import Callable
from copy import deepcopy
from pathlib import Path
from typing import Any

from pipeline.config.schema.partings import LINES
from pipeline.config.schema.scalp import REGIONS
from pipeline.config.schema.varying import KINDS

KeyPath = tuple[str | int, ...]


class Tree:
    """Nested tables, the origin ("file:line") of every key, and the folder that file names are relative to."""

    def __init__(self, values: dict[str, Any], origins: dict[KeyPath, str]) -> None:
        self.values, self.origins = values, origins
        self.anchor: dict[KeyPath, Path] = {}

    def copy(self) -> "Tree":
        """A tree of its own."""
        tree = Tree(deepcopy(self.values), dict(self.origins))
        tree.anchor = dict(self.anchor)
        return tree

    def get(self, path: KeyPath) -> Any:
        """Return the value at a path, or None."""
        value: Any = self.values
        for part in path:
            try:
                value = value[part]
            except (LookupError, TypeError):
                return None
        return value

    def where(self, path: KeyPath) -> str:
        """Return the origin of a key, else of something in it, else of the innermost table around it that has one, or ""."""
        inside = (origin for key, origin in self.origins.items() if key[: len(path)] == path)
        if path not in self.origins and (origin := next(inside, "")):
            return origin
        for length in range(len(path), 0, -1):
            if path[:length] in self.origins:
                return self.origins[path[:length]]
        return ""

    def label(self, path: KeyPath) -> str:
        """Return "file:line: key" for a message, or "-s key" for a value from the command line."""
        where, name = self.where(path), dotted(path)
        return where if where == f"-s {name}" else ": ".join(part for part in (where, name) if part)

    def update(self, other: "Tree") -> None:
        """Lay another tree over this one: tables of one kind merge, everything else is replaced whole.

        A table's kind is its `op`, and which of `KINDS`, `LINES` or `REGIONS` it has: an operator that becomes another one keeps its name
        and its place, but none of its options.
        """
        self._merge(self.values, other.values, ())
        self.origins |= other.origins
        for path, folder in other.anchor.items():
            if other.get(path) is not None:
                self.anchor[path] = folder

    def _merge(self, mine: dict[str, Any], theirs: dict[str, Any], path: KeyPath) -> None:
        for name, value in theirs.items():
            if isinstance(value, dict) and isinstance(mine.get(name), dict) and _alike(mine[name], value):
                self._merge(mine[name], value, (*path, name))
            else:
                self._forget((*path, name))
                mine[name] = value

    def _forget(self, path: KeyPath) -> None:
        self.origins = {key: origin for key, origin in self.origins.items() if key[: len(path)] != path}

    def replace(self, path: KeyPath, value: Any) -> None:
        """Change a value that exists, keeping its origin."""
        container = self.get(path[:-1])
        container[path[-1]] = value

    def set(self, path: KeyPath, value: Any, origin: str, default: Callable[[KeyPath], Any]) -> None:
        """Set one value, making the tables above it; an element of an unset list is set in its default.

        Raises LookupError with a sentence when the path leads through something that is no table or list.
        """
        inside: Any = self.values
        for depth, part in enumerate(path[:-1]):
            if isinstance(path[depth + 1], int) and isinstance(inside, dict) and part not in inside:
                try:
                    inside[part] = default(path[: depth + 1])
                except (LookupError, TypeError):
                    raise LookupError(f"there is no list {dotted(path[: depth + 1])}") from None
            inside = (
                inside.setdefault(part, {}) if isinstance(inside, dict) else _element(inside, path, depth)
            )
        if isinstance(inside, dict):
            inside[path[-1]] = value
        else:
            _element(inside, path, len(path) - 1)
            inside[path[-1]] = value
        self._forget(path)
        self.origins[path] = origin


def _alike(mine: dict[str, Any], theirs: dict[str, Any]) -> bool:
    """Whether a table only changes values of another one, and does not put another kind of thing in its place."""
    if "op" in theirs and theirs["op"] != mine.get("op", theirs["op"]):
        return False
    for names in (KINDS, LINES, REGIONS):
        one, other = ({name for name in names if name in table} for table in (mine, theirs))
        if one and other and one != other:
            return False
    return True


def _element(inside: Any, path: KeyPath, depth: int) -> Any:
    part = path[depth]
    if not isinstance(inside, list) or not isinstance(part, int):
        raise LookupError(f"{dotted(path[:depth])} is not a table")
    if not 0 <= part < len(inside):
        raise LookupError(f"{dotted(path[:depth])} has {len(inside)} elements, counted from 0")
    return inside[part]


def dotted(path: KeyPath) -> str:
    """Write a path.

    >>> dotted(("scene", "lights", 0, "irradiance"))
    'scene.lights[0].irradiance'
    """
    text = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in path)
    return text.removeprefix(".")


def parse_key(text: str) -> KeyPath:
    """Read a path, either way of writing it.

    >>> parse_key("scene.lights[0].irradiance") == parse_key("scene.lights.0.irradiance")
    True
    """
    parts = re.split(r"[.\[\]]+", text.rstrip("]"))
    return tuple(int(part) if part.isdigit() else part for part in parts)
