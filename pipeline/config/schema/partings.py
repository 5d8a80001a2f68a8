"""Options of a parting: a line on the scalp."""

from typing import Annotated

from pydantic import Field, model_validator

from pipeline.config.schema.base import Position, Section
from pipeline.config.units import Length

PartingName = Annotated[str, Field(pattern=r"^[A-Za-z0-9_-]{1,40}$")]
LINES = ("offset", "points", "chart", "file")  # where the line comes from
Ordinate = Annotated[float, Field(ge=-1, le=1)]


class Parting(Section):
    """A line that hair flows away from and does not blend across, given by one of offset, points, chart and file."""

    offset: Length | None = None
    """The line from the front hairline to the crown, this far sideways on the mannequin's skull; positive is the head's left."""
    points: tuple[Position, ...] | None = None
    """Corners of a line near the skin, in the mannequin's coordinates (y up, z forward, origin between the ears), straight as seen from within the head."""
    chart: tuple[tuple[Ordinate, Ordinate], ...] | None = None
    """Corners in the scalp's equal-area chart: u to the head's right and v towards the face, both from the crown's whorl; without a head x and z of the groom's file [m]."""
    file: str | None = None
    """Corners as a table (.csv), relative to the config: two columns for the chart's u and v, or three for `points` in metres."""
    closed: bool = False
    """Join the last corner with the first."""
    enabled: bool = True
    """Take the parting off without removing it here."""

    @model_validator(mode="after")
    def _one_line(self) -> "Parting":
        given = [name for name in LINES if getattr(self, name) is not None]
        if len(given) != 1:
            found = f"found {' and '.join(given)}" if given else "found none of them"
            raise ValueError(f"expected one of offset, points, chart and file; {found}")
        corners = self.points if self.points is not None else self.chart
        if corners is not None and len(corners) < 2:
            raise ValueError(f"a parting has two corners at least; {given[0]} has {len(corners)}")
        if self.closed and self.offset is not None:
            raise ValueError("the line of an offset has ends; closed is for points, chart and file")
        return self
