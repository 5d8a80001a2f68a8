"""Where a head stands: the coordinates of the built-in head, laid onto the skull of another one."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Placement:
    """One scale, then one offset; the built-in head's own is neither."""

    scale: float = 1.0
    """World metres per metre of the built-in head."""
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """World position of the built-in head's origin, between its ears [m]."""

    def world(self, points: NDArray[np.floating[Any]] | tuple[float, float, float]) -> NDArray[np.float64]:
        """World positions (..., 3) of points on the built-in head."""
        return np.asarray(np.asarray(points) * self.scale + np.array(self.offset))
