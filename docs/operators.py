"""Writes docs/operators.md: every style operator, its options and an example, rendered by the project itself.

python docs/operators.py [NAME...] renders all examples, or some of them anew; `--page` writes the page alone. Examples are
the configs in docs/operators/. Each is pictured beside the config that it extends, so that a picture shows what its few
lines do. Sentences and options come from the schema, pipeline/config/schema/.
"""

import math
import re
import sys
import tomllib
from typing import Any

from panels import DOCS, rendered, side_by_side
from PIL import Image, ImageDraw
from pydantic import BaseModel, TypeAdapter
from pydantic_core import PydanticUndefined

from pipeline.config.formula import FUNCTIONS, VARIABLES
from pipeline.config.schema import Parting, Scalp
from pipeline.config.schema.style import OPERATORS, Operator
from pipeline.config.units import Angle, Length

EXAMPLES = DOCS / "operators"
PICTURES = DOCS / "pictures" / "operators"
QUALITY = 85
PAINTED = "painted.png"  # the map of an example, in EXAMPLES

VIEWS = {  # position and look_at [m] of the camera
    "front": ((0.30, 0.00, 0.80), (0.0, -0.04, 0.0)),
    "side": ((0.80, 0.02, 0.30), (0.0, -0.04, 0.0)),
    "behind": ((-0.72, 0.08, -0.44), (0.0, -0.05, -0.06)),
    "above": ((0.06, 0.52, 0.42), (0.0, 0.05, 0.03)),
    "near": ((0.42, -0.02, 0.42), (0.03, -0.03, 0.0)),
}
VIEW_OF = {
    "direction": "front",
    "length": "front",
    "trim": "side",
    "clump": "front",
    "curl": "front",
    "wave": "front",
    "frizz": "near",
    "flyaway": "front",
    "bend": "front",
    "gather": "behind",
    "fringe": "front",
    "formula": "side",
    "map": "front",
    "partings": "above",
    "scalp": "front",
    "order": "front",
}

_HEAD = """# Style operators

`[groom.style]` is an ordered stack of small operators. Each takes strands and gives strands: the first ones grow and cut
them, the later ones draw them together and wind them. This page has a section for each, with all its options; then come
[values that vary over the scalp](#values-that-vary), [partings](#partings), [the scalp](#scalp) and [order and names](#order-and-names).

In every picture the left half is the config that the example extends, the right half is the example. Examples are whole
configs, in [`docs/operators/`](operators): `ringlet run docs/operators/curl.toml` makes the right half of the one of `curl`, from the default camera.
Whole styles are in [the gallery](gallery.md).

A length is a number in metres or a string with a unit ({lengths}), an angle a number in radians or a string ({angles}). An option that
*varies* takes [a formula or a map](#values-that-vary) in place of a constant. Made by `make gallery`, which takes sentences, units and defaults from the schema.
"""

_VARYING = """## Values that vary

Options that vary take a constant or one of `{{ formula = "..." }}`, `{{ map = "file.png" }}` and
`{{ array = "name" }}`: a formula of scalp variables, an image, or an array painted on the points of the head's mesh. With `from` and
`to`, 0 of it means the one and 1 the other. A formula is in SI units and knows `+ - * / **` and:

| variable | |
|---|---|
{variables}

| function | arguments |
|---|---|
{functions}

### Formula

{formula}
### Painted map

An image is looked up by the mesh's texture coordinates or, where it has none, in the scalp's chart (the whorl in the middle, the
face at the top). The image of the example: ![the map](operators/painted.png)

{map}"""

_ORDER = """## Order and names

Operators work in the order in which a config names them, and the order is part of the style. A config that `extends` another
merges by name: what it says of an operator of the same name overrides single values, a new name is appended.

{common}

`-s groom.style.locks.count=80` does the same from the command line, for any value. `per` and `within` name clump operators
that others go by; one that is switched off still tells which strands belong together.

{example}"""


def main(wanted: list[str]) -> None:
    """Render the examples that are wanted, all by default, and write the page of all."""
    if wanted != ["--page"]:
        paint()
        for name in wanted or VIEW_OF:
            render(name)
    (DOCS / "operators.md").write_text(page())


def paint() -> None:
    """The map of an example: black for the head's left side in the scalp's chart, white for the rest."""
    picture = Image.new("L", (128, 128), 255)
    draw = ImageDraw.Draw(picture)
    draw.rectangle((0, 0, 50, 127), fill=0)
    picture.save(EXAMPLES / PAINTED)


def render(name: str) -> None:
    """Render an example and what it extends, side by side, seen by one camera."""
    example = EXAMPLES / f"{name}.toml"
    without = EXAMPLES / tomllib.loads(example.read_text())["extends"]
    position, look_at = VIEWS[VIEW_OF[name]]
    camera = (f"scene.camera.position={list(position)}", f"scene.camera.look_at={list(look_at)}")
    halves = ((without, f"operators-{name}-without"), (example, f"operators-{name}"))
    frames = [frame for config, run in halves for frame in rendered(config, run, camera, (1,))]
    side_by_side(frames, PICTURES / f"{name}.webp", QUALITY)


