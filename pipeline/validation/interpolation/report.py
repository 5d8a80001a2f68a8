"""The report: kinds of hair x hair on hair or not x numbers and choices of guides x methods, and the floors below it."""

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.groom.guides import choose_guides
from pipeline.strands.chart import Chart
from pipeline.strands.partings import Partings
from pipeline.strands.random import uniform
from pipeline.validation.interpolation.forces import internal_forces
from pipeline.validation.interpolation.grooms import KINDS, Kind
from pipeline.validation.interpolation.measures import Error, distance, error
from pipeline.validation.interpolation.methods import (
    Following,
    Method,
    frame_skinning,
    raw_positions,
    strain_increments,
    tangent_rotation,
)
from pipeline.validation.interpolation.scene import HairOnHair, Index, Moment, Scene, scene

Floats = NDArray[np.float64]

CHOICES = ("ours", "random")
OURS = "tangent rotation"
METHODS: dict[str, Method] = {
    OURS: tangent_rotation,
    "frame skinning": frame_skinning,
    "strain increments": strain_increments,
    "raw positions": raw_positions,
    "internal forces": internal_forces,
}


@dataclass(frozen=True)
class Plan:
    """What is measured."""

    kinds: tuple[Kind, ...]
    strands: int
    guides: tuple[int, ...]
    """Numbers of guides, ascending."""
    compared: tuple[int, ...]
    """Those of them for which methods are compared."""


FULL = Plan(KINDS, 2000, (50, 100, 200, 500, 1000), (1000, 200))
QUICK = Plan(tuple(kind for kind in KINDS if kind.name in ("straight", "curly")), 300, (50, 150), (150,))


@dataclass(frozen=True)
class Row:
    """Strands of a groom that follow so many guides."""

    groom: str
    hair_on_hair: HairOnHair
    guides: int
    choice: str
    """"ours" or "random"."""
    method: str
    error: Error

    def as_json(self) -> dict[str, Any]:
        """All in one level."""
        return {name: value for name, value in asdict(self).items() if name != "error"} | asdict(self.error)


@dataclass(frozen=True)
class Floor:
    """What hair on hair itself makes uncertain; mean distances over the length of a strand."""

    groom: str
    moved: float
    """How far strands are from where they are at rest."""
    tremor: float
    """Between two simulations of all strands that start a thousandth of a millimetre apart."""
    alone: float
    """Between the largest number of guides simulated alone, and the same strands among all the others."""


@dataclass(frozen=True)
class Report:
    """Everything that was measured."""

    plan: Plan
    rows: tuple[Row, ...]
    floors: tuple[Floor, ...]

    def as_json(self) -> dict[str, Any]:
        """Rows and floors as lists of flat objects."""
        return {
            "strands": self.plan.strands,
            "rows": [row.as_json() for row in self.rows],
            "floors": [asdict(floor) for floor in self.floors],
        }

    def find(self, **wanted: object) -> list[Row]:
        """The rows with these values."""
        return [
            row for row in self.rows if all(getattr(row, name) == value for name, value in wanted.items())
        ]


def measure(plan: Plan) -> Iterator[Report]:
    """Yield the report of one kind of hair, with or without hair on hair, after the other; `merged` puts them together."""
    for kind in plan.kinds:
        for hair in ("none", "grid"):
            yield _measured(plan, kind, hair)


def merged(plan: Plan, parts: list[Report]) -> Report:
    """One report of several."""
    rows = tuple(row for part in parts for row in part.rows)
    return Report(plan, rows, tuple(floor for part in parts for floor in part.floors))


def chosen(hair: Scene, choice: str, count: int) -> Index:
    """Guides (G,), ascending: production's choice, or any strands."""
    if choice == "ours":
        return choose_guides(hair.points, count, Partings(Chart.from_above())).strand.astype(np.int64)
    return np.sort(np.argsort(uniform(1, np.arange(len(hair)), 0x1F10))[:count])


def _measured(plan: Plan, kind: Kind, hair: HairOnHair) -> Report:
    where = scene(kind, plan.strands, hair)
    everyone = np.arange(plan.strands)
    truth = where.moved(everyone)
    rows: list[Row] = []
    floors: tuple[Floor, ...] = ()
    if hair == "none":
        for choice in CHOICES:
            for count in plan.guides:
                guides = chosen(where, choice, count)
                # without hair on hair a strand does not know of the others
                moved = [moment.of(guides) for moment in truth]
                methods = tuple(METHODS) if choice == "ours" and count in plan.compared else (OURS,)
                rows += _rows(kind, where, Following.of(where, guides), moved, truth, methods, choice)
    else:
        for count in plan.guides:
            guides = chosen(where, "ours", count)
            moved = where.moved(guides)
            rows += _rows(kind, where, Following.of(where, guides), moved, truth, (OURS,), "ours")
        alone = distance(_points(moved), _points(truth)[:, guides])
        tremor = distance(_points(where.moved(everyone, tremor=True)), _points(truth))
        still = distance(np.broadcast_to(where.points, _points(truth).shape), _points(truth))
        floors = (Floor(kind.name, still, tremor, alone),)
    return Report(plan, tuple(rows), floors)


def _rows(
    kind: Kind,
    where: Scene,
    following: Following,
    moved: list[Moment],
    truth: list[Moment],
    methods: Sequence[str],
    choice: str,
) -> Iterator[Row]:
    """One row for each method, from what the guides do."""
    for method in methods:
        found = np.stack([METHODS[method](following, moment) for moment in moved])
        how = error(kind, following.rest, found, _points(truth)[:, following.strands])
        hair = where.simulate.hair_contact.method
        yield Row(kind.name, "grid" if hair == "grid" else "none", len(following.guides), choice, method, how)


def _points(moments: list[Moment]) -> Floats:
    return np.stack([moment.points for moment in moments])
