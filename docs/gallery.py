"""Writes docs/gallery.md: every style in configs/, as it was groomed and in motion, rendered by the project itself.

python docs/gallery.py [NAME...] renders all styles, or some of them anew, `--page` writes the page alone; pictures go to docs/pictures/gallery.
"""

import sys

from panels import DOCS, rendered, side_by_side

PICTURES = DOCS / "pictures" / "gallery"
STYLES = (
    "default",
    "straight",
    "wavy",
    "side_parting",
    "zigzag",
    "bob",
    "crop",
    "curly",
    "coils",
    "ponytail",
)
FRAMES = (1, 18)  # as groomed, and in motion
SIZE = (520, 600)  # [px] of a frame
QUALITY = 88

_HEAD = """# Gallery

Every style is a config of a few dozen lines: an ordered stack of operators, each with a name, so that a config that extends
another changes single values (`ringlet run configs/bob.toml -s groom.style.frizz.amplitude="1 mm"`). The left picture is the
first frame, the hair as it was groomed; the right one is frame {frame}, in motion. Made by `make gallery`.

[What each operator does](operators.md), one by one.
"""


def main(wanted: list[str]) -> None:
    """Render the styles that are wanted, all by default, and write the page of all."""
    if wanted != ["--page"]:
        for name in wanted or STYLES:
            render(name)
    parts = [_HEAD.format(frame=FRAMES[1]), *(section(name) for name in STYLES)]
    (DOCS / "gallery.md").write_text("\n".join(parts))


def render(name: str) -> None:
    """Render the two frames of a style and put them side by side."""
    settings = (f"simulate.frames={FRAMES[1]}", f"render.size=[{SIZE[0]}, {SIZE[1]}]")
    frames = rendered(DOCS.parent / "configs" / f"{name}.toml", f"gallery-{name}", settings, FRAMES)
    side_by_side(frames, PICTURES / f"{name}.webp", QUALITY)


def section(name: str) -> str:
    """What the page says about a style: the first lines of its config, and its picture."""
    lines = (DOCS.parent / "configs" / f"{name}.toml").read_text().splitlines()
    said = " ".join(line.removeprefix("# ") for line in lines[1:8] if line.startswith("# "))
    return f"## {name}\n\n[`configs/{name}.toml`](../configs/{name}.toml): {said}\n\n![{name}](pictures/gallery/{name}.webp)\n"


if __name__ == "__main__":
    main(sys.argv[1:])
