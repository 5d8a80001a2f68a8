"""Frames put together: a movie, and a contact sheet.

Movies are in BT.709 colours of limited range, and say so; but for lossless ones, which keep every bit of the frames.
The same frames give the same bytes, but for AV1: its encoder takes no such care where sides are no multiples of 64.
"""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any, Literal

from pipeline import cache
from pipeline.errors import InputError
from pipeline.progress import say, track

SHEET_COLUMNS, SHEET_FRAMES, SHEET_WIDTH = 6, 24, 320

Codec = Literal["h264", "av1", "ffv1"]
_BT709 = 1  # primaries, transfer and matrix: ITU-T H.273
_LIMITED = 1


@dataclass(frozen=True)
class _Format:
    """How a codec is written: encoders to be tried in this order, with their options."""

    encoders: Mapping[str, Mapping[str, str]]
    suffix: str
    container: str
    pixels: Mapping[int, str]
    """Pixel format by the bits of the frames."""
    lossless: bool = False


_FORMATS: dict[str, _Format] = {
    "h264": _Format(
        {
            "libx264": {"crf": "17", "preset": "medium", "threads": "1"}
        },  # one thread: the same bytes every time
        ".mp4",
        "mp4",
        {8: "yuv420p", 16: "yuv420p"},
    ),
    "av1": _Format(
        {
            "libsvtav1": {"crf": "22", "preset": "6", "svtav1-params": "lp=1"},
            "libaom-av1": {"crf": "22", "cpu-used": "6", "threads": "1", "b": "0"},
        },
        ".av1.mp4",
        "mp4",
        {8: "yuv420p10le", 16: "yuv420p10le"},
    ),
    "ffv1": _Format({"ffv1": {"level": "3"}}, ".mkv", "matroska", {8: "bgr0", 16: "gbrp16le"}, lossless=True),
}


def write_movie(frames: Sequence[Path], folder: Path, fps: float, codec: Codec | None = None) -> Path:
    """Write <folder>/<folder's name>.mp4 (h264), .av1.mp4 (av1) or .mkv (ffv1, lossless); returns its path.

    By default h264, and where PyAV is not installed an animated PNG. Raises InputError where a codec is asked for that
    is not there.
    """
    try:
        import av
    except ImportError:
        if codec is not None:
            raise InputError(f'--codec {codec} needs PyAV; pip install "ringlet[movie]"') from None
        say("movie", 'PyAV is not installed: an animated PNG; for an .mp4: pip install "ringlet[movie]"')
        return _animated_png(frames, folder / f"{folder.name}.png", fps)
    kind = _FORMATS[codec or "h264"]
    path = folder / f"{folder.name}{kind.suffix}"
    exact = {"fflags": "+bitexact"}  # no random identifiers
    with (
        cache.replacing(path) as temporary,
        av.open(str(temporary), "w", format=kind.container, container_options=exact) as container,
    ):
        stream = _stream(container, kind, _decoded(frames[0]), fps)
        with track("movie", len(frames)) as bar:
            for frame in frames:
                container.mux(stream.encode(_converted(_decoded(frame), stream, kind)))
                bar.advance()
        container.mux(stream.encode())
    return path


def _stream(container: Any, kind: _Format, first: Any, fps: float) -> Any:
    import av

    os.environ.setdefault("SVT_LOG", "1")  # its encoder's errors alone
    there = [name for name in kind.encoders if name in av.codec.codecs_available]
    if not there:
        raise InputError(
            f"this PyAV has no encoder {' or '.join(kind.encoders)}; take another --codec, or another build of PyAV"
        )
    stream = container.add_stream(there[0], rate=Fraction(fps).limit_denominator(1001))
    even = 0 if kind.lossless else 1  # half as many colours need even sides
    stream.width, stream.height = first.width & ~even, first.height & ~even
    stream.pix_fmt = kind.pixels[16 if "48" in first.format.name else 8]
    stream.options = dict(kind.encoders[there[0]])
    if not kind.lossless:
        context = stream.codec_context
        context.color_primaries = context.color_trc = context.colorspace = _BT709
        context.color_range = _LIMITED
    return stream


def _decoded(path: Path) -> Any:
    import av

    with av.open(str(path)) as picture:
        return next(picture.decode(video=0))


def _converted(frame: Any, stream: Any, kind: _Format) -> Any:
    """A frame in the stream's format, cropped to its size."""
    import av

    pixels = frame.to_ndarray()[: stream.height, : stream.width].copy()
    cropped = av.VideoFrame.from_ndarray(pixels, format=frame.format.name)
    colours = {} if kind.lossless else {"dst_colorspace": "ITU709", "dst_color_range": "MPEG"}
    return cropped.reformat(format=stream.pix_fmt, **colours)


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
