"""What validation found wrong, in the user's words: "file:line: key: what is wrong, got what"."""

import difflib
import json
import types
import typing
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from pipeline.config.schema import Config
from pipeline.config.tree import KeyPath, Tree

_PHRASES = {
    "Input should be a valid integer": "expected an integer",
    "Input should be an object": "expected a table",
    "Input should be a valid": "expected a",
    "Input should": "expected to",
    "Tuple should": "expected to",
    " after validation": "",
}


def complaints(error: ValidationError, tree: Tree, path: Path) -> list[str]:
    """One line for every error, in the order of the files' lines."""
    found = [_complaint(dict(detail), tree, path) for detail in error.errors(include_url=False)]
    return [line for _, line in sorted(dict.fromkeys(found))]


def _complaint(detail: dict[str, Any], tree: Tree, path: Path) -> tuple[tuple[str, int], str]:
    kind: str = detail["type"]
    key = detail["loc"] if kind == "missing" else _written(detail["loc"], tree)
    where = tree.where(key) or str(path)
    if kind == "extra_forbidden":
        what = f"unknown key{_did_you_mean(key)}"
    elif kind == "missing":
        what = "has to be set"
    else:
        what = _sentence(detail) + (f", got {_shown(tree.get(key))}" if key else "")
    file, _, line = where.rpartition(":")
    order = (file, int(line)) if line.isdigit() else (where, 0)
    return order, f"{tree.label(key) if key else path}: {what}"


def _written(loc: KeyPath, tree: Tree) -> KeyPath:
    """Cut off what pydantic adds behind the last key that is really in the config."""
    length = len(loc)
    while length and tree.get(loc[:length]) is None:
        length -= 1
    return tuple(loc[:length])


def _sentence(detail: dict[str, Any]) -> str:
    message: str = detail["msg"]
    message = message.removeprefix("Value error, ").removesuffix(" or instance of Config")
    for pydantic, ours in _PHRASES.items():
        message = message.replace(pydantic, ours)
    return message


def _shown(value: Any) -> str:
    text = json.dumps(value, default=str, ensure_ascii=False)
    return text if len(text) <= 60 else text[:57] + "..."


def _did_you_mean(key: KeyPath) -> str:
    """Look among the neighbours first, then for the same name in another table."""
    name, table = str(key[-1]), _model(key[:-1])
    if table is not None and (close := difflib.get_close_matches(name, table.model_fields, 1)):
        return f"; did you mean {close[0]!r}?"
    everywhere = _keys(Config, "")
    elsewhere = [other for other in everywhere if other.rpartition(".")[2] == name]
    if elsewhere:
        return f"; did you mean {elsewhere[0]!r}?"
    listed = ", ".join(table.model_fields) if table else ""
    return f"; this table has {listed}" if listed else ""


def _model(path: KeyPath) -> type[BaseModel] | None:
    model: type[BaseModel] = Config
    for part in path:
        if isinstance(part, int):
            continue
        field = model.model_fields.get(part)
        inner = _section(field.annotation) if field else None
        if inner is None:
            return None
        model = inner
    return model


def _section(annotation: Any) -> type[BaseModel] | None:
    """Find the table behind `Section`, `tuple[Section, ...]` or `Section | None`."""
    if isinstance(annotation, type) and not isinstance(annotation, types.GenericAlias):
        return annotation if issubclass(annotation, BaseModel) else None
    found = (_section(argument) for argument in typing.get_args(annotation))
    return next((section for section in found if section), None)


def _keys(model: type[BaseModel], prefix: str) -> list[str]:
    names: list[str] = []
    for name, field in model.model_fields.items():
        inner = _section(field.annotation)
        names += [f"{prefix}{name}"] + (_keys(inner, f"{prefix}{name}.") if inner else [])
    return names
