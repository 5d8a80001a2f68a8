"""`ringlet sweep`: what is shared, what one failure stops, and the table of all runs."""

import csv
import json
from pathlib import Path
from typing import Any

import fake_ringlet
import pytest
from small_configs import SWATCH

from pipeline.batch.stages import Batch
from pipeline.cli.main import call
from pipeline.errors import InputError

CONFIG = f"""\
{SWATCH}[simulate]
frames = 2
[sweep]
"simulate.hair.young_modulus" = ["2 GPa", "4 GPa"]
"scene.lights[0].irradiance" = [1, 2]
"""


class Sweep:
    def __init__(self, folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
        self.config, self.outputs, self.capsys = folder / "x.toml", folder / "outputs", capsys
        self.config.write_text(CONFIG)

    def __call__(self, *arguments: str, code: int = 0) -> tuple[list[str], str]:
        """Run it; returns the stages that ran, and standard error."""
        log = self.config.parent / "log"
        log.write_text("")
        assert call(["sweep", str(self.config), "--outputs", str(self.outputs), *arguments]) == code
        self.printed, error = self.capsys.readouterr()
        return log.read_text().splitlines(), error

    def table(self) -> dict[str, Any]:
        table: dict[str, Any] = json.loads((self.outputs / "x/sweep.json").read_text())
        return table


@pytest.fixture
def sweep(tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Sweep:
    fake_ringlet.fake(monkeypatch)
    monkeypatch.setenv("RINGLET_TEST_LOG", str(tmp_path / "log"))
    return Sweep(tmp_path, capsys)


def test_what_no_value_touches_is_made_once(sweep: Sweep) -> None:
    ran, said = sweep()
    assert sorted(ran) == sorted(["groom", "interpolate", *2 * ["simulate"], *4 * ["render 1 2"]])
    assert "simulate: the same as that of x@young_modulus=2GPa,irradiance=1" in said
    assert sweep()[0] == []
    sweep.config.write_text(CONFIG.replace("[1, 2]", "[1, 2, 3]"))
    assert sweep()[0] == ["render 1 2", "render 1 2"]


def test_the_config_without_its_sweep_shares_with_it(sweep: Sweep) -> None:
    sweep()
    assert call(["run", str(sweep.config), "--outputs", str(sweep.outputs)]) == 0
    assert "simulate: the same as that of x@young_modulus=4GPa,irradiance=1" in sweep.capsys.readouterr().err


def test_only_some_experiments(sweep: Sweep) -> None:
    sweep("--only", "young_modulus=4GPa,*")
    made = [row["name"] for row in sweep.table()["runs"] if row["complete"]]
    assert made == ["x@young_modulus=4GPa,irradiance=1", "x@young_modulus=4GPa,irradiance=2"]
    _, said = sweep("--only", "young_modulus=5GPa", code=2)
    assert "fits none of these experiments" in said
    assert "  x@young_modulus=2GPa,irradiance=1" in said


def test_the_table_has_values_metrics_times_and_paths_of_every_run(sweep: Sweep) -> None:
    sweep()
    table = sweep.table()
    assert table["keys"] == ["simulate.hair.young_modulus", "scene.lights[0].irradiance"]
    assert sweep.printed.split() == [str(sweep.outputs / "x" / name) for name in ("sweep.json", "sweep.html")]
    for row in table["runs"]:
        assert row["complete"]
        assert set(row["values"]) == set(table["keys"])
        assert row["metrics"]["strain"] == row["metrics"]["energy_bending"] == 0.5
        assert row["metrics"]["energy_gravity"] == 0
        for picture in row["pictures"]:
            assert (sweep.outputs / "x" / picture).is_file()
        assert len(row["pictures"]) == row["frames"] == 2
        assert all(
            (stage["seconds"] is None) == (stage["shared_with"] is not None)
            for stage in row["stages"].values()
        )
    owners = [row["stages"]["simulate"]["shared_with"] for row in table["runs"]]
    names = [row["name"] for row in table["runs"]]
    assert owners == [None, names[0], None, names[2]]
    with (sweep.outputs / "x/sweep.csv").open(newline="") as file:
        lines = list(csv.DictReader(file))
    assert [line["simulate.hair.young_modulus"] for line in lines] == ["2 GPa", "2 GPa", "4 GPa", "4 GPa"]
    assert [float(line["strain"]) for line in lines] == 4 * [0.5]


def test_what_is_not_made_has_no_figures(sweep: Sweep) -> None:
    sweep("--only", "*2GPa,irradiance=1")
    done, *others = sweep.table()["runs"]
    assert done["complete"]
    for row in others:
        assert not row["complete"]
        assert row["pictures"] == []
        assert set(row["metrics"].values()) == {None}


def test_one_experiment_that_fails_does_not_stop_the_others(
    sweep: Sweep, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(batch: Batch, stage: str, frames: tuple[int, ...]) -> None:
        if stage == "simulate" and batch.config.simulate.hair.young_modulus == 2e9:
            raise InputError("too soft")
        fake_ringlet.execute(batch, stage, frames)

    fake_ringlet.fake(monkeypatch, fails)
    ran, said = sweep(code=2)
    assert ran.count("render 1 2") == 2
    assert said.splitlines()[-2:] == [
        "x@young_modulus=2GPa,irradiance=1: too soft",
        "x@young_modulus=2GPa,irradiance=2: too soft",
    ]
    assert [row["complete"] for row in sweep.table()["runs"]] == [False, False, True, True]


def test_names_are_printed_without_running(sweep: Sweep) -> None:
    ran, _ = sweep("--names")
    assert ran == []
    assert sweep.printed.splitlines()[0] == "x@young_modulus=2GPa,irradiance=1"
    assert not sweep.outputs.exists()


def test_a_damaged_file_is_not_taken_over(sweep: Sweep) -> None:
    sweep("--only", "*2GPa,irradiance=1")
    path = sweep.outputs / "x@young_modulus=2GPa,irradiance=1/guides.h5"
    data = bytearray(path.read_bytes())
    path.unlink()
    path.write_bytes(data[:-50])
    ran, _ = sweep("--only", "*2GPa,irradiance=2")
    assert ran == ["simulate", "render 1 2"]


def test_status_tells_which_experiments_are_complete(sweep: Sweep) -> None:
    sweep("--only", "*2GPa,irradiance=1")
    status = ["status", str(sweep.config), "--outputs", str(sweep.outputs)]
    assert call(status) == 0
    printed = sweep.capsys.readouterr().out
    assert "1 of 4 experiments complete" in printed
    assert "x@young_modulus=4GPa,irradiance=1: groom: not made yet" in printed
    sweep()
    assert call([*status, "--json"]) == 0
    assert [each["complete"] for each in json.loads(sweep.capsys.readouterr().out)["sweep"]] == 4 * [True]


def test_a_part_of_a_sweep_writes_no_table(sweep: Sweep) -> None:
    ran, _ = sweep("--only", "*2GPa,irradiance=1", "--until", "simulate")
    assert ran == ["groom", "simulate"]
    assert sweep("--only", "*2GPa,irradiance=1", "--frames", "2")[0] == ["interpolate", "render 2"]
    assert not (sweep.outputs / "x/sweep.json").exists()
    assert "expected a range within 1-2" in sweep("--frames", "3", code=2)[1]
