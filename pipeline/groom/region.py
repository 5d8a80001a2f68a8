"""Where hair grows on a head: within the mannequin's hairline, or where it is painted, or beyond planes."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pipeline.config.schema import Scalp
from pipeline.errors import InputError
from pipeline.groom.head import scalp
from pipeline.groom.head.distance import smoothstep
from pipeline.groom.image import brightness, sampled

if TYPE_CHECKING:
    from pipeline.groom.heads import Head

Points = NDArray[np.floating[Any]]

_TINY = 1e-3  # beyond 0 and 1: less is rounding


@dataclass(frozen=True)
class Region:
    """What a config says about the scalp."""

    options: Scalp = field(default_factory=Scalp)

    @property
    def automatic(self) -> bool:
        """Whether it is the mannequin's hairline."""
        return not (self.options.array or self.options.map or self.options.planes)

    @property
    def disc(self) -> float:
        """Chart radius that holds it."""
        return 0.9 if self.automatic else 0.999

    @property
    def highest(self) -> float:
        """Bound of density r^2 / cos on it [m^2]: skin area per chart area, over 4."""
        return 0.024 if self.automatic else 0.08

    def density(self, head: "Head", p: Points) -> Points:
        """Relative density of roots at fitted points on the skin, 0 to 1.

        Raises InputError for an array that the head does not have or that is not from 0 to 1, and for a file that is no
        image.
        """
        options = self.options
        if options.array is not None:
            self._check_range(head, options.array)
            return np.clip(head.array(options.array, p), 0, 1)
        if options.map is not None:
            return sampled(brightness(options.map), head.uv(p))
        if options.planes:
            inside = np.ones(len(p))
            for plane in options.planes:
                normal = np.array(plane.normal) / np.linalg.norm(plane.normal)
                inside *= smoothstep((p - np.array(plane.point)) @ normal / options.fade)
            return inside
        return scalp.density(p)

    def nothing(self) -> InputError:
        """What is wrong where hair grows nowhere."""
        options = self.options
        if options.array is not None:
            what = f'groom.scalp.array: "{options.array}" leaves no hair'
            remedy = "paint it with 1 where hair grows, on skin that can be seen from outside of the head"
        elif options.map is not None:
            what = f"groom.scalp.map: {options.map} leaves no hair"
            remedy = "paint it white where hair grows, and check the mesh's texture coordinates"
        elif options.planes:
            what = "groom.scalp.planes: no skin lies on the far side of all planes"
            remedy = "normals point to where hair grows; points are in the coordinates of the built-in head"
        else:
            what = "scene.head: found no scalp on this mesh"
            remedy = "check scene.up_axis, scene.face_axis and scene.unit_scale, or say where hair grows by groom.scalp"
        return InputError(f"{what}; {remedy}")

    def _check_range(self, head: "Head", name: str) -> None:
        values = head.painted(name)
        low, high = float(values.min()), float(values.max())
        if not (low >= -_TINY and high <= 1 + _TINY):
            raise InputError(
                f'groom.scalp.array: "{name}" goes from {low:.3g} to {high:.3g}; paint 0 (bald) to 1 (full)'
            )
