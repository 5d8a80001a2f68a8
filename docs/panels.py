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
    """Write pictures of one size as one WebP file, from left to right."""
    sheet([Image.open(picture).convert("RGB") for picture in pictures], len(pictures), path, quality)


def sheet(panels: Sequence[Image.Image], across: int, path: Path, quality: int) -> None:
    """Write panels of one size as one WebP file, row by row."""
    width, height = panels[0].size
    whole = Image.new("RGB", (across * width, -(-len(panels) // across) * height))
    for k, panel in enumerate(panels):
        whole.paste(panel, (k % across * width, k // across * height))
    path.parent.mkdir(parents=True, exist_ok=True)
    whole.save(path, quality=quality)
