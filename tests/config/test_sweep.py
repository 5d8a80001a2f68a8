"""[sweep]: which experiments it makes, what they are called, and what is said about wrong values."""

import json
from pathlib import Path

import pytest
from small_configs import SWATCH

from pipeline.config import stage_keys
from pipeline.config.sweep import Swept, load_sweep
from pipeline.errors import InputError

BASE = 'name = "x"\n' + SWATCH


def swept(folder: Path, table: str, *overrides: str, base: str = BASE) -> Swept:
    path = folder / "x.toml"
    path.write_text(f"{base}[sweep]\n{table}\n")
    return load_sweep(path, overrides)


def wrong(folder: Path, table: str, *overrides: str) -> list[str]:
    """What is said, line by line, without the folder."""
    with pytest.raises(InputError) as caught:
        swept(folder, table, *overrides)
    return str(caught.value).replace(f"{folder}/", "").splitlines()


def test_a_product_is_every_combination_and_the_last_key_changes_fastest(tmp_path: Path) -> None:
    found = swept(tmp_path, '"simulate.theta" = [0.5, 1.0]\n"simulate.hair.young_modulus" = ["2 GPa", 4e9]')
    assert [run.name for run in found.runs] == [
        "x@theta=0.5,young_modulus=2GPa",
        "x@theta=0.5,young_modulus=4000000000.0",
        "x@theta=1.0,young_modulus=2GPa",
        "x@theta=1.0,young_modulus=4000000000.0",
    ]
    first = found.runs[1]
    assert first.values == {"simulate.theta": 0.5, "simulate.hair.young_modulus": 4e9}
    assert (first.loaded.config.simulate.theta, first.loaded.config.simulate.hair.young_modulus) == (0.5, 4e9)
    assert found.base.config.name == "x"
    assert all(run.loaded.config.sweep is None for run in found.runs)


def test_a_zip_takes_the_values_in_step(tmp_path: Path) -> None:
    found = swept(tmp_path, 'mode = "zip"\n"simulate.theta" = [0.5, 1.0]\n"seed" = [1, 2]')
    assert [run.name for run in found.runs] == ["x@theta=0.5,seed=1", "x@theta=1.0,seed=2"]


def test_keys_that_end_alike_are_told_apart(tmp_path: Path) -> None:
    lights = "\n".join(f'"scene.lights[{i}].irradiance" = [1, 2]' for i in (0, 2))
    names = [run.name for run in swept(tmp_path, lights).runs]
    assert names[0] == "x@lights.0.irradiance=1,lights.2.irradiance=1"
    assert len(set(names)) == 4


def test_names_are_short_safe_and_do_not_change_when_values_are_added(tmp_path: Path) -> None:
    values = [[1, 0, 0], [0.5, 0.5, 0.25], [1, 0, 1]]
    lights = [[{"direction": direction}] for direction in values]
    table = f'"scene.background" = {values}\n"scene.lights" = [' + ", ".join(
        f"[{{ direction = {light[0]['direction']} }}]" for light in lights
    )
    names = [run.name for run in swept(tmp_path, f"{table}]").runs]
    fewer = [run.name for run in swept(tmp_path, table.replace(", [1, 0, 1]]\n", "]\n") + "]").runs]
    assert names[0].startswith("x@background=1_0_0,lights=")
    assert len(set(names)) == 9
    assert set(fewer) < set(names)
    assert all(len(name) <= 100 and "/" not in name and " " not in name for name in names)


def test_a_long_name_ends_in_a_hash(tmp_path: Path) -> None:
    stiffness = [f"4{digit}23456789.25 Pa" for digit in range(3)]
    hair = {"young_modulus": stiffness, "shear_modulus": ["1123456789.25 Pa"], "damping": [0.0031234567]}
    table = [f'"simulate.hair.{key}" = {json.dumps(values)}' for key, values in hair.items()]
    names = [run.name for run in swept(tmp_path, "\n".join(table), base=BASE.replace("x", 40 * "x")).runs]
    assert len(set(names)) == 3
    assert {len(name) for name in names} == {100}


