"""Fringe: strands rooted behind the front hairline fall forward, lie on the forehead and end at a height above the eyes."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pipeline import kernels
from pipeline.config.schema import Fringe
from pipeline.groom.combing import Combing
from pipeline.groom.style.chance import Chance
from pipeline.groom.style.ground import Ground, Terrain
from pipeline.groom.style.growth import Sprouts, grown, stretches
from pipeline.groom.style.hair import STEP, Hair, Vectors, cut_to, set_apart, unit

_UNEVEN, _TURN = 0, 1  # uses of chance
# [m] the hairline over the forehead: z of its middle, and its radius seen from above
_FRONT, _ROUND = 0.089, 0.06
_TILT = 1.1  # [rad] between the first direction and the skin's normal
_LONGEST = 0.20  # [m]
_SHORTEST = 0.01  # [m]
_ABOVE = 0.5e-3  # [m] kept above the cut: equal spacing moves points by less


def fringed(hair: Hair, op: Fringe, ground: Ground, chance: Chance) -> Hair:
    """Strands of which those of the region hang over the forehead; their lengths are new."""
    which = np.flatnonzero(in_fringe(hair.root, op))
    if not len(which):
        return hair
    index, root, normal = hair.index[which], hair.root[which], hair.normal[which]
    terrain = _forehead(ground.under(op.op), op)
    steps = round(_LONGEST / STEP)
    ahead = terrain.combing.flow(root, normal, np.zeros((len(which), 2)))
    own = Sprouts(
        root=root,
        standoff=np.zeros((len(which), 2)),
        first=unit(
            np.cos(_TILT) * normal + np.sin(_TILT) * unit(ahead + 0.04 * chance.directions(index, _TURN))
        ),
        sweep=np.zeros(len(which)),
        layer=op.lift * (0.25 + 0.75 * chance.layer(index)),
        bend=np.full(len(which), op.bend),
        comb=np.full(len(which), 3 * op.bend),
        length=np.full(len(which), _LONGEST),
        wander=np.zeros((len(which), stretches(steps), 3)),
    )
    path = grown(own, terrain, op.depth, steps)
    higher = op.uneven * chance.uniform(index, _UNEVEN) + _ABOVE
    plane = np.array([0.0, -1.0, 0.0, op.height])
    cut = np.maximum(kernels.first_outside(path, -higher, plane, False, -np.inf), _SHORTEST)
    points, length, comb = hair.points.copy(), hair.length.copy(), hair.comb.copy()
    points[which], length[which], comb[which] = cut_to(path, cut, points.shape[1]), cut, ahead
    section = set_apart(hair, which, chance.name)
    return replace(hair, points=points, length=length, comb=comb, section=section)


def in_fringe(root: Vectors, op: Fringe) -> NDArray[np.bool_]:
    """Which roots (N, 3), in fitted coordinates, lie in the region: a triangle from the front hairline to its point."""
    behind = _FRONT - 0.5 * root[:, 0] ** 2 / _ROUND - root[:, 2]
    return np.asarray(np.abs(root[:, 0]) < 0.5 * op.width * (1 - behind / op.depth))


def _forehead(terrain: Terrain, op: Fringe) -> Terrain:
    """The skin without the guard in front of the face, combed forwards; to both sides the more, the farther out."""
    chart = terrain.combing.chart
    u = np.array([-1.0, 1.0]) * chart.axes[0, 0]
    sideways = np.broadcast_to(op.sideways + op.fan * u[:, None], (2, 2))
    grid = np.stack([sideways, 0 * sideways, 0 * sideways + 1, 0 * sideways + 1], axis=2).astype(np.float32)
    return Terrain(terrain.skin, terrain.skin, Combing(chart, grid, np.zeros((0, 2, 2))))
