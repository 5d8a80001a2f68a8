"""The report: kinds of hair x hair on hair or not x numbers and choices of guides x methods, and the floors below it."""

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.groom.guides import choose_guides
from pipeline.strands.chart import Chart
from pipeline.strands.partings import Partings
from pipeline.strands.random import uniform
from pipeline.validation.interpolation.grooms import KINDS, Kind
from pipeline.validation.interpolation.measures import Error, distance, error
from pipeline.validation.interpolation.methods import METHODS, Following
from pipeline.validation.interpolation.scene import HairOnHair, Index, Scene, scene

Floats = NDArray[np.float64]

CHOICES = ("ours", "random")
OURS = "tangent rotation"


@dataclass(frozen=True)
class Plan:
    """What is measured."""

    kinds: tuple[Kind, ...]
    strands: int
    guides: tuple[int, ...]
    """Numbers of guides, ascending."""


FULL = Plan(KINDS, 2000, (50, 100, 200, 500, 1000))
QUICK = Plan(tuple(kind for kind in KINDS if kind.name in ("straight", "curly")), 300, (50, 150))


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
    """What the simulation itself makes uncertain; mean distances over the length of a strand."""

    groom: str
    hair_on_hair: HairOnHair
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
    hairs = scene(kind, plan.strands, hair)
    everyone = np.arange(plan.strands)
    truth = hairs.moved(everyone)
    rows: list[Row] = []
    alone = 0.0
    for choice in CHOICES:
        for count in plan.guides:
            guides = chosen(hairs, choice, count)
            # without hair on hair a strand does not know of the others
            moved = truth[:, guides] if hair == "none" else hairs.moved(guides)
            if (choice, count) == ("ours", plan.guides[-1]):
                alone = distance(moved, truth[:, guides])
            following = Following.of(hairs, guides)
            for method in METHODS if (choice, hair) == ("ours", "none") else (OURS,):
                found = np.stack([METHODS[method](following, frame) for frame in moved])
                how = error(kind, following.rest, found, truth[:, following.strands])
                rows.append(Row(kind.name, hair, count, choice, method, how))
    tremor = distance(hairs.moved(everyone, tremor=True), truth)
    still = distance(np.broadcast_to(hairs.points, truth.shape), truth)
    return Report(plan, tuple(rows), (Floor(kind.name, hair, still, tremor, alone),))
