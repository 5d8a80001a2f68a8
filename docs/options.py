"""Writes the reference of all options from the config's JSON schema: a section for each table of the TOML file.

Sphinx calls `write` when it begins to build (conf.py); the page is not kept in the repository.
"""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from pipeline.config.export import schema_text

Schema = dict[str, Any]

_HEAD = """# Every option

Generated from the schema that configs are checked against. Numbers are SI; a quantity may also be written as a string with one of the
units that its line names. `ringlet config CONFIG` shows what a config resolves to, and the line each value comes from.
"""
_TABLE = "| key | what it takes | default | |\n|---|---|---|---|"
_WORDS = {
    "number": "number",
    "integer": "whole number",
    "boolean": "`true`, `false`",
    "string": "text",
    "object": "table",
}
_SIGNS = {"minimum": "≥", "exclusiveMinimum": ">", "maximum": "≤", "exclusiveMaximum": "<"}


def write(path: Path) -> None:
    """Write the page."""
    schema = json.loads(schema_text())
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join([_HEAD, *Page(schema["$defs"]).sections(schema, "", "Of a config file.")]))


class Page:
    """The sections of the page; `named` are the schemas that others refer to."""

    def __init__(self, named: dict[str, Schema]) -> None:
        self.named = named

    def sections(self, table: Schema, name: str, about: str) -> Iterator[str]:
        """The section of one table, then those of the tables in it."""
        rows, inner = [], []
        for key, option in table["properties"].items():
            path = f"{name}.{key}" if name else key
            tables = list(self._tables(path, option))
            inner += tables
            if not any(title == path for title, *_ in tables):
                rows.append(self._row(key, option))
        yield f"## {_title(name)}\n\n{about}\n"
        if rows:
            yield "\n".join([_TABLE, *rows, ""])
        for title, schema, text in inner:
            yield from self.sections(schema, title, text)

    def _tables(self, path: str, option: Schema) -> Iterator[tuple[str, Schema, str]]:
        """The tables that an option is or holds: (path, schema, what it is)."""
        option = self._followed(option)
        about = option.get("description", "")
        if "properties" in option:
            yield path, option, about
        for held in option.get("patternProperties", {}).values():
            for kind in self._kinds(held):
                operator = kind["properties"].get("op", {}).get("const")
                title = f'{path}.NAME], op = "{operator}"' if operator else f"{path}.NAME"
                yield title, kind, kind.get("description", about)
        for kind in self._kinds(option.get("items", {})):
            if "properties" in kind:
                yield f"[{path}]", kind, about

    def _followed(self, option: Schema) -> Schema:
        while "$ref" in option:
            own = {name: value for name, value in option.items() if name != "$ref"}
            option = {**self.named[option["$ref"].rsplit("/", 1)[1]], **own}
        return option

    def _kinds(self, option: Schema) -> list[Schema]:
        """The alternatives of an option, flat."""
        option = self._followed(option)
        choices = option.get("anyOf") or option.get("oneOf")
        return [kind for choice in choices for kind in self._kinds(choice)] if choices else [option]

    def _row(self, key: str, option: Schema) -> str:
        default = option.get("default")
        written = "" if default is None else f"`{json.dumps(default)}`"
        about = self._followed(option).get("description", "")
        cells = (f"`{key}`", self._takes(option), written, about)
        return "| " + " | ".join(cell.replace("|", "\\|").replace("\n", " ") for cell in cells) + " |"

    def _takes(self, option: Schema) -> str:
        """What may be written, in words."""
        said = [self._one(kind) for kind in self._kinds(option)]
        return ", or ".join(dict.fromkeys(text for text in said if text))

    def _one(self, kind: Schema) -> str:
        if "const" in kind:
            return f"`{json.dumps(kind['const'])}`"
        if "enum" in kind:
            return ", ".join(f"`{json.dumps(value)}`" for value in kind["enum"])
        if "properties" in kind:
            return "`{ " + ", ".join(f"{key} = …" for key in kind["properties"]) + " }`"
        if "\\s" in kind.get("pattern", ""):
            units = kind["pattern"].rsplit("(", 1)[1].split(")")[0]
            return "a string with " + ", ".join(f"`{unit}`" for unit in units.split("|"))
        if kind.get("type") == "array":
            fixed = kind.get("prefixItems")
            return f"{len(fixed) if fixed else 'a list'} of ({self._takes((fixed or [kind['items']])[0])})"
        bounds = "".join(f" {sign} {kind[name]}" for name, sign in _SIGNS.items() if name in kind)
        return _WORDS.get(kind.get("type", ""), "") + bounds


def _title(name: str) -> str:
    if not name:
        return "Top level"
    return f"`[{name}`" if "], op" in name else f"`[{name}]`"
