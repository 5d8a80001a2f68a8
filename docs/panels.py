"""Pictures of the pages here: frames of small experiments, rendered by the project itself, side by side."""

import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from PIL import Image

DOCS = Path(__file__).parent


def rendered(config: Path, experiment: str, settings: Sequence[str], frames: Sequence[int]) -> list[Path]:
    """The frames of a config, as PNG files; `settings` are KEY=VALUE, as `ringlet run -s` takes them.

    Raises subprocess.CalledProcessError where the run fails.
    """
    command = [sys.executable, "-m", "pipeline", "run", str(config)]
    for setting in (f"name={experiment}", *settings):
        command += ["-s", setting]
    for frame in frames:
        subprocess.run([*command, "--frames", str(frame)], check=True, cwd=DOCS.parent)
    return [DOCS.parent / "outputs" / experiment / "frames" / f"{frame:04d}.png" for frame in frames]


def side_by_side(pictures: Sequence[Path], path: Path, quality: int) -> None:
    """Write pictures of one height as one WebP file, from left to right."""
    panels = [Image.open(picture).convert("RGB") for picture in pictures]
    row = Image.new("RGB", (sum(panel.width for panel in panels), panels[0].height))
    x = 0
    for panel in panels:
        row.paste(panel, (x, 0))
        x += panel.width
    path.parent.mkdir(parents=True, exist_ok=True)
    row.save(path, quality=quality)
