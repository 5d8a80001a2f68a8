"""The table of parts, hairline, paint and grid spacings that defines the mannequin."""

import json
from functools import cache
from pathlib import Path
from typing import Any

Table = dict[str, Any]


@cache
def load_table() -> Table:
    """Read head.json, once."""
    table: Table = json.loads(Path(__file__).with_name("head.json").read_text(encoding="utf-8"))
    return table


def part(name: str) -> dict[str, Any]:
    """Look up a part of the head by its name."""
    found: dict[str, Any] = next(entry for entry in load_table()["parts"] if entry["name"] == name)
    return found
