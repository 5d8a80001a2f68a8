"""`ringlet import`: what is told of a groom file, and a config that makes it a groom."""

import json
from pathlib import Path

import numpy as np
import pytest

from pipeline.cli.main import call
from pipeline.config import load
from pipeline.groom.imported import load as load_groom
from pipeline.strands.formats import Ragged, read_groom
from pipeline.strands.formats.hair import write_hair


def groom(path: Path, scale: float = 1.0, widths: float | None = 7e-5) -> Path:
    """40 straight strands of 10 cm, 16 points each, one of which has no length and one a point twice."""
    points = np.zeros((40, 16, 3))
    points[..., 0] = np.arange(40)[:, None] * 1e-3
    points[..., 1] = 1 - np.linspace(0, 0.1, 16)
    points[7] = points[7, 0]
    points[9, 5] = points[9, 4]
    wide = None if widths is None else np.full(640, scale * widths, np.float32)
    pins = np.tile(np.array([2, 0], np.uint8), (40, 1))
    write_hair(path, Ragged(scale * points.reshape(-1, 3), np.full(40, 16), pins, wide))
    return path


def test_a_groom_is_described_with_what_an_import_repairs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = groom(tmp_path / "my groom.hair", scale=100)
    assert call(["import", str(path), "--unit-scale", "0.01", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert (found["strands"], found["strands_kept"], found["points"]) == (40, 39, [16, 16])
    assert found["length"] == pytest.approx([0.1, 0.1, 0.1])
    assert found["width"] == pytest.approx(7e-5)
    assert found["lower"][1] == pytest.approx(0.9)
    assert found["repairs"] == {"no_length": 1, "merged_points": 1}
    assert (found["unit_scale"], found["unit_says"], found["doubt"]) == (0.01, None, "")
    assert call(["import", str(path), "--unit-scale", "0.01", "--up-axis", "z"]) == 0
    said = capsys.readouterr().out
    for words in (
        "40 strands of 16 points",
        "unit      0.01 m (the file does not say)",
        "up axis   z",
        "lengths   10 cm to 10 cm, median 10 cm",
        "width     0.07 mm",
        "1 strand dropped, with almost no length, or too few points: 7",
        "1 strand had repeated points, merged: 9",
        'name = "my_groom"',
    ):
        assert words in said


@pytest.mark.parametrize("widths", [None, 7e-5])
def test_the_config_to_begin_with_makes_the_groom(tmp_path: Path, widths: float | None) -> None:
    path = groom(tmp_path / "groom.hair", scale=100, widths=widths)
    begin = tmp_path / "begin.toml"
    assert call(["import", str(path), "--unit-scale", "0.01", "--config", str(begin)]) == 0
    config = load(begin).config
    strands, report = load_groom(config, None)
    assert strands.points.shape == (39, 32, 3)
    assert np.abs(strands.length - 0.1).max() < 1e-6
    assert report["width"] == (None if widths is None else pytest.approx(widths))
    assert config.render.width == (None if widths is None else pytest.approx(widths))
    assert call(["import", str(path), "--config", str(begin)]) == 2  # nothing is written over


def test_strands_in_another_unit_are_doubted(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = groom(tmp_path / "groom.hair", scale=100)
    assert call(["import", str(path), "--unit-scale", "2", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["doubt"].startswith("no strand has a length")
    assert call(["import", str(path), "--unit-scale", "0.5"]) == 0
    assert "doubt     strands of 5 m are no hair: groom.unit_scale is 0.01" in capsys.readouterr().out


@pytest.mark.parametrize("ending", ["hair", "vtp", "usdc", "abc"])
def test_a_groom_is_converted(tmp_path: Path, ending: str) -> None:
    pytest.importorskip({"usdc": "pxr", "abc": "alembic3d"}.get(ending, "numpy"))
    to = tmp_path / f"out.{ending}"
    path = groom(tmp_path / "groom.hair", scale=100)
    assert call(["import", str(path), "--unit-scale", "0.01", "--to", str(to)]) == 0
    read = read_groom(to)
    assert len(read) == 39
    assert np.abs(read.points[read.first] - [[i * 1e-3, 1, 0] for i in range(40) if i != 7]).max() < 1e-7
    assert read.widths == pytest.approx(np.full(len(read.points), 7e-5))


def test_wrong_input_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = groom(tmp_path / "groom.hair")
    cases = {
        ("--unit-scale", "0"): "--unit-scale 0: expected a number above 0",
        ("--to", str(tmp_path / "x.obj")): "ringlet writes .usdc, .abc, .hair and .vtp",
        ("--up-axis", "w"): "--up-axis",
    }
    for options, message in cases.items():
        assert call(["import", str(path), *options]) == 2
        assert message in capsys.readouterr().err
    assert call(["import", str(tmp_path / "none.abc")]) == 2
    assert "none.abc: no such groom file" in capsys.readouterr().err
