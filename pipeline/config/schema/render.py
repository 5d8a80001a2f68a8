"""Options of stage 4: the frames."""

import math
from itertools import pairwise
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from pipeline.config.schema.base import Fraction, Section
from pipeline.config.units import Angle, Length


class Dye(Section):
    colour: tuple[Fraction, Fraction, Fraction]
    """sRGB of much white hair with it. Dye takes light away as melanin does, so bright colours need hair with little melanin."""
    amount: Fraction = 1.0
    """Part of that absorption."""


class Stop(Section):
    at: Fraction
    """Place on the strand: 0 is the root, 1 the tip."""
    melanin: Fraction | None = None
    """Melanin there."""
    redness: Fraction | None = None
    """Share of pheomelanin there."""
    dye: Fraction | None = None
    """Amount of the dye there."""
    roughness: Annotated[float, Field(ge=0.1, le=1)] | None = None
    """Longitudinal roughness there."""


class Fibre(Section):
    melanin: Fraction = 0.6
    """How much pigment: 0 is white, 0.03 platinum, 0.12 blond, 0.3 dark blond, 0.5 light brown, 0.7 brown, 0.85 dark brown, 0.97 black."""
    redness: Fraction = 0.5
    """Share of pheomelanin: 0 is ashen, 1 golden, in dark hair chestnut; auburn and copper need a dye as well."""
    melanin_jitter: Fraction = 0.05
    """Spread of the melanin from strand to strand."""
    roughness: Annotated[float, Field(ge=0.1, le=1)] = 0.3
    """Longitudinal roughness: 0.15 is sleek, 0.3 usual, 0.45 dull; two highlights part from 0.2 down."""
    roughness_jitter: Annotated[float, Field(ge=0, le=1)] = 0.0
    """Spread of the longitudinal roughness from strand to strand."""
    azimuthal_roughness: Annotated[float, Field(ge=0.1, le=1)] = 0.3
    """Roughness around the fibre."""
    tilt: Angle = 0.03490658503988659
    """Tilt of the cuticle scales."""
    reciprocal: bool = False
    """Fresnel's terms and the absorption of a fibre are those at half the difference of both inclinations, not, as in path tracers, at the eye's: light and eye may then change places."""
    glints: bool = True
    """Sample visibility per strand instead of averaging it: single exposed strands sparkle. Few strands whose width is given are told apart: what light meets is known."""
    dye: Dye | None = None
    """Dye on top of the melanin."""
    along: tuple[Stop, ...] = ()
    """Values that change from root to tip, in stops; a value that no stop sets is the one of this table."""
    along_jitter: Fraction = 0.0
    """Spread of where on a strand these stops lie from strand to strand, as a part of its length."""

    @model_validator(mode="after")
    def _from_root_to_tip(self) -> Self:
        places = [stop.at for stop in self.along]
        if any(b <= a for a, b in pairwise(places)):
            raise ValueError("stops go from root to tip: each `at` is greater than the one before")
        if self.dye is None and any(stop.dye is not None for stop in self.along):
            raise ValueError("a stop has dye, but dye.colour is not set")
        return self


class Render(Section):
    size: tuple[Annotated[int, Field(ge=16, le=16384)], Annotated[int, Field(ge=16, le=16384)]] = (1280, 720)
    """Width and height of a frame [px]."""
    samples: Annotated[int, Field(ge=1, le=8)] = 2
    """N for N x N supersampling of what VTK draws: the head, and all strands but those of geometry "coverage"."""
    geometry: Literal["auto", "coverage", "tubes", "ribbons", "lines"] = "auto"
    """How strands are drawn: "coverage" is exact for any width and the fastest, "lines" are one sample wide; "auto" is coverage, and tubes from 3 px of width on, and prints its choice."""
    width: Annotated[Length, Field(gt=0)] | None = None
    """Drawn width (diameter) of a strand; unset, a fibre's, widened by the root of what is missing when there are fewer than 100,000."""
    strands: Annotated[int, Field(ge=1)] | None = None
    """Only the first so many strands are drawn, wider so that they cover what all would: for far cameras and quick looks."""
    taper: Fraction = 0.15
    """Fraction of a strand's length over which its tip thins out."""
    subdivide: Annotated[int, Field(ge=1, le=8)] = 1
    """Drawn segments per segment, along a smooth curve through the points."""
    tube_sides: Annotated[int, Field(ge=3, le=32)] = 4
    """Sides of a tube."""
    passes: Annotated[int, Field(ge=1, le=1024)] = 32
    """Pictures that a frame is the mean of, where the camera has an f_stop or a shutter; each costs what a frame costs without."""
    grid: Annotated[int, Field(ge=16, le=512)] = 128
    """Voxels along the longest side of the density grid that gives hair its shadows."""
    exposure: Annotated[float, Field(gt=0)] = 1.25
    """Factor on linear colours before the tone curve."""
    stops: Annotated[float, Field(ge=-20, le=20)] = 0.0
    """Exposure besides, in stops: each doubles the light."""
    tone: Literal["soft", "filmic"] = "soft"
    """Tone curve: "soft" is linear up to 0.6, with highlights rolled off; "filmic" has a film's contrast, and room for light up to 7."""
    bits: Literal[8, 16] = 8
    """Bits a channel of the PNG files."""
    exr: bool = False
    """Also write every frame as an OpenEXR file of linear colours, depth, tangents, strand numbers and coverage; needs the extra "exr"."""
    hair: Fibre = Fibre()
    """Colour and gloss of the fibres."""

    @property
    def suffixes(self) -> tuple[str, ...]:
        """Of the files of a frame."""
        return (".png", ".exr") if self.exr else (".png",)

    @property
    def gain(self) -> float:
        """Factor on linear colours: exposure and stops."""
        return self.exposure * math.pow(2, self.stops)
