"""The key of a stage: a hash of the validated values that it reads, of its inputs' keys and of its code.

Never of the config's text: a comment makes nothing stale, a light only the render. What went into a key is
kept with the file (`provenance`), so that `explain` can name the value that made a stage stale.
"""

import hashlib
import json
import time
from functools import cache, lru_cache
from pathlib import Path
from typing import Any

from pipeline.config.load import named_files
from pipeline.config.schema import Config
from pipeline.config.tree import KeyPath, dotted

Inputs = dict[str, Any]

STAGES = ("groom", "simulate", "interpolate", "render")

_READS: dict[str, tuple[str, ...]] = {
    "groom": (
        "seed",
        "scene.head",
        "scene.body",
        "scene.unit_scale",
        "scene.up_axis",
        "scene.face_axis",
        "scene.skin",
        "groom",
        "simulate.contact.offset",
        "simulate.contact.layer",
        "simulate.contact.spacing",
    ),
    "simulate": ("seed", "simulate"),
    "interpolate": ("seed", "interpolate"),
    "render": (
        "seed",
        "scene.background",
        "scene.environment",
        "scene.lights",
        "scene.camera",
        "render",
    ),
}
NEEDS: dict[str, tuple[str, ...]] = {
    "groom": (),
    "simulate": ("groom",),
    "interpolate": ("groom",),
    "render": ("groom", "simulate", "interpolate"),
}
"""The stages whose files each stage reads."""
_NOT_SOURCES = (".pyc", ".pyi", ".so")
_SETTLED_S = 2.0
_SHARED_CODE = ("kernels", "strands", "body", "cache")


def stage_keys(config: Config) -> dict[str, str]:
    """Key of every stage; raises OSError when a file that the config names cannot be read."""
    return {stage: _digest(inputs) for stage, inputs in stage_inputs(config).items()}


def stage_inputs(config: Config) -> dict[str, Inputs]:
    """What goes into each key, flat: {"scene.lights[0].irradiance": 4.0, ..., "stage groom": its key}."""
    values = config.model_dump(mode="json")
    for key, paths in named_files(config).items():
        _stand_in(values, key, paths)
    flat = _flat(values, ())
    flat["groom.style"] = list(values["groom"]["style"])  # operators do not commute
    stages: dict[str, Inputs] = {}
    for stage in STAGES:
        inputs: Inputs = {key: value for key, value in flat.items() if _reads(stage, key)}
        inputs |= {f"stage {name}": _digest(stages[name]) for name in NEEDS[stage]}
        stages[stage] = inputs | {"code": code_version(stage)}
    return stages


def provenance(config: Config, stage: str) -> dict[str, Any]:
    """The record that a stage's file keeps: its inputs, seed and code version, and its resolved section."""
    return {
        "stage": stage,
        "seed": config.seed,
        "config": config.model_dump(mode="json")[stage],
        "inputs": stage_inputs(config)[stage],
        "code": code_version(stage),
    }


def explain(old: Inputs, new: Inputs) -> list[str]:
    """Name what differs between two sets of inputs: "scene.lights[0].irradiance: 4.0 -> 5.0"."""
    lines = []
    for key in sorted(old.keys() | new.keys()):
        before, after = old.get(key, "unset"), new.get(key, "unset")
        if before == after:
            continue
        if key == "code":
            lines.append("the program changed")
        elif key.startswith("stage "):
            lines.append(f"{key.removeprefix('stage ')} changed")
        else:
            lines.append(f"{key}: {before} -> {after}")
    return lines


@cache
def code_version(stage: str) -> str:
    """Hash of the sources of a stage's package and of what it uses below, C++ included."""
    package = Path(__file__).parents[1]
    digest = hashlib.blake2b(digest_size=8)
    for folder in (stage, *_SHARED_CODE):
        for file in sorted((package / folder).rglob("*")):
            if file.is_file() and file.suffix not in _NOT_SOURCES:
                digest.update(f"{file.relative_to(package)}\n".encode())
                digest.update(file.read_bytes())
    return digest.hexdigest()


def file_digest(path: Path) -> str:
    """Hash of a file's content; remembered while the file system says that nobody wrote to it."""
    status = path.stat()
    if time.time() - status.st_ctime < _SETTLED_S:
        return _read_digest(path)  # it may be written once more within the same tick of the clock
    # Unlike the time of the content, that of the entry cannot be set back.
    return _digest_of(path, status.st_ino, status.st_size, status.st_ctime_ns)


@lru_cache(maxsize=4096)
def _digest_of(path: Path, *_state: int) -> str:
    return _read_digest(path)


def _read_digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, lambda: hashlib.blake2b(digest_size=8)).hexdigest()


def _stand_in(values: dict[str, Any], key: tuple[str, ...], paths: tuple[Path, ...]) -> None:
    """Put a file's content in place of its path: moving it changes nothing, editing it does."""
    table = values
    for name in key[:-1]:
        table = table[name]
    digests = [file_digest(path) for path in paths]
    more = f" and {len(paths) - 1} more" if len(paths) > 1 else ""
    content = (
        digests[0]
        if len(paths) == 1
        else hashlib.blake2b("".join(digests).encode(), digest_size=8).hexdigest()
    )
    table[key[-1]] = f"{paths[0].name}{more} ({content})"


def _flat(value: Any, path: KeyPath) -> Inputs:
    if isinstance(value, dict):
        items: Any = value.items()
    elif isinstance(value, list) and any(isinstance(item, dict) for item in value):
        items = enumerate(value)
    else:
        return {dotted(path): value}
    return {key: leaf for name, inner in items for key, leaf in _flat(inner, (*path, name)).items()}


def _reads(stage: str, key: str) -> bool:
    return any(key == name or key.startswith((f"{name}.", f"{name}[")) for name in _READS[stage])


def _digest(inputs: Inputs) -> str:
    text = json.dumps(inputs, sort_keys=True)
    return hashlib.blake2b(text.encode(), digest_size=16).hexdigest()