def page() -> str:
    """The text of the page. Raises FileNotFoundError where an operator has no example."""
    head = _HEAD.format(lengths=_units(Length), angles=_units(Angle))
    parts = [head, *(operator(name, model) for name, model in OPERATORS.items())]
    parts.append(
        _VARYING.format(
            variables=_rows(VARIABLES), functions=_rows(FUNCTIONS), formula=shown("formula"), map=shown("map")
        )
    )
    parts.append(f"## Partings\n\n{_said(Parting)}\n\n{options(Parting)}\n\n{shown('partings')}")
    parts.append(f"## Scalp\n\n{_said(Scalp)}\n\n{options(Scalp)}\n\n{shown('scalp')}")
    common = options(Operator, left_out=())
    parts.append(_ORDER.format(common=common, example=shown("order")))
    return "\n".join(parts)


def operator(name: str, model: type[Operator]) -> str:
    """The section of an operator."""
    said = model.model_fields["op"].description
    return (
        f"## {name}\n\n{said}\n\n{options(model, left_out=('op', *Operator.model_fields))}\n\n{shown(name)}"
    )


def shown(name: str) -> str:
    """An example's own lines, what its comment says, and its picture."""
    comment, *lines = (EXAMPLES / f"{name}.toml").read_text().splitlines()
    own = "\n".join(line for line in lines if not line.startswith(("extends =", "name ="))).strip()
    said = comment.removeprefix("# ")
    return (
        f"{said}\n\n```toml\n{own}\n```\n\n![without {name}, and with it](pictures/operators/{name}.webp)\n"
    )


def options(model: type[BaseModel], left_out: tuple[str, ...] = ()) -> str:
    """A table of a model's options: what they are, default and the schema's sentence."""
    schema = model.model_json_schema()
    tables = schema.get("$defs", {})
    rows = ["| option | | default | |", "|---|---|---|---|"]
    for name, field in model.model_fields.items():
        if name not in left_out:
            kind = _kind(schema["properties"][field.alias or name], tables)
            default = "required" if field.default is PydanticUndefined else _told(field.default, kind)
            said = (field.description or "").replace("|", "\\|")
            rows.append(f"| `{name}` | {kind} | {default} | {said} |")
    return "\n".join(rows)


def _kind(option: dict[str, Any], tables: dict[str, Any]) -> str:
    """What an option is, by its JSON schema: a length, an angle, one of some words, a table ..., and whether it varies."""
    text = repr(option)
    varies = ", varies" if "/Varied" in text else ""
    for kind, unit in (("length", "mm|"), ("angle", "deg|")):
        if unit in text:
            return kind + varies
    if words := _words(option):
        return " or ".join([*words, *(["a direction"] if "'array'" in text else [])])
    if (found := re.search(r"'#/\$defs/(\w+)'", text)) and not varies:
        return "table of " + ", ".join(f"`{key}`" for key in tables[found[1]]["properties"])
    if "'array'" in text and "'number'" in text:
        return "numbers"
    kinds = {"integer": "count", "number": "number", "boolean": "true or false", "string": "text"}
    return next(kind for key, kind in kinds.items() if f"'type': '{key}'" in text) + varies


def _words(option: dict[str, Any]) -> list[str]:
    """The words that an option may be, if it is one of some."""
    among = [option, *option.get("anyOf", ())]
    return [
        f'`"{word}"`'
        for part in among
        for word in part.get("enum", [part["const"]] if "const" in part else [])
    ]


def _told(value: Any, kind: str) -> str:
    """A default, in the unit that one would write."""
    match value:
        case None:
            return "unset"
        case bool():
            return str(value).lower()
        case float() if kind.startswith("length"):
            return f"{value * 100:g} cm" if abs(value) >= 0.1 else f"{value * 1000:g} mm"
        case float() if kind.startswith("angle"):
            return f"{math.degrees(value):.3g} deg"
        case float():
            return f"{value:g}"
        case ():
            return "none"
        case tuple():
            return "[" + ", ".join(_told(each, kind) for each in value) + "]"
        case _:
            return str(value)


def _units(quantity: Any) -> str:
    said: str = TypeAdapter(quantity).json_schema()["description"]
    return said.partition("units ")[2]


def _said(model: type[BaseModel]) -> str:
    return " ".join((model.__doc__ or "").split())


def _rows(table: dict[str, str]) -> str:
    return "\n".join(f"| `{name}` | {said} |" for name, said in table.items())


if __name__ == "__main__":
    main(sys.argv[1:])
