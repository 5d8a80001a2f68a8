"""What a picture shows besides colours: coverage, depth, tangents and strand numbers, for programs that compose pictures.

All come from the raster of exact coverage, in whatever shape the colours are drawn: tubes and ribbons have the same
outlines to a small part of a pixel, lines have not. Layers of several views add up weighted by what they cover, as
their pictures do; strand numbers cannot be mixed, and are those of the first.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Linear = NDArray[np.float32]

_NOTHING = 1e-3
"""Coverage of a pixel below which it has no depth."""


@dataclass(frozen=True)
class Layers:
    """Layers of one view, or the mean of several."""

    planes: Linear
    """(H, W, 6): part of the pixel that is hair or head, and part that is hair; the first times the mean distance along
    the line of sight [m]; the second times the mean unit direction of strands from root to tip, in the world."""
    strand: NDArray[np.uint32]
    """(H, W): number of the strand that covers most of it, from 1; 0 where there is no hair."""

    def channels(self, linear: Linear, background: Linear) -> dict[str, NDArray[Any]]:
        """The channels of an EXR file, with linear colours (H, W, 3) over a background (3,), which is taken away.

        R, G, B (times A) and A; coverage of hair; Z [m], infinite where there is nothing; tangent.X, .Y, .Z; id.
        """
        solid, hair, depth = (np.ascontiguousarray(self.planes[..., i]) for i in range(3))
        colour = linear - (1 - solid)[..., None] * background
        distance = np.divide(depth, solid, out=np.full_like(depth, np.inf), where=solid > _NOTHING)
        way = self.planes[..., 3:] / np.maximum(hair, _NOTHING)[..., None]
        half = {
            **{name: colour[..., i] for i, name in enumerate("RGB")},
            "A": solid,
            "coverage": hair,
            **{f"tangent.{name}": way[..., i] for i, name in enumerate("XYZ")},
        }
        return {name: layer.astype(np.float16) for name, layer in half.items()} | {
            "Z": distance,
            "id": self.strand,
        }
