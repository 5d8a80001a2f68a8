"""Keys change with what a stage reads and with nothing else."""

from pathlib import Path

import pytest
from small_configs import ONE_LIGHT, SWATCH

from pipeline.config import Config, explain, load, stage_inputs, stage_keys
from pipeline.config.keys import STAGES

BASE = f'name = "x"\n{SWATCH}{ONE_LIGHT}[render]\nsamples = 2\n'
SIMULATE = "[simulate]\ntheta = 0.6\n"


def keys(folder: Path, text: str = BASE, *overrides: str) -> dict[str, str]:
    path = folder / "x.toml"
    path.write_text(text)
    return stage_keys(load(path, overrides).config)


def changed(folder: Path, *overrides: str) -> set[str]:
    before, after = keys(folder), keys(folder, BASE, *overrides)
    return {stage for stage in STAGES if before[stage] != after[stage]}


def test_comments_order_and_spelling_of_units_change_no_key(tmp_path: Path) -> None:
    one = BASE + "[simulate]\nframes = 9\n[simulate.hair]\nradius = 0.00004\ndensity = 1300\n"
    other = "# note\n" + one.replace("0.00004\ndensity = 1300", '"40 um"  # thin\ndensity = "1.3 g/cm^3"')
    assert keys(tmp_path, one) == keys(tmp_path, other)


def test_a_default_written_out_changes_no_key(tmp_path: Path) -> None:
    defaults = Config(name="x")
    assert changed(tmp_path, f"simulate.frames={defaults.simulate.frames}") == set()


def test_the_name_changes_no_key(tmp_path: Path) -> None:
    assert changed(tmp_path, "name=y") == set()


@pytest.mark.parametrize(
    ("override", "stages"),
    [
        ("scene.lights[0].irradiance=5", {"render"}),
        ("scene.camera.look_at=[0, 0, 0.1]", {"render"}),
        ("scene.background=[0, 0, 0]", {"render"}),
        ("render.hair.melanin=0.2", {"render"}),
        ("render.hair.dye.colour=[0.1, 0.4, 0.9]", {"render"}),
        ("render.hair.along=[{at=0, melanin=0.9}]", {"render"}),
        ("interpolate.strands=9000", {"interpolate", "render"}),
        ("simulate.theta=0.99", {"simulate", "render"}),
        ("simulate.motion.preset=nod", {"simulate", "render"}),
        ("groom.strands=50", {"groom", "simulate", "interpolate", "render"}),
        ("simulate.contact.offset=2 mm", {"groom", "simulate", "interpolate", "render"}),
        ("seed=2", {"groom", "simulate", "interpolate", "render"}),
    ],
)
def test_a_value_changes_the_stages_that_read_it(tmp_path: Path, override: str, stages: set[str]) -> None:
    assert changed(tmp_path, override) == stages


def test_a_files_content_counts_and_its_place_does_not(tmp_path: Path) -> None:
    for folder, content in (("a", "one"), ("b", "one"), ("c", "two")):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "hair.tfx").write_text(content)
    a, b, c = (keys(tmp_path, BASE, f"groom.source={tmp_path}/{folder}/hair.tfx") for folder in "abc")
    assert a == b
    assert all(a[stage] != c[stage] for stage in STAGES)


def test_the_content_of_a_motion_file_counts_for_the_simulation_alone(tmp_path: Path) -> None:
    motion = tmp_path / "head.csv"
    motion.write_text("one")
    given = keys(tmp_path, BASE, "simulate.motion.file=" + str(motion))
    motion.write_text("the other")
    edited = keys(tmp_path, BASE, "simulate.motion.file=" + str(motion))
    assert {stage for stage in STAGES if given[stage] != edited[stage]} == {"simulate", "render"}


def test_the_value_that_made_a_stage_stale_is_named(tmp_path: Path) -> None:
    path = tmp_path / "x.toml"
    path.write_text(BASE + SIMULATE)
    before = stage_inputs(load(path).config)
    after = stage_inputs(load(path, ("scene.lights[0].irradiance=5", "simulate.theta=0.7")).config)
    assert explain(before["groom"], after["groom"]) == []
    assert explain(before["simulate"], after["simulate"]) == ["simulate.theta: 0.6 -> 0.7"]
    assert explain(before["render"], after["render"]) == [
        "scene.lights[0].irradiance: 4.0 -> 5.0",
        "simulate changed",
    ]


def test_a_change_of_the_code_is_named(tmp_path: Path) -> None:
    path = tmp_path / "x.toml"
    path.write_text(BASE)
    inputs = stage_inputs(load(path).config)["groom"]
    assert explain(inputs | {"code": "older"}, inputs) == ["the program changed"]
