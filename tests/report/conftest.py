"""Two small runs with stages that take no time."""

from pathlib import Path

import pytest
from fake_ringlet import fake
from small_runs import BASE, CONFIG, Make, stage

from pipeline.cli.main import call


@pytest.fixture
def make(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Make:
    """Run a config under a name, with settings; returns the experiment's folder."""
    fake(monkeypatch, stage)
    (tmp_path / "base.toml").write_text(BASE)

    def run(name: str, *settings: str, code: int = 0, command: str = "run") -> Path:
        config = tmp_path / f"{name}.toml"
        if not config.exists():
            config.write_text(CONFIG)
        chosen = [part for setting in settings for part in ("-s", setting)]
        assert call([command, str(config), "--outputs", str(tmp_path / "outputs"), *chosen]) == code
        return tmp_path / "outputs" / name

    return run
