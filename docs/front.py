"""Renders the pictures of README, the tutorial and the page about camera and light; after gallery.py, whose frames it shows.

python docs/front.py [NAME...] renders all of `PICTURES`, or some of them.
"""

import sys
from collections.abc import Callable
from pathlib import Path

import gallery
from panels import DOCS, rendered, sheet
from PIL import Image

STYLES = ("default", "straight", "wavy", "side_parting", "bob", "crop", "curly", "coils", "ponytail")
LIGHTS = ("studio", "soft", "butterfly", "rim", "back", "sun", "overcast", "dusk")
CONFIGS = DOCS.parent / "configs"
QUALITY = 88


def default() -> None:
    """The main job: as groomed, and twice in motion."""
    settings = (
        "render.size=[470, 560]",
        "scene.camera.field_of_view=25 deg",
        "scene.camera.look_at=[0, -0.015, 0]",
    )
    frames = rendered(CONFIGS / "default.toml", "front-default", settings, (1, 20, 40))
    sheet(_opened(frames), len(frames), DOCS / "pictures" / "default.webp", QUALITY)


def styles() -> None:
    """Nine styles as they were groomed."""
    panels = []
    for name in STYLES:
        settings = (
            f"simulate.frames={gallery.FRAMES[1]}",
            f"render.size=[{gallery.SIZE[0]}, {gallery.SIZE[1]}]",
        )
        panels += _opened(rendered(CONFIGS / f"{name}.toml", f"gallery-{name}", settings, gallery.FRAMES[:1]))
    sheet(
        [panel.resize((312, 360), Image.Resampling.LANCZOS) for panel in panels],
        3,
        DOCS / "pictures" / "styles.webp",
        QUALITY,
    )


def lights() -> None:
    """The default style in every preset of lights."""
    panels = []
    for name in LIGHTS:
        settings = ("simulate.frames=1", "render.size=[260, 260]", f"scene.lighting={name}")
        panels += _opened(rendered(CONFIGS / "default.toml", "front-lights", settings, (1,)))
    sheet(panels, 4, DOCS / "pictures" / "camera" / "lights.webp", QUALITY)


def portrait() -> None:
    """Depth of field and motion blur."""
    settings = ("simulate.frames=5", "render.size=[480, 600]", "render.bits=8")
    frames = rendered(CONFIGS / "portrait.toml", "front-portrait", settings, (5,))
    sheet(_opened(frames), 1, DOCS / "pictures" / "camera" / "portrait.webp", QUALITY)


def _opened(frames: list[Path]) -> list[Image.Image]:
    return [Image.open(frame).convert("RGB") for frame in frames]


PICTURES: dict[str, Callable[[], None]] = {
    "default": default,
    "styles": styles,
    "lights": lights,
    "portrait": portrait,
}

if __name__ == "__main__":
    for name in sys.argv[1:] or PICTURES:
        PICTURES[name]()
