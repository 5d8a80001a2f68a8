"""One static HTML page that shows pairs of pictures, their difference map and their figures.

Everything is inside the file, so it opens from disk and can be stored as a CI artefact.
"""

import base64
import html
import io
import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from pipeline.compare.folders import Pair, load_picture
from pipeline.compare.metrics import Picture, flip_map

_STYLE = """
body{font:15px/1.5 system-ui,sans-serif;margin:2rem;background:#191919;color:#ddd}
h1{font-size:1.3rem} h2{font-size:1.05rem;margin-top:2.5rem} table{border-spacing:1.2em 0}
td:first-child{color:#999} figure{display:inline-block;margin:0 1rem 1rem 0} img{display:block;image-rendering:pixelated}
figcaption{color:#999} .swipe{position:relative;display:inline-block}
.swipe img:last-of-type{position:absolute;inset:0;clip-path:inset(0 0 0 var(--at,50%))}
input{width:100%}
"""


def write_page(
    path: Path, title: str, pairs: Sequence[Pair], notes: dict[str, list[str]] | None = None
) -> None:
    """Write the page for the pairs that are not identical; `notes` are lines to print under a pair's name."""
    shown = [pair for pair in pairs if pair.metrics is None or not pair.metrics.identical]
    parts = [_section(pair, (notes or {}).get(pair.name, [])) for pair in shown]
    summary = f"{len(pairs)} compared, {len(shown)} differ"
    text = (
        f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{html.escape(title)}</title>'
        f"<style>{_STYLE}</style><h1>{html.escape(title)}</h1><p>{summary}</p>{''.join(parts)}</html>\n"
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f"{path.name}.tmp.{os.getpid()}")
    temporary.write_text(text, encoding="utf-8")
    temporary.replace(path)


def _section(pair: Pair, notes: list[str]) -> str:
    lines = "".join(f"<p>{html.escape(line)}</p>" for line in notes)
    head = f"<h2>{html.escape(pair.name)}</h2>{lines}"
    if pair.metrics is None or pair.reference is None or pair.picture is None:
        return head + f"<p>missing: {'the new picture' if pair.picture is None else 'the reference'}</p>"
    reference, picture = load_picture(pair.reference), load_picture(pair.picture)
    figures = "".join(
        f"<tr><td>{name}</td><td>{value:.5f}</td></tr>" for name, value in vars(pair.metrics).items()
    )
    swipe = (
        f'<figure><div class="swipe">{_image(reference)}{_image(picture)}</div>'
        '<input type="range" value="50" oninput="this.previousElementSibling.style.setProperty(\'--at\','
        "this.value+'%')\"><figcaption>swipe: reference left, new right</figcaption></figure>"
    )
    return (
        head
        + f"<table>{figures}</table>"
        + _figure(reference, "reference")
        + _figure(picture, "new")
        + swipe
        + _figure(heat(flip_map(reference, picture)), "difference (FLIP)")
    )


def heat(values: np.ndarray) -> Picture:
    """Colours for (H, W) values in 0..1: black, red, yellow, white."""
    v = np.clip(values, 0, 1)[..., None] * np.array([3.0, 3.0, 3.0]) - np.array([0.0, 1.0, 2.0])
    return np.asarray(np.clip(v, 0, 1) * 255 + 0.5, np.uint8)


def _figure(picture: Picture, caption: str) -> str:
    return f"<figure>{_image(picture)}<figcaption>{caption}</figcaption></figure>"


def _image(picture: Picture) -> str:
    from PIL import Image

    buffer = io.BytesIO()
    Image.fromarray(picture).save(buffer, "PNG")
    return f'<img alt="" src="data:image/png;base64,{base64.b64encode(buffer.getvalue()).decode()}">'
