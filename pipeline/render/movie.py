"""Frames put together: a movie, and a contact sheet."""

from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

from pipeline import cache
from pipeline.progress import say, track

SHEET_COLUMNS, SHEET_FRAMES, SHEET_WIDTH = 6, 24, 320


def write_movie(frames: Sequence[Path], folder: Path, fps: float) -> Path:
    """Write <folder>/<folder's name>.mp4 (h264) where PyAV is installed, else an animated PNG; returns its path.

    Without PyAV says so once; the extra `movie` installs it.
    """
    try:
        import av
    except ImportError:
        say("movie", 'PyAV is not installed: an animated PNG; for an .mp4: pip install "ringlet[movie]"')
        return _animated_png(frames, folder / f"{folder.name}.png", fps)
    path = folder / f"{folder.name}.mp4"
    with cache.replacing(path) as temporary, av.open(str(temporary), "w", format="mp4") as container:
        stream = container.add_stream("libx264", rate=Fraction(fps).limit_denominator(1001))
        stream.width, stream.height = _even(_load(frames[0])).size
        stream.pix_fmt = "yuv420p"
        stream.options = {
            "crf": "17",
            "preset": "medium",
            "threads": "1",
        }  # one thread: the same bytes every time
        with track("movie", len(frames)) as bar:
            for frame in frames:
                for packet in stream.encode(av.VideoFrame.from_image(_even(_load(frame)))):
                    container.mux(packet)
                bar.advance()
        for packet in stream.encode():
            container.mux(packet)
    return path


def write_sheet(frames: Sequence[Path], folder: Path) -> Path:
    """Write <folder>/sheet.png: up to 24 frames, evenly chosen, six in a row; returns its path."""
    from PIL import Image

    count = min(len(frames), SHEET_FRAMES)
    chosen = [frames[round(i * (len(frames) - 1) / max(count - 1, 1))] for i in range(count)]
    columns = min(SHEET_COLUMNS, count)
    first = _load(chosen[0])
    width, height = SHEET_WIDTH, max(round(SHEET_WIDTH * first.height / first.width), 1)
    sheet = Image.new("RGB", (columns * width, -(-count // columns) * height))
    for i, frame in enumerate(chosen):
        small = _load(frame).resize((width, height), Image.Resampling.LANCZOS)
        sheet.paste(small, (i % columns * width, i // columns * height))
    path = folder / "sheet.png"
    with cache.replacing(path) as temporary:
        sheet.save(temporary, "PNG", optimize=True)
    return path


def _animated_png(frames: Sequence[Path], path: Path, fps: float) -> Path:
    pictures = (_load(frame) for frame in frames)
    first = next(pictures)
    with cache.replacing(path) as temporary:
        first.save(temporary, "PNG", save_all=True, append_images=pictures, duration=1000 / fps, loop=0)
    return path


def _load(path: Path) -> Any:
    from PIL import Image

    with Image.open(path) as image:
        return image.convert("RGB")


def _even(picture: Any) -> Any:
    """Crop to even sides, which h264's colour format needs."""
    return picture.crop((0, 0, picture.width & ~1, picture.height & ~1))
