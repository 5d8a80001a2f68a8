"""`ringlet turntable`: one turn around hair that keeps still, whatever the config's own motion and camera."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from pipeline.cli.main import call

CONFIG = """\
[scene]
head = "none"
[scene.camera]
position = [0, -0.08, 0.5]
look_at = [0, -0.08, 0]
keyframes = [{ time = "1 s", position = [0, 5, 9] }]
[groom]
source = "swatch"
strands = 40
guides = 10
points = 12
[simulate]
settle = 0
[simulate.motion]
keyframes = [{ time = 0 }, { time = "0.1 s", position = [1, 0, 0] }]
[render]
size = [32, 32]
grid = 16
samples = 1
"""


def test_a_turntable_goes_once_around_and_writes_a_movie(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    config = tmp_path / "tuft.toml"
    config.write_text(CONFIG)
    assert call(["turntable", str(config), "--frames", "4", "--outputs", str(tmp_path)]) == 0
    folder = tmp_path / "tuft-turntable"
    movie = Path(capsys.readouterr().out.strip())
    assert movie.parent == folder
    assert movie.stat().st_size > 0
    frames = [np.asarray(Image.open(folder / "frames" / f"{n:04d}.png")).astype(int) for n in range(1, 5)]
    changes = [np.abs(frames[i] - frames[i - 1]).max() for i in range(4)]
    print(f"from frame to frame a pixel changes by up to {changes}")
    assert min(changes) > 10
    assert all((frame != frame[0, 0]).any() for frame in frames), "hair is in every frame"
