"""Load a config: strict TOML, `extends`, `-s key=value`; whatever is wrong is told at once, with file:line."""

import difflib
import json
import os
import re
import tomllib
from collections.abc import Iterable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from pipeline.config.complaints import complaints
from pipeline.config.roots import LONGEST, require_within, roots_of
from pipeline.config.schema import PRESETS, Config
from pipeline.config.sequence import numbered_files
from pipeline.config.toml_lines import key_lines
from pipeline.config.tree import KeyPath, Tree, dotted, parse_key
from pipeline.config.usd_layers import layers_of
from pipeline.errors import InputError

# Keys that name a file ("*" is any), and the words that do not
FILES: dict[tuple[str, ...], tuple[str, ...]] = {
    ("scene", "head"): ("builtin", "none"),
    ("groom", "source"): ("procedural", "swatch"),
    ("groom", "pins"): (),
    ("groom", "partings", "*", "file"): (),
    ("groom", "scalp", "map"): (),
    ("groom", "style", "*", "*", "map"): (),
    ("simulate", "motion", "file"): (),
    ("simulate", "tips_file"): (),
}

_DEEPEST = 32  # levels of tables and lists in a config
_PART = re.compile(r"""[\w'"-]+|"[^"]*"|'[^']*'""")  # of a key, between dots

SEQUENCES: tuple[tuple[str, ...], ...] = (("scene", "body"),)  # keys that name numbered files


@dataclass(frozen=True)
class Loaded:
    """A config, the "file:line" that each of its keys comes from, and all files that it was read from."""

    config: Config
    origins: dict[str, str]
    files: tuple[Path, ...]


def load(path: Path, overrides: tuple[str, ...] = ()) -> Loaded:
    """Read a config file and what it extends, then apply `key=value` overrides.

    The name is the file's stem unless the file itself sets one: an experiment never shares a folder with
    the one that it extends. Raises InputError that tells everything wrong, one line each.
    """
    tree, files = read_tree(path, overrides)
    loaded, wrong = validated(tree, path, files)
    if loaded is None:
        raise InputError.joined(wrong)
    return loaded


def read_tree(path: Path, overrides: tuple[str, ...]) -> tuple[Tree, tuple[Path, ...]]:
    """The values of a config file, of what it extends and of overrides, not yet validated; and the files read."""
    files: list[Path] = []
    tree = _read(path, files, roots_of(path))
    for override in overrides:
        _override(tree, override)
    return tree, tuple(files)


def validated(tree: Tree, path: Path, files: tuple[Path, ...]) -> tuple[Loaded | None, list[str]]:
    """The config of a tree, whose paths become absolute; or None, and a line for each thing that is wrong."""
    wrong = [message for key in _naming(tree.values, FILES) if (message := _resolve(tree, key))]
    wrong += [message for key in _naming(tree.values, SEQUENCES) if (message := _resolve_sequence(tree, key))]
    try:
        config = Config.model_validate_json(json.dumps(tree.values, default=str), strict=True)
    except ValidationError as error:
        return None, wrong + complaints(error, tree, path)
    if wrong:
        return None, wrong
    return Loaded(config, {dotted(key): origin for key, origin in tree.origins.items()}, files), []


def set_value(tree: Tree, path: KeyPath, value: Any, origin: str, folder: Path) -> None:
    """Set one value; names of files in it are relative to `folder`. Raises LookupError with a sentence."""
    tree.set(path, value, origin, partial(_defaults, tree))
    named = (key for key in _naming(tree.values, (*FILES, *SEQUENCES)) if key[: len(path)] == path)
    tree.anchor |= dict.fromkeys(named, folder)


def named_files(config: Config) -> dict[tuple[str, ...], tuple[Path, ...]]:
    """The files that a config names, by key, and the layers that those of OpenUSD name. Raises InputError for a sequence with gaps."""
    values = config.model_dump(mode="json")
    alone = {key: Path(value) for key, value in _naming(values, FILES).items() if value not in _words(key)}
    files = {key: (path, *layers_of(path)) for key, path in alone.items()}
    sequences = {key: numbered_files(Path(value)) for key, value in _naming(values, SEQUENCES).items()}
    return files | sequences


def _naming(values: dict[str, Any], patterns: Iterable[tuple[str, ...]]) -> dict[tuple[str, ...], str]:
    """The keys of a tree that match one of the patterns, with their strings."""
    found: dict[tuple[str, ...], Any] = {}
    for pattern in patterns:
        level: dict[tuple[str, ...], Any] = {(): values}
        for part in pattern:
            level = {
                (*key, name): inner
                for key, table in level.items()
                if isinstance(table, dict)
                for name, inner in table.items()
                if part in ("*", name)
            }
        found |= level
    return {key: value for key, value in found.items() if isinstance(value, str)}


def _words(key: KeyPath) -> tuple[str, ...]:
    """What a key that can name a file may say instead."""
    return FILES.get(tuple(map(str, key)), ())


