"""Writes docs/colours.md: colours of hair with the values that make them, rendered by the project itself.

python docs/colours.py renders all of them, `--page` writes the page alone; the picture goes to docs/pictures/colours.webp.
"""

import sys
from collections.abc import Mapping
from typing import Final

from panels import DOCS, rendered, sheet, side_by_side
from PIL import Image, ImageDraw

PICTURE = DOCS / "pictures" / "colours.webp"
SIZE, ACROSS, QUALITY = 330, 4, 88  # [px] of a panel, panels in a row
BASE: Final = {
    "simulate.frames": "1",
    "groom.strands": "40_000",
    "groom.guides": "500",
    "render.size": f"[{SIZE}, {SIZE}]",
    "scene.camera.field_of_view": "24 deg",
    "render.hair.dye.amount": "0",
}
COLOURS: Final[Mapping[str, Mapping[str, object]]] = {
    "black": {"melanin": 0.97, "redness": 0.2},
    "dark brown": {"melanin": 0.85, "redness": 0.4},
    "brown": {"melanin": 0.7, "redness": 0.7},
    "chestnut": {"melanin": 0.62, "redness": 0.9},
    "light brown": {"melanin": 0.5, "redness": 0.6},
    "dark blond": {"melanin": 0.3, "redness": 0.5},
    "blond": {"melanin": 0.12, "redness": 0.8, "dye.colour": [1.0, 0.72, 0.46]},
    "platinum": {"melanin": 0.03, "redness": 0.3},
    "auburn": {"melanin": 0.5, "redness": 1.0, "dye.colour": [0.9, 0.3, 0.12]},
    "copper": {"melanin": 0.3, "redness": 0.8, "dye.colour": [0.85, 0.35, 0.15]},
    "grey": {"melanin": 0.35, "redness": 0.1, "melanin_jitter": 0.3},
    "white": {"melanin": 0.01, "redness": 0.0, "melanin_jitter": 0.01},
}

_HEAD = """# Colours of hair

![{names}](pictures/colours.webp)

One groom in the light of `scene.lighting = "studio"`, and `[render.hair]` of each. Made by `make gallery`.

| colour | melanin | redness | besides |
|---|---|---|---|
{rows}

* `melanin` is how much there is: its steps look about equal. Blond hair has far less than one might think, since light passes
  many fibres before it comes out.
* `redness` is the share of pheomelanin, by the spectra that have been measured of both pigments: it goes from ashen to golden, in
  dark hair to chestnut. No share of it makes ginger: there, and for a warm blond, add a tint.
* Two highlights, a white one and one in the hair's own colour nearer to the root, part when `roughness` is 0.2 or less and
  `tilt` is 3 degrees, as in [`configs/bob.toml`](../configs/bob.toml). Black hair of `melanin = 1` lets no light through
  and has the white one alone.

"""
_TAIL = """## Dye, and colours along a strand

Pigment takes light away, and so does dye: their absorptions add up, and bright colours need hair with little melanin, as at a
hairdresser's. [`configs/ombre.toml`](../configs/ombre.toml) is grown out and dyed:

![Dark roots, bleached lengths, tips in rose](pictures/ombre.webp)

```toml
[render.hair]
melanin = 0.05
roughness_jitter = 0.03 # strands differ in gloss, as they do in colour by melanin_jitter
along_jitter = 0.06     # and in where the stops lie, by this part of their length
along = [               # from root to tip, linear between the stops that set a value
    { at = 0.1, melanin = 0.75, roughness = 0.28, dye = 0 },
    { at = 0.75, melanin = 0.05, roughness = 0.36, dye = 1 },
]

[render.hair.dye]
colour = [0.93, 0.42, 0.55] # sRGB, of much white hair with it
amount = 1.0                # where no stop says how much
```

* The colour of the dye is that of light that is scattered many times; its absorption follows from it and the azimuthal roughness
  (Chiang et al., *A Practical and Controllable Hair and Fur Model for Production Path Tracing*, 2016, eq. 9). A half space of white
  hair returns it to 0.13 in each channel (`test_much_white_hair_shows_the_colour_of_its_dye`); a lock also shows the
  colourless light of the cuticle.
* `melanin`, `redness`, `dye` and longitudinal `roughness` change along a strand. The azimuthal roughness does not, and light that
  went through other strands has the colour that these have at the same place.
* Whatever draws the strands, coverage, tubes, ribbons or lines, asks the same shader.
"""


def main(wanted: list[str]) -> None:
    """Render all colours, unless only the page is wanted, and write the page."""
    if wanted != ["--page"]:
        sheet([render(name, values) for name, values in COLOURS.items()], ACROSS, PICTURE, QUALITY)
        render_ombre()
    rows = "\n".join(row(name, values) for name, values in COLOURS.items())
    (DOCS / "colours.md").write_text(_HEAD.format(names=", ".join(COLOURS), rows=rows) + _TAIL)


def render(name: str, values: Mapping[str, object]) -> Image.Image:
    """Render one colour; its name is written into the panel's corner."""
    hair = {f"render.hair.{key}": value for key, value in values.items()}
    if "dye.colour" in values:
        hair["render.hair.dye.amount"] = 1
    settings = [f"{key}={value}" for key, value in (BASE | hair).items()]
    (frame,) = rendered(DOCS.parent / "configs" / "wavy.toml", "colours", settings, [1])
    panel = Image.open(frame).convert("RGB")
    ImageDraw.Draw(panel).text((10, 8), name, fill=(235, 235, 235), font_size=16)
    return panel


def render_ombre() -> None:
    """The shipped style whose colours change from root to tip, as groomed and in motion."""
    settings = ("simulate.frames=18", f"render.size=[{SIZE * ACROSS // 2}, {SIZE * 3 // 2}]")
    frames = rendered(DOCS.parent / "configs" / "ombre.toml", "colours-ombre", settings, (1, 18))
    side_by_side(frames, DOCS / "pictures" / "ombre.webp", QUALITY)


def row(name: str, values: Mapping[str, object]) -> str:
    """The line of the table for a colour."""
    besides = ", ".join(
        f"`{key} = {value}`" for key, value in values.items() if key not in ("melanin", "redness")
    )
    return f"| {name} | {values['melanin']} | {values['redness']} | {besides} |"


if __name__ == "__main__":
    main(sys.argv[1:])
