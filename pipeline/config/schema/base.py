"""What every table of options shares: a frozen model that refuses unknown keys, and common types.

Values are SI; see `units` for the strings that are accepted.
"""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

from pipeline.config.units import Length, Speed

Fraction = Annotated[float, Field(ge=0, le=1)]
FaceAxis = Literal["x", "-x", "y", "-y", "z", "-z"]
Vector = tuple[float, float, float]
Position = tuple[Length, Length, Length]
Velocity = tuple[Speed, Speed, Speed]
Colour = tuple[Annotated[float, Field(ge=0)], Annotated[float, Field(ge=0)], Annotated[float, Field(ge=0)]]


class Section(BaseModel):
    """A frozen table of options that refuses unknown keys."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, use_attribute_docstrings=True)
