"""What validation found wrong, in the user's words: "file:line: key: what is wrong, got what"."""

import difflib
import json
import re
import types
import typing
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from pipeline.config.schema import Config
from pipeline.config.schema.style import OPERATORS
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
    details = [dict(detail) for detail in error.errors(include_url=False)]
    # A default that follows from a wrong value is no error of its own
    found = [_complaint(each, tree, path) for each in details if each["type"] != "default_factory_not_called"]
    return [line for _, line in sorted(dict.fromkeys(found))]


def _complaint(detail: dict[str, Any], tree: Tree, path: Path) -> tuple[tuple[str, int], str]:
    kind: str = detail["type"]
    loc = _untagged(detail["loc"])
    key = loc if kind == "missing" else _written(loc, tree)
    if kind == "union_tag_invalid" and isinstance(tree.get(key), dict):
        return _complaint(_operator(key, tree), tree, path)
    where = tree.where(key) or str(path)
    if kind == "extra_forbidden":
        what = f"unknown key{_did_you_mean(key, tree)}"
    elif kind == "union_tag_invalid":
        what = f"expected a table, got {_shown(tree.get(key))}"
    elif kind == "missing":
        what = "has to be set"
    else:
        what = _sentence(detail) + (f", got {_shown(tree.get(key))}" if key else "")
    file, _, line = where.rpartition(":")
    order = (file, int(line)) if line.isdigit() else (where, 0)
    return order, f"{tree.label(key) if key else path}: {what}"


def _untagged(loc: KeyPath) -> KeyPath:
    """Leave out the tags of tagged unions, which the schema writes in brackets."""
    return tuple(part for part in loc if not str(part).startswith("("))


def _operator(key: KeyPath, tree: Tree) -> dict[str, Any]:
    """The complaint about a style operator that does not say which one it is."""
    named, known = tree.get((*key, "op")), ", ".join(OPERATORS)
    if named is None:
        return {"type": "style", "loc": key, "msg": f"op has to be set to one of {known}"}
    close = difflib.get_close_matches(str(named), OPERATORS, 1)
    remedy = f"did you mean {close[0]!r}?" if close else f"there are {known}"
    return {"type": "style", "loc": (*key, "op"), "msg": f"unknown operator; {remedy}"}


def _written(loc: KeyPath, tree: Tree) -> KeyPath:
    """Cut off what pydantic adds behind the last key that is really in the config."""
    length = len(loc)
    while length and tree.get(loc[:length]) is None:
        length -= 1
    return tuple(loc[:length])


def _sentence(detail: dict[str, Any]) -> str:
    if detail["type"] == "string_pattern_mismatch":
        return f"expected a name of {_letters(detail['ctx']['pattern'])}"
    message: str = detail["msg"]
    message = message.removeprefix("Value error, ").removesuffix(" or instance of Config")
    for pydantic, ours in _PHRASES.items():
        message = message.replace(pydantic, ours)
    return message


def _letters(pattern: str) -> str:
    """What a name may consist of, from the last class of characters of its pattern."""
    others = re.findall(r"\[A-Za-z0-9(.*?)\]", pattern)[-1]
    return f"letters, digits and {others}" + (", a letter first" if pattern.startswith("^[A-Za-z]") else "")


def _shown(value: Any) -> str:
    text = json.dumps(value, default=str, ensure_ascii=False)
    return text if len(text) <= 60 else text[:57] + "..."


def _did_you_mean(key: KeyPath, tree: Tree) -> str:
    """Look among the neighbours first, then for the same name in another table."""
    name, table = str(key[-1]), _model(key[:-1], tree)
    if table is not None and (close := difflib.get_close_matches(name, _names(table), 1)):
        return f"; did you mean {close[0]!r}?"
    if table is not None and table in OPERATORS.values():
        having = [operator for operator, model in OPERATORS.items() if name in _names(model)]
        return f"; operators that have it: {', '.join(having)}" if having else _all_of(table)
    everywhere = _keys(Config, "")
    elsewhere = [other for other in everywhere if other.rpartition(".")[2] == name]
    if elsewhere:
        return f"; did you mean {elsewhere[0]!r}?"
    return _all_of(table) if table else ""


def _all_of(table: type[BaseModel]) -> str:
    return f"; this table has {', '.join(_names(table))}"


def _model(path: KeyPath, tree: Tree) -> type[BaseModel] | None:
    """The table of options at a path; which one a style operator is, its value tells."""
    annotation: Any = Config
    for depth, part in enumerate(path):
        if isinstance(part, int):
            continue
        if typing.get_origin(annotation) is dict:  # of tables with names of their own
            annotation = typing.get_args(annotation)[1]
            continue
        model = _chosen(annotation, tree.get(path[:depth]))
        fields = model.model_fields if model else {}
        annotation = next((f.annotation for name, f in fields.items() if (f.alias or name) == part), None)
    return None if typing.get_origin(annotation) is dict else _chosen(annotation, tree.get(path))


def _chosen(annotation: Any, value: Any) -> type[BaseModel] | None:
    sections = list(_sections(annotation))
    named = OPERATORS.get(str(value.get("op"))) if isinstance(value, dict) else None
    return named if named in sections else next(iter(sections), None)


def _names(model: type[BaseModel]) -> list[str]:
    return [field.alias or name for name, field in model.model_fields.items()]


def _sections(annotation: Any) -> Iterator[type[BaseModel]]:
    """Find the tables behind `Section`, `tuple[Section, ...]`, `Section | None` and the like."""
    if isinstance(annotation, type) and not isinstance(annotation, types.GenericAlias):
        if issubclass(annotation, BaseModel):
            yield annotation
        return
    for argument in typing.get_args(annotation):
        yield from _sections(argument)


def _keys(model: type[BaseModel], prefix: str) -> list[str]:
    keys: list[str] = []
    for name, field in model.model_fields.items():
        key = f"{prefix}{field.alias or name}"
        own = ".NAME" if typing.get_origin(field.annotation) is dict else ""
        keys += [
            key,
            *(inner for section in _sections(field.annotation) for inner in _keys(section, f"{key}{own}.")),
        ]
    return keys