def _read(path: Path, files: list[Path], roots: tuple[Path, ...]) -> Tree:
    if path.resolve() in (file.resolve() for file in files):
        chain = " -> ".join(str(file) for file in [*files, path])
        raise InputError(f"{files[-1]}: extends: goes round in circles: {chain}")
    files.append(path)
    text = _text(path)
    values = _parsed(path, text)
    lines = {key: f"{path}:{line}" for key, line in key_lines(text).items()}
    values.setdefault("name", path.stem)
    own = Tree(values, lines)
    own.anchor = dict.fromkeys(_naming(values, (*FILES, *SEQUENCES)), path.parent)
    if isinstance(values.get("sweep"), dict):
        own.anchor |= {("sweep", key): path.parent for key in values["sweep"]}
    parent = values.pop("extends", None)
    if parent is None:
        return own
    where = own.label(("extends",))
    if not isinstance(parent, str):
        raise InputError(f'{where}: expected the name of a config, such as "default.toml"')
    parent = Path(os.path.normpath(path.parent / parent))
    require_within(where, parent, roots)
    if not parent.is_file():
        raise InputError(f"{where}: no such file: {parent}{_similar(parent)}")
    if len(files) == LONGEST:
        raise InputError(f"{where}: {LONGEST} configs extend one another; no more are read")
    tree = _read(parent, files, roots)
    tree.update(own)
    return tree


def _parsed(path: Path, text: str) -> dict[str, Any]:
    try:
        values = None if _long_keys(text) else tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(_syntax(path, text, str(error))) from None
    except ValueError as error:  # numbers of thousands of digits
        raise InputError(f"{path}: not a config: {error}") from None
    except RecursionError:
        values = None
    if values is None or not _shallow(values):
        raise InputError(f"{path}: values within values more than {_DEEPEST} levels deep; no config is")
    return values


def _long_keys(text: str) -> bool:
    """Whether some key has more than `_DEEPEST` parts, of which the parser keeps every beginning."""
    for line in text.splitlines():
        parts = 0
        for part in line.split("."):
            parts = parts + 1 if _PART.fullmatch(part.strip()) else 0
            if parts > _DEEPEST:
                return True
    return False


def _shallow(values: Any) -> bool:
    """Whether nothing lies deeper than `_DEEPEST` levels."""
    level = [values]
    for _ in range(_DEEPEST):
        tables = [inner for inner in level if isinstance(inner, dict | list)]
        level = [item for inner in tables for item in (inner.values() if isinstance(inner, dict) else inner)]
        if not level:
            return True
    return False


def _text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise InputError(f"{path}: no such config{_similar(path)}") from None
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: cannot be read as a text file ({error})") from None


def _similar(path: Path) -> str:
    names = [file.name for file in path.parent.glob("*.toml")]
    close = difflib.get_close_matches(path.name, names, 1, cutoff=0.7)
    return f"; did you mean {path.parent / close[0]}?" if close else ""


def _syntax(path: Path, text: str, message: str) -> str:
    match = re.search(r" \(at line (\d+), column \d+\)", message)
    line = int(match[1]) if match else text.count("\n") + 1
    return f"{path}:{line}: not TOML: {message[: match.start()] if match else message}"


def _override(tree: Tree, override: str) -> None:
    key, equals, value = override.partition("=")
    if not equals or not key.strip():
        raise InputError(f'-s {override}: expected key=value, such as -s "simulate.hair.radius=45 um"')
    path = parse_key(key.strip())
    try:
        set_value(tree, path, _scalar(value.strip()), f"-s {dotted(path)}", Path.cwd())
    except LookupError as error:
        raise InputError(f"-s {key.strip()}: {error.args[0]}") from None


def _scalar(value: str) -> Any:
    """Read a TOML value; what is none is a string, so that quotes are not needed in a shell."""
    try:
        return tomllib.loads(f"value = {value}")["value"]
    except (ValueError, RecursionError):
        return value


def _defaults(tree: Tree, path: KeyPath) -> Any:
    """Look up the default of a list, of which an override sets one element; that of lights is their preset's."""
    lighting = tree.get(("scene", "lighting"))
    preset = {"scene": {"lighting": lighting}} if lighting in PRESETS else {}
    value: Any = Config.model_validate({"name": "default"} | preset).model_dump(mode="json")
    for part in path:
        value = value[part]
    return value


def _resolve(tree: Tree, key: KeyPath) -> str | None:
    """Make a file's path absolute, relative to the config that names it; return what is wrong with it."""
    value, words = tree.get(key), _words(key)
    if value in words:
        return None
    file = (tree.anchor[key] / Path(value).expanduser()).resolve()
    tree.replace(key, str(file))
    if file.is_file():
        return None
    listed = ", ".join(f'"{word}"' for word in words)
    remedy = f"give a file or one of {listed}" if words else "check its path, which is relative to the config"
    return f"{tree.label(key)}: no such file: {file}; {remedy}"


def _resolve_sequence(tree: Tree, key: KeyPath) -> str | None:
    """Make the pattern of a sequence absolute; return what is wrong with its files."""
    value = tree.get(key)
    pattern = tree.anchor[key].resolve() / Path(value).expanduser()
    tree.replace(key, str(pattern))
    try:
        numbered_files(pattern)
    except InputError as error:
        return f"{tree.label(key)}: {error}"
    return None