def test_a_value_may_name_a_file_relative_to_the_config(tmp_path: Path) -> None:
    (tmp_path / "a b").mkdir()
    for name in ("one", "two"):
        (tmp_path / "a b" / f"{name}.csv").write_text("frame\n")
    table = '"simulate.motion.file" = ["a b/one.csv", "a b/two.csv"]'
    found = swept(tmp_path, table)
    assert found.runs[1].loaded.config.simulate.motion.file == str(tmp_path / "a b/two.csv")
    assert found.runs[0].name.startswith("x@file=one-")
    (child := tmp_path / "sub").mkdir()
    (tmp_path / "Makefile").touch()  # one project
    (child / "y.toml").write_text('extends = "../x.toml"\n')
    inherited = load_sweep(child / "y.toml")
    assert inherited.runs[0].loaded.config.simulate.motion.file == str(tmp_path / "a b/one.csv")
    assert inherited.runs[0].name.startswith("y@file=one-")


def test_a_light_touches_only_the_key_of_the_render(tmp_path: Path) -> None:
    found = swept(tmp_path, '"scene.lights[0].irradiance" = [1, 2, 3]')
    keys = [stage_keys(run.loaded.config) for run in found.runs]
    for stage in ("groom", "simulate", "interpolate"):
        assert len({each[stage] for each in keys}) == 1
    assert len({each["render"] for each in keys}) == 3
    assert stage_keys(found.base.config)["simulate"] == keys[0]["simulate"]


def test_everything_wrong_is_told_at_once_with_its_line(tmp_path: Path) -> None:
    table = '"simulate.theta" = [0.7, 3]\n"render.smaples" = [1]\n"scene.lights[7].irradiance" = [1, 2]'
    assert sorted(wrong(tmp_path, table)) == [
        "x.toml:7: simulate.theta: expected to be less than or equal to 1, got 3",
        "x.toml:8: render.smaples: unknown key; did you mean 'samples'?",
        "x.toml:9: scene.lights[7].irradiance: scene.lights has 3 elements, counted from 0",
    ]


def test_a_combination_that_cannot_be_is_named(tmp_path: Path) -> None:
    table = '"groom.source" = ["swatch", "procedural"]\n"seed" = [1, 2]'
    (line,) = wrong(tmp_path, table)
    assert 'groom.source = "procedural" needs a head' in line
    assert line.endswith("(in x@source=procedural,seed=1 and 1 more)")


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ("", 'x.toml:6: sweep: no key to sweep, as in "simulate.theta" = [0.5, 1.0]'),
        ('"name" = ["a"]', 'x.toml:7: sweep."name": name cannot be swept'),
        ('"seed" = [1, 1]', "x.toml:7: seed: 1 is there twice; leave one out"),
        ('"simulate.theta" = 0.5', 'x.toml:7: sweep."simulate.theta": expected a list of values, got 0.5'),
        ("simulate.theta = [0.5]", "write a key with dots in quotes"),
        ('mode = "zip"\nseed = [1, 2]\n"simulate.theta" = [1]', '1 values, where others have 2; "zip" needs as many'),
        ('"scene.lights" = [[]]\n"scene.lights[0].irradiance" = [1]', "scene.lights[0].irradiance is swept, too"),
        ('mode = "all"\nseed = [1]', 'x.toml:7: sweep.mode: expected to be "product" or "zip", got "all"'),
        ("\n".join(f'"simulate.contact.{key}" = {json.dumps([0.01 * i for i in range(1, 101)])}'
                   for key in ("offset", "layer", "spacing")), "1000000 experiments; at most 10000 are made"),
    ],
)  # fmt: skip
def test_a_sweep_that_means_nothing_is_refused(tmp_path: Path, table: str, said: str) -> None:
    lines = wrong(tmp_path, table)
    assert any(said in line.replace("'", '"') for line in lines), lines


def test_a_value_from_the_command_line_holds_for_all_but_not_against_the_sweep(tmp_path: Path) -> None:
    table = '"simulate.theta" = [0.5, 1.0]'
    assert {run.loaded.config.seed for run in swept(tmp_path, table, "seed=9").runs} == {9}
    assert "the sweep sets it" in wrong(tmp_path, table, "simulate.theta=0.7")[0]


def test_a_config_without_a_sweep_is_told_so(tmp_path: Path) -> None:
    path = tmp_path / "x.toml"
    path.write_text(BASE)
    with pytest.raises(InputError, match=r"x\.toml: sweep: has to be set, as in"):
        load_sweep(path)
