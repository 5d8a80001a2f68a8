"""Options of stage 1: the strands."""

from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from pipeline.config.schema.base import FaceAxis, Section, Vector
from pipeline.config.schema.partings import Parting, PartingName
from pipeline.config.schema.scalp import Scalp
from pipeline.config.schema.style import AnyOperator, StyleName, in_order
from pipeline.config.units import Length


class Swatch(Section):
    """A flat patch of strands without a head: `source = "swatch"`."""

    direction: Vector = (0.0, -1.0, 0.0)
    """Direction of the strands."""
    size: Annotated[Length, Field(ge=0)] = 0.04
    """Side of the square of roots; 0 puts a single strand at the origin."""
    length: Annotated[Length, Field(gt=0)] = 0.20
    """Length of every strand."""
    pin_tips: bool = False
    """Hold the last two points too, to drive them by `[simulate.tips]`."""


class Groom(Section):
    source: str = "procedural"
    """"procedural", "swatch" (strands on a patch, no head) or the path of a groom file, relative to the config: .tfx, .hair, .data, .usd (.usda, .usdc, .usdz), .vtp, .vtkhdf or .abc."""
    unit_scale: Annotated[float, Field(gt=0)] | None = None
    """Metres per unit of the groom file; unset, what the file says (only USD does), else 1."""
    up_axis: Literal["x", "y", "z"] | None = None
    """Which axis of the groom file points up; unset, what the file says (only USD does), else y."""
    face_axis: FaceAxis | None = None
    """Which axis of the groom file the face looks along; unset, z, or -y where z is up."""
    pins: str | None = None
    """A file of held points, relative to the config: a row a strand of .csv or .npy, either two numbers (held at root and tip; 1 is a hinge, 2 a clamp) or one a point (0 free, 1 by the head, 2 by the hand)."""
    strands: Annotated[int, Field(ge=1, le=10_000_000)] = 60_000
    """Number of strands; of a file, the first so many of its strands in progressive order."""
    guides: Annotated[int, Field(ge=1, le=100_000)] = 1_000
    """Number of strands that are simulated; with `guide_error`, the most."""
    guide_error: Annotated[float, Field(gt=0, lt=1)] | None = None
    """Mean error, as a fraction of the length, of strands rebuilt at rest from their guides: as few guides are chosen as reach it. Unset, there are `guides` of them."""
    points: Annotated[int, Field(ge=8, le=256)] = 32
    """Points on every strand and guide, at equal spacing."""
    scalp: Scalp = Scalp()
    """Where hair grows."""
    partings: dict[PartingName, Parting] = Field(default={}, max_length=100)
    """Lines on the scalp, by name, that hair flows away from and does not blend across; without any it flows from the crown's whorl."""
    style: Annotated[dict[StyleName, AnyOperator], AfterValidator(in_order)] = Field(default={})
    """The style operators by name, in the order that they work in; without any, hair stands off the skin."""
    swatch: Swatch = Swatch()
    """The patch of `source = "swatch"`."""
