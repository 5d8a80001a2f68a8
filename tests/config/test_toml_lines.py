"""The line of every key, for all the ways in which TOML writes one."""

import tomllib
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from pipeline.config.toml_lines import key_lines

DOCUMENT = '''\
# comment [not.a.table]
name = "a # no comment" # key = 3
"quoted key" = 1
a.b . c = 2

[scene]
text = """
[groom]
x = 1 \\""" still inside
"""
raw = \'\'\'
y = 2\'\'\'
lights = [ # first
  { direction = [0, 1, 0], irradiance = 4.0 },
  # between
  { direction = [
      1, 2, 3], "irradiance" = 1e3 },
]
[[scene.keys]]
time = 1
[scene.keys.inner]
deep = true
[[scene.keys]]
time = 1979-05-27T07:32:00Z
[a.d]
'''


def paths(value: Any, path: tuple[str | int, ...] = ()) -> set[tuple[str | int, ...]]:
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return {path} | {inner for key, item in items for inner in paths(item, (*path, key))}


def test_every_key_has_its_line() -> None:
    lines = key_lines(DOCUMENT)
    assert set(lines) == paths(tomllib.loads(DOCUMENT)) - {()}
    expected = {
        ("name",): 2,
        ("quoted key",): 3,
        ("a", "b", "c"): 4,
        ("scene",): 6,
        ("scene", "text"): 7,
        ("scene", "raw"): 11,
        ("scene", "lights"): 13,
        ("scene", "lights", 0): 14,
        ("scene", "lights", 0, "irradiance"): 14,
        ("scene", "lights", 1, "direction"): 16,
        ("scene", "lights", 1, "direction", 2): 17,
        ("scene", "lights", 1, "irradiance"): 17,
        ("scene", "keys", 0, "time"): 20,
        ("scene", "keys", 0, "inner", "deep"): 22,
        ("scene", "keys", 1, "time"): 24,
        ("a", "d"): 25,
    }
    assert {key: lines[key] for key in expected} == expected


NAMES = st.sampled_from(["a", "b", "c-d", "e_1", '"x y"', "'q'"])
VALUES = st.recursive(
    st.sampled_from(["1", "-2.5e3", "true", '"s#]}"', "'t[{'", '"""\nm"\n"""', "'''\n]'''", "inf"]),
    lambda inner: (
        st.lists(inner, max_size=3).map(lambda items: f"[\n{', '.join(items)} ]")
        | st.lists(inner, max_size=2).map(
            lambda items: "{ " + ", ".join(f"k{i} = {item}" for i, item in enumerate(items)) + " }"
        )
    ),
    max_leaves=6,
)


@given(st.lists(st.tuples(NAMES, NAMES, VALUES), max_size=6, unique_by=lambda item: item[:2]))
def test_any_document_is_followed(entries: list[tuple[str, str, str]]) -> None:
    tables: dict[str, list[str]] = {}
    for table, key, value in entries:
        tables.setdefault(table, []).append(f"{key} = {value} # note")
    text = "".join(f"[{table}]\n" + "\n".join(pairs) + "\n\n" for table, pairs in tables.items())
    lines = key_lines(text)
    assert set(lines) == paths(tomllib.loads(text)) - {()}
    for (_, *inner), line in lines.items():
        if len(inner) == 1:
            assert str(inner[0]) in text.splitlines()[line - 1]
