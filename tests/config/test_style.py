"""The style in configs: operators keep their order, merge by name, and every mistake is told with its line."""

from pathlib import Path

import pytest
from small_configs import SWATCH

from pipeline.config import load, stage_keys
from pipeline.config.formula import FUNCTIONS, VARIABLES, parse
from pipeline.config.schema import Clump, Curl, Frizz, Lengths
from pipeline.errors import InputError
from tests.config.test_load import complaint, loaded, write

STYLE = """\
[groom.style.tufts]
op = "clump"
count = 50
[groom.style.curls]
op = "curl"
radius = "5 mm"
per = "tufts"
[groom.style.frizz]
op = "frizz"
"""
BASE = SWATCH + STYLE


def test_operators_come_in_the_order_of_the_file(tmp_path: Path) -> None:
    style = loaded(tmp_path, BASE).config.groom.style
    assert list(style) == ["tufts", "curls", "frizz"]
    assert [type(op) for op in style.values()] == [Clump, Curl, Frizz]


def test_a_child_overrides_single_values_and_appends_operators(tmp_path: Path) -> None:
    write(tmp_path, "base.toml", BASE)
    child = 'extends = "base.toml"\n[groom.style.cut]\nop = "length"\n[groom.style.curls]\npitch = "3 cm"\n'
    style = loaded(tmp_path, child, "groom.style.curls.onset=1 cm").config.groom.style
    curls = style["curls"]
    assert list(style) == ["tufts", "curls", "frizz", "cut"]
    assert isinstance(curls, Curl)
    assert (curls.radius, curls.pitch, curls.onset, curls.per) == (0.005, 0.03, 0.01, "tufts")


def test_an_operator_goes_before_another_one(tmp_path: Path) -> None:
    write(tmp_path, "base.toml", BASE)
    child = 'extends = "base.toml"\n[groom.style.cut]\nop = "length"\nbefore = "curls"\n'
    assert list(loaded(tmp_path, child).config.groom.style) == ["tufts", "cut", "curls", "frizz"]


def test_another_operator_of_the_same_name_keeps_the_place_and_no_option(tmp_path: Path) -> None:
    write(tmp_path, "base.toml", BASE)
    style = loaded(tmp_path, 'extends = "base.toml"\n[groom.style.curls]\nop = "length"\n').config.groom.style
    assert list(style) == ["tufts", "curls", "frizz"]
    assert isinstance(style["curls"], Lengths)


def test_a_value_that_varies_is_replaced_by_another_kind_whole(tmp_path: Path) -> None:
    base = (
        SWATCH + '[groom.style.cut]\nop = "length"\nlength = { formula = "height", from = 0.1, to = 0.2 }\n'
    )
    write(tmp_path, "base.toml", base)
    kept, other = 'length.to = "30 cm"', 'length = { array = "long" }'
    for text, ends in ((kept, (0.1, 0.3)), (other, None)):
        style = loaded(tmp_path, f'extends = "base.toml"\n[groom.style.cut]\n{text}\n').config.groom.style
        length = getattr(style["cut"], "length")  # noqa: B009, of any operator
        assert length.ends == ends


def test_the_order_of_operators_changes_the_key_of_the_groom(tmp_path: Path) -> None:
    blocks = [f"[groom.style{block}" for block in STYLE.split("[groom.style")[1:]]
    keys = [
        stage_keys(loaded(tmp_path, SWATCH + "".join(order)).config)["groom"]
        for order in (blocks, blocks, [blocks[0], blocks[2], blocks[1]])
    ]
    assert keys[0] == keys[1] != keys[2]


