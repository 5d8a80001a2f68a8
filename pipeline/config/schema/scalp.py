"""Options of the scalp: where on a head hair grows."""

from typing import Annotated, Self

from pydantic import Field, model_validator

from pipeline.config.schema.base import Position, Section, Vector
from pipeline.config.units import Length

REGIONS = ("array", "map", "planes")  # what tells where hair grows


class Plane(Section):
    point: Position
    """A point on the plane, in the coordinates of the built-in head (y up, z forward, origin between the ears)."""
    normal: Vector
    """Hair grows on the side that it points to; normalised on use."""

    @model_validator(mode="after")
    def _has_a_direction(self) -> Self:
        if not any(self.normal):
            raise ValueError("a normal of length 0 points nowhere")
        return self


class Scalp(Section):
    """Where hair grows, told by one of array, map and planes; without any, within the built-in head's hairline, laid onto any other head."""

    array: str | None = None
    """Name of numbers painted on the points of the head's mesh file (PLY, VTP or what meshio reads): 0 bald to 1 full; bytes count as parts of 255, colours are red, green and blue."""
    map: str | None = None
    """An image, relative to the config: black bald to white full, looked up by the mesh's texture coordinates or, without any, in the scalp chart."""
    planes: tuple[Plane, ...] = ()
    """Hair grows on the far side of all of these planes."""
    fade: Annotated[Length, Field(gt=0)] = 0.01
    """How far inside planes hair is full."""

    @model_validator(mode="after")
    def _one_region(self) -> Self:
        given = [name for name in REGIONS if getattr(self, name)]
        if len(given) > 1:
            raise ValueError(f"expected one of array, map and planes; found {' and '.join(given)}")
        return self
