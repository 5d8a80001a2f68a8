"""Sag-free rest shapes of the curvature-and-torsion model "rotor", where they exist: on curls.

Each joint has one rest curvature, each segment one rest dihedral, and the clamped root keeps its first bend: as many
numbers as equations. From tip to root everything outboard is known, so that segment j has two equations, along the
normal n of its bend and along the binormal b, with two unknowns, the curvature kappa_r of its joint and the dihedral
phi_r about the segment before it:

    Rq = l_j W_j - (gradient on segment j without the two),   G R cos(phi_r + delta) = Rq.b
    k_kappa dl (kappa - kappa_r) dkappa/dn = Rq.n - (rotor).n

with R, delta the polar form of (d0.b, (d0 x d1).b), d0 = d_{j-2}, d1 = d_{j-1}, the unit segments before it. Torsion
acts on the bends beside it: a straight part cannot be held sideways (|Rq.b| > G R), whatever its rest shape.

An equilibrium is stable where the second variation of the energy by turns of the segments is positive definite. It
comes from differences of the gradient: a segment is coupled to two on either side.
"""

import numpy as np
from numpy.typing import NDArray

from pipeline import kernels

_Array = NDArray[np.float64]
_Held = NDArray[np.bool_]
_STIFFNESS = ("bending", "weight", "root_weight")
_SHAPE = ("curvature", "dihedral", "root_shift")

_LADDER = 1.5  # ratio of the factors that are tried
# kappa is rounded a little by its rest value, so that a joint is solved again with what was left
_CORRECTIONS = 3
_STEP = 1e-5  # [rad] of the differences
_NO_BEND = 1e-9  # sine below which a bend has no direction
_REACH = 2  # segments to either side that a segment is coupled to


def hold_curls(
    rest: kernels.RestShape, load: _Array, margin: float, max_factor: float
) -> tuple[_Array, _Held]:
    """Change rest curvatures, dihedrals, first bends and stiffness so that the points are at rest under a load.

    Stiffness is raised by no more than max_factor, until a strand is stable with 1 / margin of it. Returns the factors
    (G,) and which guides are held (G,); the others are left as they were groomed.
    """
    count = len(load)
    factor, held = np.ones(count), np.zeros(count, bool)
    softest = 1 / margin
    while not held.all() and softest * margin <= max_factor:
        found = ~held & _stable(_trial(rest, np.full(count, softest)), load)
        factor[found], held = max(1.0, softest * margin), held | found
        softest *= _LADDER
    final = _trial(rest, factor)
    held &= _stable(final, load)
    for name in (*_STIFFNESS, *_SHAPE):
        changed = getattr(rest, name)
        changed[held] = getattr(final, name)[held]
    return np.where(held, factor, 1.0), held


def net_force(rest: kernels.RestShape, load: _Array, held: _Held) -> float:
    """Largest net force on a free point of the guides held, in weights of a point."""
    segments = Segments(rest, load)
    through = (segments.gradient(segments.d) - segments.wanted) / segments.length[..., None]
    force = np.linalg.norm(np.diff(through, axis=1, append=0), axis=2) / (9.81 * rest.mass[:, 1:])
    return float(force[held][:, 1:].max(initial=0.0))


def tension(rest: kernels.RestShape, load: _Array) -> _Array:
    """Tension [N] of the segments under a load, (G, P-1); 0 between held points."""
    segments = Segments(rest, load)
    pull = dot(segments.force, segments.d)
    pull[:, 0] = 0
    return pull


class Segments:
    """The groom in unit segments d (G, P-1, 3), what the loads ask of them, and forces of a rest shape."""

    def __init__(self, rest: kernels.RestShape, load: _Array) -> None:
        self.rest = rest
        edges = np.diff(rest.points, axis=1)
        self.length = np.linalg.norm(edges, axis=2)
        self.d = edges / self.length[..., None]
        self.force = np.cumsum(load[:, ::-1], axis=1)[:, ::-1][:, 1:]
        self.wanted = self.length[..., None] * across(self.force, self.d)
        self.spacing = np.pad((self.length[:, 1:] + self.length[:, :-1]) / 2, ((0, 0), (1, 1)))

    def gradient(self, d: _Array) -> _Array:
        """Gradient of the energy by unit segments d, across them, (G, P-1, 3) [N m]."""
        steps = np.cumsum(self.length[..., None] * d, axis=1)
        points = np.concatenate([self.rest.points[:, :1], self.rest.points[:, :1] + steps], axis=1)
        force = kernels.bending(points, self.rest)[1]
        force = force + kernels.torsion_rotor(points, self.rest, self.rest.directors)[1]
        return np.asarray(-self.length[..., None] * np.cumsum(force[:, ::-1], axis=1)[:, ::-1][:, 1:])


