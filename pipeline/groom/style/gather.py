"""Gather: strands are combed over the scalp to a ring, pulled through it, and fall from there as a tail.

A strand walks over the skin towards the ring and rises above it as hair gets dense: hair that fills a ring of radius R
lies R^2 / (2 d) thick on a circle of radius d about it. The last stretch is a cubic that arrives in the ring in the
direction of the tail: the lowest layer in its middle, the outermost at its rim. The tail turns from there to gravity.
In fitted coordinates, y up.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pipeline import kernels
from pipeline.config.schema import Gather
from pipeline.groom.combing import tangential
from pipeline.groom.head.distance import smoothstep
from pipeline.groom.head_field import Field
from pipeline.groom.style.chance import Chance
from pipeline.groom.style.ground import Ground
from pipeline.groom.style.hair import LONGEST, STEP, Hair, Ties, Vectors, set_apart, unit

_CHOSEN, _OWN = 0, 1  # uses of chance
_CLEARANCE = 1.2e-3  # [m] of the lowest layer from the skin
_FULL = 0.85  # part of the ring's radius that hair fills: equal spacing cuts corners
_NEAR = 2.4  # radii from the ring at which strands leave the skin for it
_UPRIGHT = 0.012  # [m] over which a strand lies down on the skin
_COMBED, _ARRIVING = 48, 12  # points of the way over the skin, and of the last stretch
_SHORT = 0.02  # [m] of tail that a strand must have to be tied
_DOWN = np.array([0.0, -1.0, 0.0])


@dataclass(frozen=True)
class Ring:
    """What ties strands together."""

    middle: Vectors
    """(3,) [m]"""
    axis: Vectors
    """(3,) unit direction in which the tail leaves."""
    radius: float
    """[m] that hair fills."""

    @classmethod
    def on(cls, skin: Field, op: Gather) -> "Ring":
        """The ring of an operator, above the point of the skin that is nearest to its tie."""
        at = np.array([op.tie], float)
        for _ in range(3):
            distance, normal = skin.sample(at)
            at = at - distance[:, None] * normal
        normal = skin.sample(at)[1][0]
        axis = normal if op.axis is None else unit(np.array(op.axis, float))
        return cls(at[0] + op.height * normal, axis, _FULL * op.radius)


def gathered(hair: Hair, op: Gather, ground: Ground, chance: Chance) -> Hair:
    """Strands of the same lengths through the ring; those too short to reach it stay as they are."""
    skin = ground.under(op.op).skin
    ring = Ring.on(skin, op)
    which = np.flatnonzero(chance.uniform(hair.index, _CHOSEN) < ground.values(op.fraction, hair))
    layer, own = chance.layer(hair.index[which]), chance.uniform(hair.index[which], _OWN)
    over, arrived, t = _combed(hair.root[which], hair.normal[which], layer, ring, skin, op)
    entry = _entry(over[:, -1], 0.85 * np.sqrt(layer) + 0.15 * own, ring)
    last = _arriving(over[:, -1], t, entry, ring)
    tail = _tail(entry, ring, op)
    path = np.concatenate([over, last[:, 1:], tail[:, 1:]], axis=1)
    tied = _length(over) + _length(last)
    reach = arrived & (hair.length[which] > tied + _SHORT)
    which, path, tied = which[reach], path[reach], tied[reach]
    points, at = hair.points.copy(), hair.free_from.copy()
    rings = np.full((len(hair), 6), np.nan) if hair.ties is None else hair.ties.ring.copy()
    points[which] = kernels.shortened(np.ascontiguousarray(path), hair.length[which], points.shape[1])
    at[which], rings[which] = tied, np.concatenate([ring.middle, ring.axis])
    return replace(hair, points=points, ties=Ties(at, rings), section=set_apart(hair, which, chance.name))


def held_in_rings(points: Vectors, ties: Ties) -> NDArray[np.bool_]:
    """Which points (N, P) rings hold: the two beside the ring's plane, as in a clamp.

    Of several crossings the one nearest to the ring's middle counts; strands without a ring have none.
    """
    middles, axes = ties.ring[:, None, :3], ties.ring[:, 3:]
    beyond = np.einsum("npi,ni->np", points - middles, axes)
    crosses = (beyond[:, :-1] < 0) & (beyond[:, 1:] >= 0)
    away = 0.5 * (points[:, 1:] + points[:, :-1]) - middles
    far = np.where(crosses, np.linalg.norm(away, axis=2), np.inf)
    tied = np.flatnonzero(crosses.any(axis=1))
    held = np.zeros(points.shape[:2], bool)
    before = far[tied].argmin(axis=1)
    held[tied, before] = held[tied, before + 1] = True
    return held


def _combed(
    root: Vectors, normal: Vectors, layer: Vectors, ring: Ring, skin: Field, op: Gather
) -> tuple[Vectors, NDArray[np.bool_], Vectors]:
    """Ways (N, _COMBED, 3) over the skin until near the ring, which of them (N,) get there, and their last directions."""
    near = _NEAR * op.radius
    p, left = root, np.ones(len(root), bool)
    t = unit(normal + 2 * _onward(root, normal, ring, op))
    way = [p]
    for k in range(int(LONGEST / STEP)):
        left = left & (np.linalg.norm(p - ring.middle, axis=1) > near)
        if not left.any():
            break
        d, m = skin.sample(p)
        far = np.linalg.norm(p - ring.middle, axis=1)
        height = _CLEARANCE + layer * op.radius**2 / (2 * np.maximum(far, near))
        target = _onward(p, m, ring, op) + np.clip((height - d) / STEP, -0.7, 0.7)[:, None] * m
        turn = 1.0 if k * STEP > _UPRIGHT else 0.5
        t = np.where(left[:, None], unit(t + turn * (unit(target) - t)), t)
        p = np.where(left[:, None], p + STEP * t, p)
        way.append(p)
    over = np.stack(way, axis=1)
    return kernels.shortened(over, _length(over), _COMBED), ~left, t


def _onward(p: Vectors, m: Vectors, ring: Ring, op: Gather) -> Vectors:
    """Unit directions (N, 3) along the skin of normals m (N, 3) towards the ring, the sooner up the greater `rise`."""
    way = ring.middle - p
    way[:, 1] *= np.where(way[:, 1] > 0, op.rise, 1.0)
    return unit(tangential(way, m))


def _entry(p: Vectors, part: Vectors, ring: Ring) -> Vectors:
    """Where strands that come from p (N, 3) pass the ring: on their own side, this part (N,) of the radius out."""
    return np.asarray(ring.middle + (ring.radius * part)[:, None] * unit(_across(p - ring.middle, ring)))


def _arriving(p: Vectors, t: Vectors, entry: Vectors, ring: Ring) -> Vectors:
    """Cubics (N, _ARRIVING, 3) from p in direction t (N, 3) to the ring, in the direction of its axis (Hermite)."""
    u = np.linspace(0, 1, _ARRIVING)[:, None]
    span = np.linalg.norm(entry - p, axis=1)[:, None, None]
    start, end = (2 * u**3 - 3 * u**2 + 1), (3 * u**2 - 2 * u**3)
    leave, arrive = span * (u**3 - 2 * u**2 + u), span * (u**3 - u**2)
    return np.asarray(start * p[:, None] + end * entry[:, None] + leave * t[:, None] + arrive * ring.axis)


def _tail(entry: Vectors, ring: Ring, op: Gather) -> Vectors:
    """Curves (N, K, 3) of steps of 4 mm that leave the ring along its axis, open and fall."""
    s = STEP * (np.arange(int(LONGEST / STEP)) + 0.5)[:, None]
    fade = np.exp(-((s / op.fall) ** 2))
    opening = np.tan(op.spread) * _across(entry - ring.middle, ring) / ring.radius
    out = unit(ring.axis + opening[:, None] * smoothstep(s / op.fall))
    steps = STEP * unit(fade * out + (1 - fade) * (_DOWN + 0.5 * opening[:, None] * fade))
    return np.concatenate([entry[:, None], entry[:, None] + np.cumsum(steps, axis=1)], axis=1)


def _across(v: Vectors, ring: Ring) -> Vectors:
    return np.asarray(v - (v @ ring.axis)[:, None] * ring.axis)


def _length(points: Vectors) -> Vectors:
    return np.asarray(np.linalg.norm(np.diff(points, axis=1), axis=2).sum(axis=1))
