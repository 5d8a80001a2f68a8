"""`extends` stays in its project, whatever way it is written."""

from pathlib import Path

import pytest

from pipeline.config import load
from pipeline.config.roots import LONGEST, MARKERS, VARIABLE
from pipeline.errors import InputError


def project(folder: Path, extends: str) -> Path:
    """A config inside of a folder beside which lies another config."""
    inside = folder / "project/configs/deep"
    inside.mkdir(parents=True)
    for base in (folder / "outside.toml", folder / "project/configs/base.toml"):
        base.write_text("seed = 7\n")
    (folder / "project/configs/link.toml").symlink_to(folder / "outside.toml")
    (inside / "x.toml").write_text(f'extends = "{extends}"\n')
    return inside / "x.toml"


@pytest.mark.parametrize(
    "extends", ["../../../outside.toml", "{folder}/outside.toml", "../link.toml", "../base.toml"]
)
def test_extends_does_not_leave_the_folder_of_a_config_without_a_project(
    tmp_path: Path, extends: str
) -> None:
    config = project(tmp_path, extends.format(folder=tmp_path))
    with pytest.raises(
        InputError, match=r"lies outside of .*/deep, the folder of this project; copy it there, or"
    ) as told:
        load(config)
    print(told.value)


@pytest.mark.parametrize("marker", MARKERS)
def test_a_project_is_the_nearest_folder_with_a_marker(tmp_path: Path, marker: str) -> None:
    config = project(tmp_path, "../base.toml")
    (tmp_path / "project" / marker).mkdir()
    assert load(config).config.seed == 7
    config.write_text('extends = "../link.toml"\n')
    with pytest.raises(InputError, match=r"outside\.toml lies outside of"):
        load(config)


def test_more_folders_are_allowed_by_the_environment(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    config = project(tmp_path, "../link.toml")
    monkeypatch.setenv(VARIABLE, f"/nowhere:{tmp_path}")
    assert load(config).config.seed == 7


def test_the_current_folder_is_a_project_of_what_lies_in_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    config = project(tmp_path, "../base.toml")
    monkeypatch.chdir(tmp_path / "project")
    assert load(config).config.seed == 7


def test_a_chain_of_configs_ends(tmp_path: Path) -> None:
    for k in range(LONGEST + 1):
        (tmp_path / f"{k}.toml").write_text(f'extends = "{k + 1}.toml"\n')
    (tmp_path / f"{LONGEST + 1}.toml").touch()
    with pytest.raises(InputError, match=f"{LONGEST} configs extend one another"):
        load(tmp_path / "0.toml")
    assert load(tmp_path / "2.toml").config.name == "2"
