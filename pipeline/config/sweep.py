"""A sweep: the experiments of a config's [sweep] table, each with values and a name of its own.

    [sweep]
    mode = "product"
    "simulate.hair.young_modulus" = ["2 GPa", "4 GPa"]
    "scene.lights[0].irradiance" = [1.0, 3.0]

gives four: "NAME@young_modulus=2GPa,irradiance=1.0" and so on.
"""

import hashlib
import itertools
import json
import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pipeline.config.load import Loaded, read_tree, set_value, validated
from pipeline.config.tree import KeyPath, Tree, dotted, parse_key
from pipeline.errors import InputError

MOST = 10_000  # experiments of one sweep
_LONGEST_NAME = 100  # characters, as the schema has it
_LONGEST_VALUE = 24
_READABLE = re.compile(r"[A-Za-z0-9._+-]+")
_FIXED = ("name", "extends", "sweep")


@dataclass(frozen=True)
class Run:
    """One experiment of a sweep, and what the sweep has set: {key: value as it is written}."""

    loaded: Loaded
    values: dict[str, Any]

    @property
    def name(self) -> str:
        return self.loaded.config.name


@dataclass(frozen=True)
class Swept:
    """A config with a sweep, and its experiments in order; the last key changes fastest."""

    base: Loaded
    mode: str
    keys: tuple[str, ...]
    runs: tuple[Run, ...]


def load_sweep(path: Path, overrides: tuple[str, ...] = ()) -> Swept:
    """Read a config and all experiments of its sweep.

    Raises InputError that tells everything wrong at once, one line each, also what is wrong with a single value or a
    single combination.
    """
    tree, files = read_tree(path, overrides)
    base, wrong = validated(tree.copy(), path, files)
    sweep = tree.values.pop("sweep", None)
    if base is not None and sweep is None:
        raise InputError(f'{path}: sweep: has to be set, as in [sweep] "simulate.theta" = [0.5, 1.0]')
    lists = {key: values for key, values in (sweep or {}).items() if key != "mode"} if _table(sweep) else {}
    wrong += [message for key in lists if (message := _wrong_key(tree, key, lists))]
    mode = sweep.get("mode", "product") if _table(sweep) else "product"
    wrong += _wrong_lists(tree, mode, lists)
    if wrong or base is None:
        raise InputError.joined(dict.fromkeys(wrong))
    runs, wrong = _runs(tree, path, files, _combinations(mode, lists), lists)
    if wrong:
        raise InputError.joined(wrong)
    return Swept(base, mode, tuple(lists), tuple(runs))


def _table(value: Any) -> bool:
    return isinstance(value, dict)


def _wrong_key(tree: Tree, key: str, lists: dict[str, Any]) -> str | None:
    path, label = parse_key(key), _label(tree, key)
    if isinstance(lists[key], dict):
        return f'{label}: expected a list of values; write a key with dots in quotes, as "simulate.theta"'
    if not isinstance(lists[key], list) or not lists[key]:
        return f"{label}: expected a list of values, got {json.dumps(lists[key], default=str)}"
    if path[0] in _FIXED:
        return f"{label}: {path[0]} cannot be swept"
    overridden = [
        other for other, origin in tree.origins.items() if origin.startswith("-s ") and _meet(other, path)
    ]
    if overridden:
        return (
            f"-s {dotted(overridden[0])}: the sweep sets it; choose experiments with --only, or edit {label}"
        )
    others = [other for other in lists if other != key and _meet(parse_key(other), path)]
    if others:
        return f"{label}: {others[0]} is swept, too, and is a part of it; leave one of them out"
    texts = [_text(value) for value in lists[key]]
    twice = [i for i, text in enumerate(texts) if text in texts[:i]]
    return (
        f"{_origin(tree, key, twice[0])}: {key}: {texts[twice[0]]} is there twice; leave one out"
        if twice
        else None
    )


def _meet(a: KeyPath, b: KeyPath) -> bool:
    """Whether one of two keys is the other, or inside it."""
    length = min(len(a), len(b))
    return a[:length] == b[:length]


def _wrong_lists(tree: Tree, mode: str, lists: dict[str, Any]) -> list[str]:
    """What is wrong with the lists together."""
    lengths = {key: len(values) for key, values in lists.items() if isinstance(values, list)}
    where = tree.where(("sweep",))
    if mode == "zip" and len(set(lengths.values())) > 1:
        most = max(lengths.values())
        return [
            f'{_label(tree, key)}: {length} values, where others have {most}; "zip" needs as many of each'
            for key, length in lengths.items()
            if length < most
        ]
    count = math.prod(lengths.values()) if mode == "product" else max(lengths.values(), default=0)
    if count > MOST:
        return [f"{where}: sweep: {count} experiments; at most {MOST} are made, leave out some values"]
    return [] if lists else [f'{where}: sweep: no key to sweep, as in "simulate.theta" = [0.5, 1.0]']


