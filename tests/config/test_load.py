"""Loading configs: values, inheritance, overrides, and one clear line for everything that is wrong."""

import re
import tracemalloc
from pathlib import Path

import pytest
from small_configs import SWATCH

from pipeline.config import Loaded, load
from pipeline.errors import InputError


def write(folder: Path, name: str, text: str) -> Path:
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    return path


def complaint(folder: Path, text: str, *overrides: str) -> str:
    with pytest.raises(InputError) as caught:
        load(write(folder, "x.toml", text), overrides)
    print(caught.value)
    return str(caught.value).replace(f"{folder}/", "")


def loaded(folder: Path, text: str, *overrides: str) -> Loaded:
    return load(write(folder, "x.toml", text), overrides)


def test_values_have_units_and_defaults(tmp_path: Path) -> None:
    config = loaded(
        tmp_path, SWATCH + '[simulate]\nfps = "30 fps"\n[simulate.hair]\nradius = "40 um"\n'
    ).config
    assert config.name == "x"
    assert config.simulate.fps == 30
    assert config.simulate.hair.radius == pytest.approx(40e-6, rel=1e-15)
    assert config.simulate.hair.density == 1300


def test_a_child_overrides_tables_key_by_key_and_lists_whole(tmp_path: Path) -> None:
    write(
        tmp_path,
        "base.toml",
        'name = "base"\nseed = 5\n[scene]\nhead = "none"\n'
        "lights = [{ direction = [0, 1, 0] }, { direction = [1, 0, 0] }]\n"
        '[groom]\nsource = "swatch"\nstrands = 10\npoints = 16\n',
    )
    write(tmp_path, "middle.toml", 'extends = "base.toml"\n[groom]\nstrands = 20\n')
    result = loaded(
        tmp_path,
        'extends = "middle.toml"\n[scene]\nlights = [{ direction = [0, 0, 1] }]\n[groom]\nguides = 3\n',
    )
    config = result.config
    assert (config.name, config.seed) == ("x", 5)
    assert (config.groom.strands, config.groom.points, config.groom.guides) == (20, 16, 3)
    assert len(config.scene.lights) == 1
    assert [path.name for path in result.files] == ["x.toml", "middle.toml", "base.toml"]
    assert result.origins["groom.strands"].endswith("middle.toml:3")
    assert result.origins["groom.points"].endswith("base.toml:9")
    assert result.origins["groom.guides"].endswith("x.toml:5")


def test_files_are_relative_to_the_config_that_names_them(tmp_path: Path) -> None:
    write(tmp_path, "heads/head.ply", "ply")
    write(tmp_path, "heads/base.toml", '[scene]\nhead = "head.ply"\n')
    assert loaded(tmp_path, 'extends = "heads/base.toml"').config.scene.head == str(
        tmp_path / "heads/head.ply"
    )


def test_overrides_need_no_quotes_and_reach_into_lists(tmp_path: Path) -> None:
    config = loaded(
        tmp_path,
        SWATCH,
        "groom.swatch.length=30 cm",
        "groom.strands=7",
        "scene.lights[1].irradiance=2.5",
        "scene.lights.0.direction=[0, 1, 0]",
        "render.size=[64, 48]",
    ).config
    assert config.groom.swatch.length == pytest.approx(0.3)
    assert config.groom.strands == 7
    assert len(config.scene.lights) == 3
    assert config.scene.lights[1].irradiance == 2.5
    assert config.scene.lights[0].direction == (0, 1, 0)
    assert config.render.size == (64, 48)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[groom]\nstrnds = 5", "x.toml:2: groom.strnds: unknown key; did you mean 'strands'?"),
        (
            "[groom]\nyoung_modulus = 5",
            "x.toml:2: groom.young_modulus: unknown key; did you mean 'simulate.hair.young_modulus'?",
        ),
        ("[scefe.camera]\nup = 1", "x.toml:1: scefe: unknown key; did you mean 'scene'?"),
        ("extends.x = 1", "x.toml:1: extends: expected the name of a config"),
        ("[grooom]\nstrands = 5", "x.toml:1: grooom: unknown key; did you mean 'groom'?"),
        (
            '[simulate.hair]\nyoung_modulus = "4 GPA"',
            "x.toml:2: simulate.hair.young_modulus: unknown unit 'GPA'; use one of Pa, kPa, MPa, GPa, got \"4 GPA\"",
        ),
        (
            '[simulate.hair]\nradius = "40 s"',
            "x.toml:2: simulate.hair.radius: unknown unit 's'; use one of m, cm, mm, um, µm, in, got \"40 s\"",
        ),
        (
            '[simulate.hair]\nradius = "40"',
            'x.toml:2: simulate.hair.radius: expected a number with a unit, such as "1 m", got "40"',
        ),
        (
            '[groom.swatch]\nlength = "-3 cm"',
            'x.toml:2: groom.swatch.length: expected to be greater than 0, got "-3 cm"',
        ),
        ("[groom]\nstrands = 0", "x.toml:2: groom.strands: expected to be greater than or equal to 1, got 0"),
        ("[groom]\nstrands = 1.5", "x.toml:2: groom.strands: expected an integer, got 1.5"),
        ("[groom]\nstrands = true", "x.toml:2: groom.strands: expected an integer, got true"),
        ('[groom]\nstrands = "many"', 'x.toml:2: groom.strands: expected an integer, got "many"'),
        (
            "[render]\nexposure = inf",
            "x.toml:2: render.exposure: expected to be a finite number, got Infinity",
        ),
        ("[render]\nexposure = nan", "x.toml:2: render.exposure: expected to be a finite number, got NaN"),
        (
            '[render]\ngeometry = "tube"',
            "x.toml:2: render.geometry: expected to be 'auto', 'coverage', 'tubes', 'ribbons' or 'lines', got \"tube\"",
        ),
        ("[render]\nsize = [640]", "x.toml:2: render.size[1]: has to be set"),
        ("[[scene.lights]]\nirradiance = 1.0", "x.toml:1: scene.lights[0].direction: has to be set"),
        ('name = "a/b"', 'x.toml:1: name: expected a name of letters, digits and ._@=,+-, got "a/b"'),
        ('groom = "curly"', 'x.toml:1: groom: expected a table, got "curly"'),
        ("seed = 1\nseed = 2", "x.toml:2: not TOML: Cannot overwrite a value"),
        ("[groom\nstrands = 5", "x.toml:1: not TOML: Expected ']' at the end of a table declaration"),
        ('name = "x', "x.toml:1: not TOML: Unterminated string"),
        ('extends = "nope.toml"', "x.toml:1: extends: no such file: nope.toml"),
        ("extends = 3", "x.toml:1: extends: expected the name of a config"),
        ('extends = "x.toml"', "x.toml: extends: goes round in circles: x.toml -> x.toml"),
        ('[scene]\nhead = "head.ply"', "x.toml:2: scene.head: no such file: head.ply; give a file or"),
        ('[groom]\nsource = "wig.tfx"', "x.toml:2: groom.source: no such file: wig.tfx; give a file or"),
        ('[scene]\nhead = "none"', 'x.toml: groom.source = "procedural" needs a head'),
    ],
)
def test_one_line_tells_what_is_wrong_and_where(tmp_path: Path, text: str, message: str) -> None:
    said = complaint(tmp_path, text)
    assert said.startswith(message)
    assert "\n" not in said


