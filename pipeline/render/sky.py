"""What hair answers to the light of a sky, for each of a few directions that stand for all.

A direction stands for its cell, all directions that are nearer to it than to the others: what hair answers is the mean
over the cell, so that the narrow lobe of light straight from behind counts in full wherever the eye is. Seen from an
eye at a distance d, directions to it turn by -x / d as a point goes x across; answers are linear in that.
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from pipeline.render.fibre import Scattering

_F32 = NDArray[np.float32]
_F64 = NDArray[np.float64]

_DIRECTIONS: Final = 26
_WITHIN: Final = 1024
"""Directions over which the cells' means are taken."""
_COSINES: Final = 129


def _evenly_spread(count: int) -> _F64:
    """Unit directions (count, 3) on a Fibonacci spiral."""
    i = np.arange(count) + 0.5
    z = 1 - 2 * i / count
    turn = i * np.pi * (3 - np.sqrt(5))
    r = np.sqrt(1 - z**2)
    return np.stack([r * np.cos(turn), r * np.sin(turn), z], axis=-1)


class Sky:
    """The sky's directions, and what one kind of hair answers to light from them."""

    def __init__(self, scattering: Scattering, sigma: _F64) -> None:
        """Take fibres of an absorption (3,) [1/radius]."""
        directions, self._within = _evenly_spread(_DIRECTIONS), _evenly_spread(_WITHIN)
        self.directions: _F32 = directions.astype(np.float32)
        """(D, 3) unit vectors, evenly spread."""
        nearest = (self._within @ directions.T).argmax(axis=1)
        self._cells = (nearest == np.arange(_DIRECTIONS)[:, None]) * (_DIRECTIONS / _WITHIN)
        # Evenly in the angle: the lobe of light from behind is narrow
        self._cosines = -np.cos(np.linspace(0, np.pi, _COSINES))
        mean, second = scattering.answer(self._cosines, sigma)
        self._answers = np.concatenate([mean, second[:, None]], axis=1)
        self._slopes = np.gradient(self._answers, self._cosines, axis=0)

    def answers(self, toward: _F64, across: float) -> _F32:
        """Answers (D, 17) as `kernels.surroundings` takes them, seen from an eye at `toward` (3,) [m] from the hair's middle.

        Hair is `across` [m] wide; an eye that is nearer turns no further.
        """
        distance = max(float(np.linalg.norm(toward)), 1e-9)
        eye = toward / distance
        cosine = self._within @ eye
        mean, slope = (
            np.stack([np.interp(cosine, self._cosines, each) for each in table.T], axis=-1)
            for table in (self._answers, self._slopes)
        )
        w = self._of_cells(mean[:, :3])
        even = w.mean(axis=0)
        flat = self._within - cosine[:, None] * eye
        turned = self._of_cells(slope[:, :3, None] * flat[:, None]) / (-max(distance, across) * even[:, None])
        half = self._within + eye
        half /= np.maximum(np.linalg.norm(half, axis=1, keepdims=True), 1e-9)
        moments = self._of_cells(mean[:, 3, None, None] * (half[:, :, None] * half[:, None] - np.eye(3) / 3))
        w, moments = w / even, moments / even[1]
        # Under an even sky all fibres answer alike
        moments -= w[:, 1, None, None] * moments.mean(axis=0)
        turned -= w[:, :, None] * turned.mean(axis=0)
        five = moments[:, [0, 1, 0, 0, 1], [0, 1, 1, 2, 2]]
        return np.concatenate([w, turned.reshape(-1, 9), five], axis=1).astype(np.float32)

    def _of_cells(self, values: _F64) -> _F64:
        """Sums (D, ...) of values (N, ...) over the directions of each cell, by how many there are in one."""
        sums: _F64 = self._cells @ values.reshape(len(values), -1)
        return sums.reshape(_DIRECTIONS, *values.shape[1:])
