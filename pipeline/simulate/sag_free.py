"""Sag-free start: a rest shape that holds the groomed guides under gravity, instead of the groom itself.

Hair was groomed as it hangs, so its rest shape is another one. The kernel finds it exactly, and how much stiffer a guide
has to be for the groom to be stable (statics.hpp, stability.hpp, sag_free.hpp; for curls of torsion "rotor" see
sag_free_curls). It holds at the head's first pose,
without wind and without hair on hair. Where a guide leans on the head, its contact offset becomes the groomed distance,
so that the two start in touch. Points groomed below the skin come out of it, and move their guides.
"""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline import kernels
from pipeline.config.schema import SagFree, Simulate
from pipeline.errors import InputError
from pipeline.simulate import sag_free_curls as curls

_NEAR = 2e-3  # [m] the head carries points up to this distance from the skin,
_ABOVE = 1e-3  # [m] and up to this much above their contact offset

_Vectors = NDArray[np.float64]


@dataclass(frozen=True)
class Report:
    """What it took to hold the groom."""

    guides: int
    residual: float
    """Largest net force on a free point, in weights of a point."""
    stiffened: int
    """Guides that are stiffer than their material."""
    largest_factor: float
    """How much stiffer, at most."""
    over_max_factor: int
    """Guides that would have to be stiffer than sag_free.max_factor allows: they will sag."""
    leaning: int
    """Guides of which the head carries a part."""
    hinged: int
    """Guides without a clamped root: they keep the groom as rest shape, and will sag."""
    below_skin: int
    """Guides with points groomed below the skin."""

    def lines(self) -> list[str]:
        """The report in words."""
        parts = [
            f"sag-free: net force at most {self.residual:.1e} point weights, "
            f"{self.leaning} of {self.guides} guides lean on the head",
            f"sag-free: {self.stiffened} guides stiffened, by {self.largest_factor:.3g} at most",
        ]
        if self.over_max_factor:
            parts.append(
                f"sag-free: {self.over_max_factor} guides will sag: they need more than simulate.sag_free.max_factor"
            )
        if self.hinged:
            parts.append(f"sag-free: {self.hinged} guides will sag: their roots are not clamped")
        if self.below_skin:
            parts.append(
                f"sag-free: {self.below_skin} guides will move: they have points groomed below the skin"
            )
        return parts

    def record(self) -> dict[str, Any]:
        """For the provenance of guides.h5."""
        return asdict(self)


@dataclass(frozen=True)
class Start:
    """The forces that guides at rest start with."""

    tension: _Vectors
    """(G, P-1) [N]."""
    contact: NDArray[np.uint8]
    """(G, P): 1 where the guide leans on the head."""
    report: Report


def hold_groom(
    rest: kernels.RestShape, field: kernels.DistanceField | None, simulate: Simulate, poses: _Vectors
) -> Start:
    """Change rest shape, stiffness and contact offsets so that the points are at rest, as far as that can be.

    Gravity and `rest.load` act in the world, in which the roots have these poses (G, 4, 4), or (1, 4, 4) where all go
    with the head. Guides without a clamped root keep the groom as their rest shape. Raises InputError for torsion
    "rotor" when a guide has no sag-free rest shape.
    """
    turn = poses[:, :3, :3]
    weight = (np.array(simulate.gravity) @ turn)[:, None]
    load = np.ascontiguousarray(rest.mass[..., None] * weight + rest.load @ turn)
    distance, normal = _head(rest, field)
    free, outside = rest.held == 0, distance >= 0
    rest.offset = np.where(free & outside, np.minimum(rest.offset, distance), rest.offset)
    below = int((free & ~outside).any(axis=1).sum())
    if simulate.torsion == "rotor":
        return _hold_curls(rest, load, simulate.sag_free, below)
    supported = free & outside & (distance <= np.maximum(_NEAR, rest.offset + _ABOVE))
    return _hold_rods(
        rest, load, simulate.sag_free, below, (distance, np.where(supported[..., None], normal, 0.0))
    )