def _combinations(mode: str, lists: dict[str, list[Any]]) -> list[dict[str, int]]:
    """Which value of each list an experiment takes."""
    places = [range(len(values)) for values in lists.values()]
    rows = itertools.product(*places) if mode == "product" else zip(*places, strict=True)
    return [dict(zip(lists, row, strict=True)) for row in rows]


def _runs(
    tree: Tree, path: Path, files: tuple[Path, ...], combinations: list[dict[str, int]], lists: dict[str, Any]
) -> tuple[list[Run], list[str]]:
    """The experiments, and what is wrong with them: once what a value alone does wrong, else with its combination."""
    short, base = _short_names(list(lists)), tree.values["name"]
    runs: list[Run] = []
    wrong: dict[str, list[str]] = {}
    for places in combinations:
        values = {key: lists[key][place] for key, place in places.items()}
        name = _name(base, {short[key]: value for key, value in values.items()})
        own = tree.copy()
        own.values["name"] = name
        unset = _set(own, places, values)
        loaded, messages = validated(own, path, files)
        if loaded is not None:
            runs.append(Run(loaded, values))
        for message in unset + messages:
            known = any(message.startswith(_origin(tree, key, place)) for key, place in places.items())
            wrong.setdefault(message, []).extend([] if known else [name])
    return runs, [message + _among(names, len(combinations)) for message, names in wrong.items()]


def _set(tree: Tree, places: dict[str, int], values: dict[str, Any]) -> list[str]:
    wrong = []
    for key, value in values.items():
        origin, folder = _origin(tree, key, places[key]), tree.anchor.get(("sweep", key), Path.cwd())
        try:
            set_value(tree, parse_key(key), value, origin, folder)
        except LookupError as error:
            wrong.append(f"{origin}: {key}: {error.args[0]}")
    return wrong


def _among(names: list[str], count: int) -> str:
    """Which experiments a message is about, unless it is about a value or about all."""
    if not names or len(names) == count:
        return ""
    return f" (in {names[0]}{f' and {len(names) - 1} more' if len(names) > 1 else ''})"


def _origin(tree: Tree, key: str, place: int) -> str:
    return tree.where(("sweep", key, place))


def _label(tree: Tree, key: str) -> str:
    return f'{tree.where(("sweep", key))}: sweep."{key}"'


def _short_names(keys: list[str]) -> dict[str, str]:
    """The shortest ends of keys that tell them apart: "irradiance", or "lights.0.irradiance" where there are two."""
    paths = {key: [str(part) for part in parse_key(key)] for key in keys}
    names = {}
    for key, path in paths.items():
        lengths = range(1, len(path) + 1)
        unique = (n for n in lengths if sum(other[-n:] == path[-n:] for other in paths.values()) == 1)
        length = next(unique, len(path))
        while length < len(path) and path[-length].isdigit():
            length += 1
        names[key] = ".".join(_safe(part) for part in path[-length:])
    return names


def _name(base: str, values: dict[str, Any]) -> str:
    name = f"{base}@{','.join(f'{key}={_text(value)}' for key, value in values.items())}"
    if len(name) <= _LONGEST_NAME:
        return name
    return f"{name[: _LONGEST_NAME - 9]}-{_digest(name)}"


def _text(value: Any) -> str:
    """A value in the name of a folder: as it is where that can be read, else with a hash that tells values apart."""
    written = value if isinstance(value, str) else json.dumps(value, sort_keys=True, default=str)
    numbers = isinstance(value, list) and all(isinstance(item, int | float) for item in value)
    plain = re.sub(r"[\[\]]", "", written).replace(", ", "_") if numbers else written.replace(" ", "")
    if _READABLE.fullmatch(plain) and len(plain) <= _LONGEST_VALUE:
        return plain
    stem = _safe(Path(written).stem if isinstance(value, str) else written)[:12].strip("-")
    return f"{stem}-{_digest(written)}" if stem else _digest(written)


def _safe(text: str) -> str:
    return re.sub(r"[^A-Za-z0-9._+-]+", "-", text)


def _digest(text: str) -> str:
    return hashlib.blake2b(text.encode(), digest_size=4).hexdigest()