def dot(a: _Array, b: _Array) -> _Array:
    """Products along the last axis."""
    return np.asarray((a * b).sum(-1))


def across(a: _Array, d: _Array) -> _Array:
    """What is left of a across unit vectors d."""
    return a - dot(a, d)[..., None] * d


def _trial(rest: kernels.RestShape, factor: _Array) -> kernels.RestShape:
    """A copy of a rest shape with so many times its stiffness."""
    S = len(factor)
    trial = kernels.rest_shape(
        rest.points, np.ones(S), rest.bending * factor, rest.twisting * factor, rest.held, rest.offset
    )
    for name in ("directors", "mass", "length", "ratio", *_SHAPE):
        setattr(trial, name, getattr(rest, name))
    trial.weight, trial.root_weight = rest.weight * factor[:, None], rest.root_weight * factor
    return trial


def _stable(rest: kernels.RestShape, load: _Array) -> _Held:
    """Solve the statics; which guides have a solution, and a stable one."""
    return solve(rest, load) & _positive(_second_variation(rest, load))


def _second_variation(rest: kernels.RestShape, load: _Array) -> _Array:
    """Blocks (G, n, 5, 2, 2) that couple free segment k to k - 2 .. k + 2, over turns in its two directions across."""
    segments = Segments(rest, load)
    d, count = segments.d, segments.d.shape[1] - 1
    first = across(np.eye(3)[np.abs(d).argmin(axis=2)], d)
    first /= np.linalg.norm(first, axis=2, keepdims=True)
    basis = np.stack([first, np.cross(d, first)], axis=2)
    blocks = np.zeros((len(d), count, 2 * _REACH + 1, 2, 2))
    index = np.arange(1, count + 1)

    def pull(turned: _Array) -> _Array:
        turned = turned / np.linalg.norm(turned, axis=2, keepdims=True)
        wanted = segments.length[..., None] * across(segments.force, turned)
        return np.asarray(np.einsum("gjak,gjk->gja", basis, segments.gradient(turned) - wanted)[:, 1:])

    for colour in range(2 * _REACH + 1):
        chosen = index[index % (2 * _REACH + 1) == colour]
        for a in range(2):
            step = np.zeros_like(d)
            step[:, chosen] = _STEP * basis[:, chosen, a]
            change = (pull(d + step) - pull(d - step)) / (2 * _STEP)
            for offset in range(-_REACH, _REACH + 1):
                rows = chosen - 1 + offset
                rows = rows[(rows >= 0) & (rows < count)]
                blocks[:, :, _REACH - offset, :, a][:, rows] = change[:, rows]
    return blocks


def _positive(blocks: _Array) -> _Held:
    """Which of the banded matrices are positive definite: block elimination, two segments at a time."""
    guides, count = blocks.shape[:2]
    pairs = (count + 1) // 2
    matrix = np.zeros((guides, pairs, 2, 4, 4))  # of a pair: with itself, and with the next
    matrix[:, :, 0] = np.eye(4) * np.abs(blocks).max(axis=(1, 2, 3, 4))[:, None, None, None]
    for k in range(count):
        for offset in range(-_REACH, _REACH + 1):
            other = k + offset
            if 0 <= other < count and other // 2 >= k // 2:
                rows, columns = 2 * (k % 2), 2 * (other % 2)
                matrix[:, k // 2, other // 2 - k // 2, rows : rows + 2, columns : columns + 2] = blocks[
                    :, k, offset + _REACH
                ]
    positive, carried = np.ones(guides, bool), np.zeros((guides, 4, 4))
    for pair in range(pairs):
        pivot = matrix[:, pair, 0] - carried
        pivot = (pivot + pivot.swapaxes(1, 2)) / 2
        positive &= np.linalg.eigvalsh(pivot)[:, 0] > 0
        coupling = matrix[:, pair, 1]
        solid = np.where(positive[:, None, None], pivot, np.eye(4))
        carried = coupling.swapaxes(1, 2) @ np.linalg.solve(solid, coupling)
    return positive


