"""The config for the eye: its JSON schema for editors, and every resolved value with its origin."""

import json
from typing import Any

from pipeline.config.load import Loaded
from pipeline.config.schema import Config
from pipeline.config.tree import dotted, parse_key


def schema_text() -> str:
    """Return the JSON schema of a config file; `configs/schema.json` is a copy of it."""
    schema = Config.model_json_schema()
    schema["properties"]["extends"] = {
        "type": "string",
        "description": "A config whose values hold wherever this one sets none, relative to it.",
    }
    schema["required"] = []  # the name is the file's, unless set
    return json.dumps({"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}, indent=2) + "\n"


def resolved(loaded: Loaded) -> dict[str, tuple[Any, str]]:
    """Map each dotted key to its value and to the "file:line", option or default that set it."""
    values: dict[str, tuple[Any, str]] = {}
    _collect(loaded.config.model_dump(mode="json"), "", loaded.origins, values)
    return values


def differing(loaded: Loaded) -> dict[str, tuple[Any, Any, str]]:
    """Map each key that somebody set to another value than the schema's default to its value, the default and its origin.

    The default is None where there is none, as in tables that the config names itself.
    """
    defaults: dict[str, tuple[Any, str]] = {}
    _collect(Config(name=loaded.config.name).model_dump(mode="json"), "", {}, defaults)
    unset = (None, "")
    return {
        key: (value, defaults.get(key, unset)[0], origin)
        for key, (value, origin) in resolved(loaded).items()
        if origin != "default" and (key not in defaults or value != defaults[key][0])
    }


def _collect(value: Any, key: str, origins: dict[str, str], out: dict[str, tuple[Any, str]]) -> None:
    if isinstance(value, dict):
        for name, inner in value.items():
            _collect(inner, f"{key}.{name}" if key else name, origins, out)
    elif isinstance(value, list) and any(isinstance(item, dict) for item in value):
        for index, item in enumerate(value):
            _collect(item, f"{key}[{index}]", origins, out)
    else:
        out[key] = (value, _origin(key, origins))


def _origin(key: str, origins: dict[str, str]) -> str:
    """Find who set a key; -s may have set a whole list."""
    path = parse_key(key)
    around = [origins.get(dotted(path[:length]), "") for length in range(len(path), 0, -1)]
    return around[0] or next((origin for origin in around if origin.startswith("-s ")), "default")
