"""Options of stage 3: which guides move which strand."""

from typing import Annotated

from pydantic import Field

from pipeline.config.schema.base import Fraction, Section
from pipeline.config.units import Angle, Length


class Variation(Section):
    """What makes a strand differ from the groom strand that it is copied from."""

    length: Fraction = 0.05
    """Random shortening."""
    phase: Annotated[Angle, Field(ge=0)] = 0.5
    """Standard deviation of the curl's phase."""
    clump: Fraction = 0.25
    """How far a copy closes in on its groom strand towards the tip."""
    frizz: Annotated[float, Field(ge=0)] = 0.03
    """Amplitude of smooth noise on the directions of segments [rad]."""


class Interpolate(Section):
    strands: Annotated[int, Field(ge=1, le=10_000_000)] | None = None
    """Full count; unset, the groom's own. Beyond the groom's count strands are varied copies of its strands, with roots between theirs."""
    guides_per_strand: Annotated[int, Field(ge=1, le=8)] = 3
    """Guides whose motion a strand follows."""
    variation: Variation = Variation()
    """Variation of the copies."""
    skin: Annotated[Length, Field(ge=0)] = 0.5e-3
    """Strands keep this distance from the skin."""