def test_a_map_is_relative_to_its_config_and_counts_by_content(tmp_path: Path) -> None:
    cut = (
        SWATCH
        + '[groom.style.cut]\nop = "length"\nlength = { map = "long.png", from = "1 cm", to = "9 cm" }\n'
    )
    keys = []
    for folder, content in (("a", b"one"), ("b", b"one"), ("c", b"two")):
        path = write(tmp_path, f"{folder}/base.toml", cut)
        (path.parent / "long.png").write_bytes(content)
        child = loaded(tmp_path, f'extends = "{folder}/base.toml"\n').config
        assert f"{tmp_path}/{folder}/long.png" in str(child.groom.style["cut"])
        keys.append(stage_keys(child)["groom"])
    assert keys[0] == keys[1] != keys[2]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('op = "crul"', "x.toml:2: groom.style.a.op: unknown operator; did you mean 'curl'?, got \"crul\""),
        ('op = "spin"', "x.toml:2: groom.style.a.op: unknown operator; there are direction, length, trim,"),
        ("count = 3", "x.toml:1: groom.style.a: op has to be set to one of direction, length, trim,"),
        ('op = "curl"\nradus = 1', "x.toml:3: groom.style.a.radus: unknown key; did you mean 'radius'?"),
        (
            'op = "frizz"\npitch = 1',
            "x.toml:3: groom.style.a.pitch: unknown key; operators that have it: curl",
        ),
        (
            'op = "curl"\nmood = 1',
            "x.toml:3: groom.style.a.mood: unknown key; this table has enabled, before",
        ),
        (
            'op = "curl"\nradius = -1',
            "x.toml:3: groom.style.a.radius: expected to be greater than or equal to 0, got -1",
        ),
        (
            'op = "curl"\nradius = "1 s"',
            "x.toml:3: groom.style.a.radius: unknown unit 's'; use one of m, cm,",
        ),
        ('op = "trim"', "x.toml:1: groom.style.a: a trim has either a height or a sphere, got"),
        (
            'op = "curl"\nper = "b"',
            'x.toml:3: groom.style.a.per: there is no clump operator of this name, got "b"',
        ),
        (
            'op = "frizz"\nbefore = "b"',
            'x.toml:3: groom.style.a.before: there is no operator of this name, got "b"',
        ),
        (
            'op = "clump"\nwithin = "b"\n[groom.style.b]\nop = "clump"',
            "x.toml:3: groom.style.a.within: there is no clump operator before this one of this name",
        ),
        (
            'op = "clump"\ncount = 9\n[groom.style.b]\nop = "clump"\ncount = 5\nwithin = "a"',
            "x.toml:6: groom.style.b.count: within 'a' there are at least its 9 clumps, got 5",
        ),
        (
            'op = "length"\nlength = { formula = "hight" }',
            "x.toml:3: groom.style.a.length.formula: formula: unknown variable 'hight'; did you mean 'height'?",
        ),
        (
            'op = "length"\nlength = { fromula = "x" }',
            "x.toml:3: groom.style.a.length.fromula: unknown key; did you mean 'formula'?",
        ),
        (
            'op = "length"\nlength = { formula = "x", array = "y" }',
            "x.toml:3: groom.style.a.length: give one of formula, map and array, not formula and array",
        ),
        (
            'op = "length"\nlength = { map = "nope.png" }',
            "x.toml:3: groom.style.a.length.map: no such file: nope.png; check its path",
        ),
        (
            'op = "length"\nlength = { formula = "x", from = 1 }',
            "x.toml:3: groom.style.a.length: from and to go together",
        ),
    ],
)
def test_a_mistake_in_a_style_is_told_with_its_line(tmp_path: Path, text: str, message: str) -> None:
    assert complaint(tmp_path, f"[groom.style.a]\n{text}\n").startswith(message)


def test_a_wrong_override_of_an_operator_is_told_as_it_was_typed(tmp_path: Path) -> None:
    path = write(tmp_path, "x.toml", BASE)
    with pytest.raises(InputError, match=r"^-s groom\.style\.curls\.radius: unknown unit 'm/s'"):
        load(path, ("groom.style.curls.radius=3 m/s",))


@pytest.mark.parametrize(
    "text",
    [
        "__import__('os').system('true')",
        "height.__class__",
        "[height for x in y]",
        "(lambda: 1)()",
        "x if y else z",
        "x := 3",
        "'text'",
        "True",
        "x[0]",
        "x and y",
        "x @ y",
        "noise(scale=3)",
        "min(*x)",
        "f'{x}'",
        "1; 2",
        "smoothstep(0, height)",
        "open(x)",
        "(" * 250 + "x" + ")" * 250,
        "x" * 301,
        "",
    ],
)
def test_a_formula_refuses_everything_that_is_not_arithmetic(text: str) -> None:
    with pytest.raises(ValueError, match="formula") as caught:
        parse(text)
    print(caught.value)


def test_a_formula_may_use_every_variable_and_function() -> None:
    calls = [
        f"{name}({', '.join(['0.5'] * (arguments.count(',') + 1))})" for name, arguments in FUNCTIONS.items()
    ]
    for text in (" + ".join(VARIABLES), *calls, "-x ** 2 / (1 + y)"):
        parse(text)


def test_a_parting_is_moved_by_its_name_or_replaced_by_another_line(tmp_path: Path) -> None:
    """A line of another kind takes the place of the whole parting."""
    write(tmp_path, "base.toml", '[groom.partings.main]\noffset = "1 cm"\nenabled = false\n')
    (tmp_path / "line.csv").write_text("0,0\n0,0.5")
    for text in ('offset = "2 cm"', "chart = [[0, 0], [0, 0.5]]", 'file = "line.csv"'):
        main = loaded(
            tmp_path, f'extends = "base.toml"\n[groom.partings.main]\n{text}\n'
        ).config.groom.partings
        print(text, "->", main["main"])
        assert main["main"].offset == (0.02 if "offset" in text else None)
        assert (main["main"].chart is not None) == ("chart" in text)
    assert main["main"].file == str(tmp_path / "line.csv")
    assert main["main"].enabled
