"""What hair grows on, and what is the same for all operators of a style."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from pipeline import kernels
from pipeline.config.schema import Varied
from pipeline.errors import InputError
from pipeline.groom.combing import Combing
from pipeline.groom.head_field import Field
from pipeline.groom.heads import Head
from pipeline.groom.style.fields import Scalp, varied
from pipeline.groom.style.hair import STEP, Hair, Middles, Vectors


@dataclass(frozen=True)
class Terrain:
    """Skin, wall (the skin with a guard in front of the face) and the combing of the scalp."""

    skin: Field
    wall: Field
    combing: Combing

    @cached_property
    def native(self) -> kernels.Terrain:
        """The wall and the combing, to grow over in steps of `STEP`."""
        chart = self.combing.chart
        return kernels.Terrain(self.wall.native, chart.center, chart.axes, self.combing.grid, STEP)


@dataclass(frozen=True)
class Ground:
    """A style's surroundings."""

    seed: int
    points: int
    """On a strand that is cut."""
    terrain: Terrain | None = None
    """None on a swatch."""
    head: Head | None = None
    middles: Mapping[str, Middles] = field(default_factory=dict)
    """Of the clump operators, by name."""

    def under(self, operator: str) -> Terrain:
        """The terrain. Raises InputError on a swatch, which has none."""
        if self.terrain is None:
            raise InputError(
                f'groom.style: the operator "{operator}" works on a head; groom.source = "swatch" has none'
            )
        return self.terrain

    def values(self, option: float | Varied, hair: Hair) -> Vectors:
        """What an option is at each strand (N,). Raises InputError for what has no value there."""
        if not isinstance(option, Varied):
            return np.full(len(hair), float(option))
        if self.head is None or self.terrain is None:
            raise InputError(f"groom.style: {option.told} varies over a scalp, and a swatch has none")
        return varied(option, Scalp(self.seed, hair.index, hair.root, self.head, self.terrain))
