"""The schema is documented, exported and fits the configs that we ship."""

import json
import typing
from pathlib import Path

import pytest
from pydantic import BaseModel

from pipeline.config import Config, load
from pipeline.config.export import resolved, schema_text
from pipeline.config.units import parse_quantity

ROOT = Path(__file__).parents[2]
CONFIGS = sorted([*ROOT.glob("configs/*.toml"), *ROOT.glob("configs/*/*.toml")])


def test_the_exported_schema_is_current() -> None:
    exported = (ROOT / "configs/schema.json").read_text()
    assert exported == schema_text(), "run: make schema"


def sections(model: type[BaseModel]) -> typing.Iterator[tuple[str, str | None]]:
    for name, field in model.model_fields.items():
        yield f"{model.__name__}.{name}", field.description
        for inner in (field.annotation, *typing.get_args(field.annotation)):
            if isinstance(inner, type) and issubclass(inner, BaseModel):
                yield from sections(inner)


def test_every_option_has_a_sentence() -> None:
    silent = [name for name, description in sections(Config) if not description]
    assert silent == []


@pytest.mark.parametrize("path", CONFIGS, ids=lambda path: path.stem)
def test_every_shipped_config_is_valid(path: Path) -> None:
    if path.stem == "sintel" and not (ROOT.parent / "shared/data/sintel").is_dir():
        pytest.skip("the files of sintel are not here; its comment says where they come from")
    values = resolved(load(path))
    mine = [key for key, (_, origin) in values.items() if path.name in origin]
    print(f"{path.name}: {len(values)} values, {len(mine)} of its own")
    assert mine


def test_no_two_configs_share_a_name() -> None:
    names = [
        json.dumps(path.stem) if "name" not in path.read_text() else path.read_text() for path in CONFIGS
    ]
    assert len(set(names)) == len(names)


@pytest.mark.parametrize(
    ("text", "value"), [("12 cm", 0.12), ("-1.5e2 mm", -0.15), ("3um", 3e-6), (" 2 in ", 0.0508), (7, 7.0)]
)
def test_a_quantity_is_a_number_and_a_unit(text: str | int, value: float) -> None:
    units = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "in": 0.0254}
    assert parse_quantity(text, units) == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize(
    "wrong", ["", "cm", "12", "1 2 cm", "12 km", "1e", True, None, [1], float("nan"), "1e999 m"]
)
def test_anything_else_is_refused(wrong: object) -> None:
    with pytest.raises(ValueError, match=r"expected|unknown unit"):
        parse_quantity(wrong, {"m": 1.0, "cm": 1e-2})