def test_everything_wrong_is_told_at_once_in_the_order_of_the_lines(tmp_path: Path) -> None:
    said = complaint(
        tmp_path,
        '[scene]\nhead = "missing.ply"\n[groom]\nstrnds = 5\nguides = -1\n[render]\nsize = [1, 2, 3]\n',
        "groom.points=3",
    )
    assert len(said.splitlines()) == 5
    lines = [int(match[1]) for match in re.finditer(r"x\.toml:(\d+)", said)]
    assert lines == sorted(lines) == [2, 4, 5, 7]


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("groom.strnds=5", "-s groom.strnds: unknown key; did you mean 'strands'?"),
        ("groom.strands=-5", "-s groom.strands: expected to be greater than or equal to 1, got -5"),
        ("groom.strands", "-s groom.strands: expected key=value"),
        ("=5", "-s =5: expected key=value"),
        ("scene.lights[9].irradiance=2", "-s scene.lights[9].irradiance: scene.lights has 3 elements"),
        ("scene.head.x=2", "-s scene.head.x: scene.head is not a table"),
        ("scene.lamps[0].irradiance=2", "-s scene.lamps[0].irradiance: there is no list scene.lamps"),
        ("simulat.frames=5", "-s simulat.frames: simulat: unknown key; did you mean 'simulate'?"),
        ("groom.partings.a b.x=1", "-s groom.partings.a b.x: groom.partings.a b: expected a name of letters"),
        ("scene.head=nope.ply", "-s scene.head: no such file"),
    ],
)
def test_a_wrong_override_is_told_as_it_was_typed(tmp_path: Path, override: str, message: str) -> None:
    assert complaint(tmp_path, SWATCH, override).startswith(message)


def test_a_missing_config_is_told_with_what_is_near(tmp_path: Path) -> None:
    write(tmp_path, "curly.toml", "")
    with pytest.raises(InputError, match=r"no such config; did you mean .*curly\.toml"):
        load(tmp_path / "culry.toml")


@pytest.mark.parametrize("content", [b"\xff\xfe", b"name = '\xe9'"])
def test_a_binary_file_is_no_config(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "x.toml"
    path.write_bytes(content)
    with pytest.raises(InputError, match="cannot be read as a text file"):
        load(path)


def test_a_folder_is_no_config(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read as a text file"):
        load(tmp_path)


def test_a_key_of_very_many_parts_takes_no_room(tmp_path: Path) -> None:
    """The parser keeps every beginning of a key: 20,000 parts would be 1.6 GB."""
    write(tmp_path, "x.toml", "[scene]\n" + ".".join(["a"] * 20_000) + " = 1\n")
    tracemalloc.start()
    with pytest.raises(InputError, match="more than 32 levels deep"):
        load(tmp_path / "x.toml")
    most = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    print(f"{most / 1e6:.1f} MB")
    assert most < 20e6