def _hold_rods(
    rest: kernels.RestShape, load: _Vectors, options: SagFree, below: int, support: tuple[_Vectors, _Vectors]
) -> Start:
    distance, normal = support
    found = kernels.sag_free(rest, load, normal, options.margin, options.max_factor, options.lean_above)
    carried = found.reaction > 0
    rest.offset = np.where(carried, distance, rest.offset)
    rest.strain = found.strain
    for name in ("bending", "bending_2", "twisting"):
        setattr(rest, name, getattr(rest, name) * found.factor)
    report = Report(
        guides=len(distance),
        residual=net_force(rest, load + found.reaction[..., None] * normal, found.tension),
        stiffened=int((found.factor > 1).sum()),
        largest_factor=float(found.factor.max(initial=1.0)),
        over_max_factor=int((found.needed > found.factor).sum()),
        leaning=int(carried.any(axis=1).sum()),
        hinged=int((~_clamped(rest)).sum()),
        below_skin=below,
    )
    return Start(found.tension.copy(), carried.astype(np.uint8), report)


def _hold_curls(rest: kernels.RestShape, load: _Vectors, options: SagFree, below: int) -> Start:
    factor, held = curls.hold_curls(rest, load, options.margin, options.max_factor)
    if not held.all():
        raise InputError(
            f'simulate.rest: "sag_free" cannot hold {int((~held).sum())} of {len(held)} guides with simulate.torsion = '
            f'"rotor", the first of them guide {int(np.argmin(held))}: its torsion acts on bends, and straight parts '
            'have none to be held sideways by; set simulate.torsion = "kirchhoff", or simulate.rest = "auto"'
        )
    report = Report(
        guides=len(held),
        residual=curls.net_force(rest, load, held),
        stiffened=int((factor > 1).sum()),
        largest_factor=float(factor.max(initial=1.0)),
        over_max_factor=0,
        leaning=0,
        hinged=0,
        below_skin=below,
    )
    return Start(curls.tension(rest, load), np.zeros(held.shape + load.shape[1:2], np.uint8), report)


def net_force(rest: kernels.RestShape, load: _Vectors, tension: _Vectors) -> float:
    """Largest net force on a free point at rest under a load (G, P, 3) [N] and tensions (G, P-1) [N], in weights of
    a point.
    """
    force = kernels.kirchhoff(rest.points, rest.directors, rest)[1] + load
    edges = np.diff(rest.points, axis=1)
    pull = (tension / np.linalg.norm(edges, axis=2))[..., None] * edges
    force[:, :-1] += pull
    force[:, 1:] -= pull
    weights = np.linalg.norm(force, axis=2) / (9.81 * rest.mass)
    return float(weights[(rest.held == 0) & _clamped(rest)[:, None]].max(initial=0.0))


def _clamped(rest: kernels.RestShape) -> NDArray[np.bool_]:
    return np.asarray((rest.held[:, :2] > 0).all(axis=1))


def tip_drift(
    groom: NDArray[np.floating], points: NDArray[np.floating], pose: _Vectors
) -> NDArray[np.float64]:
    """How far tips of guides (G, P, 3) [m] in the world, at a pose of the head, are from the groom, over their lengths."""
    length = np.linalg.norm(np.diff(groom, axis=1), axis=2).sum(axis=1)
    groomed = groom[:, -1] @ pose[:3, :3].T + pose[:3, 3]
    return np.asarray(np.linalg.norm(points[:, -1] - groomed, axis=1) / length)


def wanted(simulate: Simulate, rest: kernels.RestShape) -> bool:
    """Whether the config wants a sag-free rest shape, and can have one.

    "auto" takes what there is; for "sag_free", raises InputError where there is none: guides without stiffness or
    without a clamped root.
    """
    hair = simulate.hair
    stiff = hair.young_modulus > 0 and hair.shear_modulus > 0
    if simulate.rest == "auto":
        return simulate.torsion == "kirchhoff" and stiff
    if simulate.rest == "groom":
        return False
    if not stiff:
        raise InputError(
            'simulate.rest: "sag_free" needs stiffness to hold the groom with: simulate.hair.young_modulus and '
            'simulate.hair.shear_modulus must be positive; or set simulate.rest = "groom"'
        )
    hinged = ~_clamped(rest)
    if hinged.any():
        raise InputError(
            f'simulate.rest: "sag_free" cannot hold guide {int(np.argmax(hinged))}: its root is not clamped, so that '
            'nothing keeps it from turning; hold two points (groom.pins) or set simulate.rest = "auto"'
        )
    return True


def _head(rest: kernels.RestShape, field: kernels.DistanceField | None) -> tuple[_Vectors, _Vectors]:
    """Distance [m] of the points from the head, (G, P), and its normal there, (G, P, 3); infinitely far without one."""
    shape = rest.held.shape
    if field is None:
        return np.full(shape, np.inf), np.zeros((*shape, 3))
    distance, normal = kernels.distance(field, rest.points.reshape(-1, 3))
    return distance.reshape(shape), normal.reshape(*shape, 3)
