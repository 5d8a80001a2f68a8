"""A head of hair that shakes: all of its strands simulated, or some of them alone, with the settings of production.

The hair is sag-free, of torsion "kirchhoff" and in contact with the head; strands are in contact with one another by the
grid, or not at all. The strands of a scene stand for a whole head of hair: how dense hair is to hair does not depend on
how many of them are simulated.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from pipeline import kernels
from pipeline.config.schema import Contact, HairContact, Motion, Simulate
from pipeline.groom.stage import contact_offset
from pipeline.simulate.stepper import Guides, Simulation
from pipeline.strands.held import held_ends
from pipeline.validation.interpolation.grooms import Kind, groom, round_head

Floats = NDArray[np.float64]
Index = NDArray[np.int64]
HairOnHair = Literal["grid", "none"]

WHOLE_HEAD = 60_000  # strands that the scene's stand for
_EVERY = 6  # frames from one that is looked at to the next
_SECONDS, _SETTLE = 2.0, 1.0
_TREMOR = 1e-6  # [m]


@dataclass(frozen=True)
class Moment:
    """Strands in motion, in the frame of the head."""

    points: Floats
    """(n, P, 3) [m]."""
    load: Floats
    """(n, P, 3) [N]: what the strands' own forces bear: weight, inertia, air, contact."""

    def of(self, strands: Index) -> "Moment":
        """Some of the strands."""
        return Moment(self.points[strands], self.load[strands])


@dataclass(frozen=True)
class Scene:
    """Hair at rest, in the frame of the head, and what happens to it."""

    points: NDArray[np.float32]
    """(S, P, 3) [m]."""
    offset: NDArray[np.float32]
    """(S, P) [m]: distance that points keep from the skin."""
    field: kernels.DistanceField
    """Distance to the head."""
    simulate: Simulate

    def __len__(self) -> int:
        return len(self.points)

    def simulation(self, strands: Index) -> Simulation:
        """Some strands, before they settle, and none of the others."""
        points = self.points[strands]
        held = held_ends(np.tile([2, 0], (len(points), 1)), points.shape[1])
        guides = Guides(points, held, self.offset[strands], self.field, strands=WHOLE_HEAD)
        return Simulation(self.simulate, 1, guides)

    def moved(self, strands: Index, tremor: bool = False) -> list[Moment]:
        """Some strands, simulated without the others.

        With a `tremor` they start a thousandth of a millimetre from where they are at rest.
        """
        simulation = self.simulation(strands)
        points = simulation.state.points
        if tremor:
            points[:, 2:] += _TREMOR * np.random.default_rng(1).normal(size=points[:, 2:].shape)
        simulation.settle()
        moments = []
        for frame in range(self.simulate.frames):
            if frame > 0:
                simulation.next_frame()
            if frame % _EVERY == 0:
                moments.append(_moment(simulation))
        return moments


def _moment(simulation: Simulation) -> Moment:
    state, pose = simulation.state, simulation.frame().pose
    points, directors = np.asarray(state.points, np.float64), np.asarray(state.directors, np.float64)
    force = kernels.kirchhoff(points, directors, simulation.rest)[1]
    edges = np.diff(points, axis=1)
    pull = (state.tension / np.linalg.norm(edges, axis=2))[..., None] * edges
    force[:, :-1] += pull
    force[:, 1:] -= pull
    return Moment((points - pose[:3, 3]) @ pose[:3, :3], -force @ pose[:3, :3])


def scene(kind: Kind, strands: int, hair_on_hair: HairOnHair) -> Scene:
    """A kind of hair on a head that shakes by 45 degrees, once in a second, and is still after a second and a half."""
    points, head = groom(kind, strands).astype(np.float32), round_head()
    motion = Motion(preset="shake", amplitude=np.pi / 4, period=1.0, swings=1)
    simulate = Simulate(
        frames=round(24 * _SECONDS),
        settle=_SETTLE,
        motion=motion,
        hair_contact=HairContact(method=hair_on_hair),
    )
    field = kernels.DistanceField(head.values, head.origin, head.spacing)
    return Scene(points, contact_offset(Contact(), head, points), field, simulate)
