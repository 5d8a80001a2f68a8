"""`ringlet diff` names each value, version and frame that differs between two runs, and nothing else."""

import json
from pathlib import Path
from typing import Any

import pytest
from small_runs import Make

from pipeline.cli.main import call


def told(capsys: pytest.CaptureFixture[str], *arguments: str, code: int) -> dict[str, Any]:
    capsys.readouterr()
    assert call(["diff", *arguments, "--json"]) == code
    found: dict[str, Any] = json.loads(capsys.readouterr().out)
    return found


def test_runs_of_equal_values_are_equal_whatever_their_names(
    make: Make, capsys: pytest.CaptureFixture[str]
) -> None:
    found = told(capsys, str(make("x")), str(make("y")), code=0)
    assert found["equal"] is True
    assert found["pictures"]["both"] == 5


def test_values_and_pictures_that_differ_are_named(
    make: Make, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    x = make("x")
    y = make("y", "scene.lights[0].irradiance=5", "simulate.frames=3")
    page = tmp_path / "page.html"
    found = told(capsys, str(x), str(y), "--page", str(page), code=1)
    assert found["values"] == {"scene.lights[0].irradiance": [4.0, 5.0], "simulate.frames": [5, 3]}
    assert found["versions"] == found["stages"] == {}
    pictures = found["pictures"]
    assert (pictures["both"], pictures["only"], pictures["differ"]) == (
        3,
        [2, 0],
        ["0001.png", "0002.png", "0003.png"],
    )
    assert pictures["measured"]["0001.png"]["flip"] > 0
    assert "0003.png" in page.read_text("utf-8")
    assert call(["diff", str(x), str(y)]) == 1
    text = capsys.readouterr().out
    assert "  scene.lights[0].irradiance: 4.0 -> 5.0" in text
    assert "3 of 3 that both have differ" in text


def test_configs_stand_for_their_folders(
    make: Make, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    make("x")
    make("y", "simulate.theta=0.7")
    configs = [str(tmp_path / f"{name}.toml") for name in "xy"]
    found = told(capsys, *configs, "--outputs", str(tmp_path / "outputs"), code=1)
    assert found["values"] == {"simulate.theta": [0.6, 0.7]}


def test_versions_are_told_apart_from_values(
    make: Make, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    x = make("x")
    monkeypatch.setattr("pipeline.config.keys.code_version", lambda _stage: "newer")
    monkeypatch.setattr("pipeline.cache.store._versions", lambda: {"numpy": "9.9"})
    found = told(capsys, str(x), str(make("y")), code=1)
    assert found["values"] == {}
    assert found["versions"]["code of groom"] == ["fixed", "newer"]
    assert found["versions"]["numpy"][1] == "9.9"


def test_missing_and_damaged_stages_differ_and_an_empty_folder_is_no_run(
    make: Make, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    x, y = make("x"), make("y")
    (y / "strands.h5").unlink()
    (y / "groom.h5").write_bytes(b"?")
    found = told(capsys, str(x), str(y), code=1)
    assert found["stages"]["interpolate"] == ["made", "not made yet"]
    assert "groom.h5" in found["stages"]["groom"][1]
    (y / "frames" / "0001.png").write_bytes(b"?")
    assert "not a readable picture" in told(capsys, str(x), str(y), code=1)["pictures"]["problems"][0]
    assert call(["diff", str(x), str(tmp_path / "nothing")]) == 2
    assert "no run in this folder" in capsys.readouterr().err