def solve(rest: kernels.RestShape, load: _Array) -> _Held:
    """Give a rest shape the rest curvatures, dihedrals and first bends that hold its points under a load (G, P, 3) [N].

    Returns where that was possible, (G,).
    """
    segments = Segments(rest, load)
    possible = np.asarray((rest.held[:, :2] == 1).all(axis=1) & (rest.held[:, 2:] == 0).all(axis=1))
    for j in range(load.shape[1] - 2, 1, -1):
        for _ in range(_CORRECTIONS):
            possible &= _joint(segments, j)
    return possible & _root(segments)


def _joint(segments: Segments, j: int) -> _Held:
    """Solve segment j for its curvature and the dihedral before it; where that was possible."""
    rest, dl = segments.rest, segments.spacing[:, j]
    d0, d1, d2 = (segments.d[:, j - k] for k in (2, 1, 0))
    curvature, dihedral, G, rho = rest.curvature, rest.dihedral, rest.weight[:, j - 2], rest.ratio[:, j - 2]
    bend = np.cross(d1, d2)
    sine = np.linalg.norm(bend, axis=1)
    bent = sine > _NO_BEND
    sine = np.where(bent, sine, 1.0)
    b = bend / sine[:, None]
    n = np.cross(b, d2)

    # The rotor's part along b is G (C A - S B), along n below; the bend's part along n is `stiffness` (kappa - kappa_r)
    A, B = dot(d0, b), dot(np.cross(d0, d1), b)
    p, q = dot(d0, d1), dot(d1, d2)

    def rotor(phi: _Array) -> tuple[_Array, _Array]:
        C, S = np.cos(phi), np.sin(phi)
        turned = -(q / rho + C * p) * dot(d1, n) + C * dot(d0, n) - S * dot(np.cross(d0, d1), n)
        return G * (C * A - S * B), G * turned

    kappa = 2 / dl * np.sqrt(np.maximum(1 - q, 0) / (1 + q))
    slope = -dot(d1, n) * 2 / (dl * sine * (1 + q))  # dkappa along n
    stiffness = np.where(bent, rest.bending * dl * slope, 1.0)
    phi, kappa_r = dihedral[:, j - 2], curvature[:, j - 1]
    left = segments.wanted[:, j] - segments.gradient(segments.d)[:, j]
    along_b, along_n = rotor(phi)
    need_b = dot(left, b) + along_b
    need_n = dot(left, n) + along_n + stiffness * (kappa - kappa_r)

    reach = G * np.hypot(A, B)
    part = need_b / np.where(reach > 0, reach, 1)
    angle = np.arccos(np.clip(part, -1, 1))
    delta = np.arctan2(B, A)
    turns = [(sign * angle - delta - phi + np.pi) % (2 * np.pi) - np.pi for sign in (1, -1)]
    phi = phi + np.where(np.abs(turns[0]) < np.abs(turns[1]), *turns)
    kappa_r = kappa - (need_n - rotor(phi)[1]) / stiffness
    possible = (reach > 0) & (np.abs(part) <= 1) & (kappa_r > 0) & bent
    dihedral[possible, j - 2], curvature[possible, j - 1] = phi[possible], kappa_r[possible]
    return np.asarray(possible)


def _root(segments: Segments) -> _Held:
    """Solve segment 1 for the first bend that the root keeps."""
    rest, d = segments.rest, segments.d
    axes = np.stack([rest.directors[:, 0], np.cross(d[:, 0], rest.directors[:, 0])], axis=1)
    left = segments.wanted[:, 1] - segments.gradient(d)[:, 1]
    G = np.where(rest.root_weight > 0, rest.root_weight, 1)
    flat = across(axes, d[:, 1:2])
    square = np.einsum("gak,gbk->gab", flat, axes)
    shift = -np.linalg.solve(square, (dot(axes, left[:, None]) / G[:, None])[..., None])[..., 0]
    kept = np.einsum("gak,gk->ga", axes, d[:, 1]) + rest.root_shift + shift
    possible = (rest.root_weight > 0) & (np.linalg.norm(kept, axis=1) < 1)
    rest.root_shift = np.where(possible[:, None], rest.root_shift + shift, rest.root_shift)
    return np.asarray(possible)
