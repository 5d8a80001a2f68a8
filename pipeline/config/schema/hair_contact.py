"""Options of hair-hair contact: what the guides do to one another."""

from typing import Annotated, Literal

from pydantic import Field

from pipeline.config.schema.base import Section
from pipeline.config.units import Acceleration, Density, Length, Rate, Speed


class HairContact(Section):
    method: Literal["none", "grid", "capsule"] = "grid"
    """How guides keep apart: "grid" (hair as a fluid; cheap), "capsule" (guides as soft rods that collide and rub) or "none"."""
    density: Annotated[Density, Field(gt=0)] = 10.0
    """Grid: hair that is denser pushes, counted with all strands of the groom; where the groom is denser, that counts."""
    cell: Annotated[Length, Field(gt=0)] = 14e-3
    """Grid: spacing of the grid, about twice the distance of the guides: in smaller cells their number is noise."""
    pressure: Annotated[float, Field(ge=0)] = 0.03
    """Grid: how hard hair of twice the density pushes [m^2/s^2]."""
    drag: Annotated[Rate, Field(ge=0)] = 3.0
    """Grid: the rate at which a guide takes on the velocity of the hair around it."""
    radius: Annotated[Length, Field(gt=0)] = 1.5e-3
    """Capsule: radius of the wisp that a guide stands for; two guides that are groomed nearer may stay as near."""
    stiffness: Annotated[float, Field(ge=0)] = 0.005
    """Capsule: force per depth of two wisps in each other [N/m]."""
    friction: Annotated[float, Field(ge=0, le=2)] = 0.3
    """Capsule: Coulomb friction between wisps."""
    limit: Annotated[Acceleration, Field(gt=0)] = 50.0
    """Grid: largest push; hair that starts too dense comes out slowly."""
    speed: Annotated[Speed, Field(gt=0)] = 0.2
    """Capsule: wisps are pushed apart no faster than this; those that start in each other come out slowly."""
