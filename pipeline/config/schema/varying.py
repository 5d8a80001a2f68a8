"""Values that may vary over the scalp: a constant, `{ formula = "..." }`, `{ map = "file.png" }` or `{ array = "name" }`.

A formula is in SI units; with `from` and `to`, 0 of a formula or a map means the one and 1 the other.
"""

from typing import Annotated, Any, ClassVar, Self

from pydantic import AfterValidator, ConfigDict, Discriminator, Field, Tag, model_validator

from pipeline.config.formula import parse
from pipeline.config.schema.base import Fraction, Section
from pipeline.config.units import Angle, Length

KINDS = ("formula", "map", "array")  # where a value that varies comes from


def _checked(text: str) -> str:
    parse(text)
    return text


class Varied(Section):
    model_config = ConfigDict(serialize_by_alias=True)

    least: ClassVar[float | None] = None
    most: ClassVar[float | None] = None

    formula: Annotated[str, AfterValidator(_checked)] | None = None
    """A formula of scalp variables; see `pipeline/config/formula.py` for all there are."""
    map: str | None = None
    """An image whose brightness is the value, relative to the config; it is looked up by the mesh's texture coordinates, or the scalp chart's."""
    array: str | None = None
    """A painted array of numbers on the points of the head's mesh."""

    @model_validator(mode="after")
    def _one_source(self) -> Self:
        given = [name for name in KINDS if getattr(self, name) is not None]
        if len(given) != 1:
            raise ValueError(f"give one of formula, map and array, not {' and '.join(given) or 'none'}")
        if (self.low is None) != (self.high is None):
            raise ValueError("from and to go together")
        return self

    @property
    def told(self) -> str:
        """The source, for messages."""
        return next(f'{name} "{value}"' for name in KINDS if (value := getattr(self, name)) is not None)

    @property
    def ends(self) -> tuple[float, float] | None:
        """What 0 and 1 mean; None where the value is meant as it is."""
        return None if self.low is None or self.high is None else (self.low, self.high)

    low: float | None = Field(default=None, alias="from")
    """What 0 means."""
    high: float | None = Field(default=None, alias="to")
    """What 1 means."""


class VariedLength(Varied):
    least = 0.0
    low: Annotated[Length, Field(ge=0)] | None = Field(default=None, alias="from")
    """What 0 means."""
    high: Annotated[Length, Field(ge=0)] | None = Field(default=None, alias="to")
    """What 1 means."""


class VariedAngle(Varied):
    low: Angle | None = Field(default=None, alias="from")
    """What 0 means."""
    high: Angle | None = Field(default=None, alias="to")
    """What 1 means."""


class VariedFraction(Varied):
    least, most = 0.0, 1.0
    low: Fraction | None = Field(default=None, alias="from")
    """What 0 means."""
    high: Fraction | None = Field(default=None, alias="to")
    """What 1 means."""


def _kind(value: Any) -> str:
    return "(varied)" if isinstance(value, dict | Varied) else "(constant)"


_ONE_OF = Discriminator(_kind)

VaryingLength = Annotated[
    Annotated[Length, Field(ge=0), Tag("(constant)")] | Annotated[VariedLength, Tag("(varied)")], _ONE_OF
]
VaryingAngle = Annotated[
    Annotated[Angle, Tag("(constant)")] | Annotated[VariedAngle, Tag("(varied)")], _ONE_OF
]
VaryingFraction = Annotated[
    Annotated[Fraction, Tag("(constant)")] | Annotated[VariedFraction, Tag("(varied)")], _ONE_OF
]
VaryingNumber = Annotated[Annotated[float, Tag("(constant)")] | Annotated[Varied, Tag("(varied)")], _ONE_OF]
