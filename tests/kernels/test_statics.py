"""Inverse statics: the rest shape that holds a groom is exact, and its stability is what buckling theory says."""

from collections.abc import Callable

import numpy as np
import pytest
import rod_twin
from named_strands import helix
from scipy.linalg import eigh, null_space
from scipy.optimize import nnls
from strand_scenes import BENDING, MASS_PER_LENGTH, TWISTING, Points, roots, rotation, shape

from pipeline import kernels

GRAVITY = np.array([0.0, -9.81, 0.0])


def grooms() -> dict[str, Points]:
    """Straight, wavy, curly and tight strands in several directions, (S, 32, 3) each."""
    strands = {
        "straight": np.linspace([0, 0, 0], [0.2, 0, 0], 32),
        "wavy": helix(0.01, 0.065, 0.2, 32),
        "curly": helix(0.005, 0.03, 0.15, 32),
        "tight": helix(0.0025, 0.012, 0.1, 32),
    }
    turns = [
        rotation((0, 0, 1), angle) @ rotation((0, 1, 0), 2 * angle) for angle in np.linspace(-1.5, 1.5, 9)
    ]
    return {name: np.array([strand @ turn.T for turn in turns]) for name, strand in strands.items()}


def weight(rest: kernels.RestShape) -> Points:
    """Weight of the points, (S, P, 3) [N]."""
    return np.ascontiguousarray(rest.mass[..., None] * GRAVITY)


def balance(
    rest: kernels.RestShape,
    load: Points,
    normal: Points | None = None,
    margin: float = 1.5,
    most: float = 50.0,
) -> kernels.SagFree:
    """The statics of a rest shape; the head supports no point unless told, and then all strands that need it."""
    return kernels.sag_free(rest, load, np.zeros_like(load) if normal is None else normal, margin, most, 1.0)


def residual(
    rest: kernels.RestShape, found: kernels.SagFree, load: Points, normal: Points | None = None
) -> float:
    """Largest net force on a free point, in weights of a point, and largest moment about a segment."""
    rest.strain = found.strain
    for name in ("bending", "bending_2", "twisting"):
        setattr(rest, name, getattr(rest, name) * found.factor)
    force, turning = kernels.kirchhoff(rest.points, rest.directors, rest)[1:]
    edges = np.diff(rest.points, axis=1)
    pull = found.tension[..., None] * edges / np.linalg.norm(edges, axis=2, keepdims=True)
    force = force + load
    force[:, :-1] += pull
    force[:, 1:] -= pull
    if normal is not None:
        force += found.reaction[..., None] * normal
    unit = 9.81 * rest.mass.mean()
    free = rest.held == 0
    moments = np.abs(turning[free[:, 1:]]).max() / (unit * rest.length.mean())
    return float(np.linalg.norm(force, axis=2)[free].max() / unit + moments)


@pytest.mark.parametrize("name", ["straight", "wavy", "curly", "tight"])
def test_the_groom_is_in_equilibrium(name: str) -> None:
    """Also with uneven segments, an elliptic section and a weight at the tip."""
    points = grooms()[name]
    rest = shape(points)
    worst = residual(rest, balance(rest, weight(rest)), weight(rest))
    groomed = shape(points)
    sagging = np.abs(kernels.kirchhoff(points, groomed.directors, groomed)[1]).max()
    uneven = shape(points[:, np.r_[0, 1, 2:12:2, 12, 13, 14:32:3]])
    uneven.bending_2 = 0.5 * uneven.bending
    load = weight(uneven)
    load[:, -1] += (1e-5, 2e-5, -1e-5)
    general = residual(uneven, balance(uneven, load), load)
    print(f"{name}: net force {worst:.1e} point weights, uneven, elliptic and loaded {general:.1e}")
    assert sagging < 1e-9
    assert max(worst, general) < 1e-8


def second_variation(
    strand: Points, found: kernels.SagFree, rest: kernels.RestShape, load: Points
) -> tuple[Points, Points]:
    """H0 and Hg (3n, 3n) by central differences of the energy, over rotations of the n free segments."""
    edges = np.diff(strand, axis=0)
    length = np.linalg.norm(edges, axis=1)
    t, m, dl = edges / length[:, None], rest.directors[0], (length[1:] + length[:-1]) / 2
    B = np.array([rest.bending[0], rest.bending_2[0], rest.twisting[0]])
    u = kernels.strains(strand[None], rest.directors[:1])[0]
    r = u + (found.strain[0] - u) * found.factor[0]

    def energy(turns: Points, natural: Points, force: Points) -> float:
        tangents, directors = t.copy(), m.copy()
        for j, turn in enumerate(turns.reshape(-1, 3), start=1):
            if turn.any():
                R = rotation(tuple(turn), float(np.linalg.norm(turn)))
                tangents[j], directors[j] = R @ t[j], R @ m[j]
        k1, k2, twist = rod_twin.strains(tangents, directors, np.zeros(len(dl)))
        strain = np.stack([k1, k2, twist], -1)
        points = np.cumsum(length[1:, None] * tangents[1:], axis=0)
        return float((B * (strain - natural) ** 2 / (2 * dl[:, None])).sum() - (force * points).sum())

    elastic = differences(lambda w: energy(w, u, 0 * load[0, 2:]), 3 * (len(t) - 1))
    return elastic, differences(lambda w: energy(w, r, load[0, 2:]), len(elastic)) - elastic


def differences(energy: Callable[[Points], float], count: int, step: float = 2e-4) -> Points:
    """Second derivatives of a function of `count` numbers at 0, banded as the rotations of a chain are."""
    H = np.zeros((count, count))
    eye = step * np.eye(count)
    for i in range(count):
        for j in range(i, min(count, 3 * (i // 3) + 6)):
            same, other = eye[i] + eye[j], eye[i] - eye[j]
            H[i, j] = H[j, i] = (energy(same) - energy(other) - energy(-other) + energy(-same)) / (
                4 * step**2
            )
    return H


@pytest.mark.parametrize("name", ["straight", "wavy", "curly", "tight"])
def test_critical_factor_is_the_largest_eigenvalue_of_the_second_variation(name: str) -> None:
    for strand in grooms()[name][::4, :12]:
        rest = shape(strand[None])
        rest.bending_2 = 1.7 * rest.bending
        found = balance(rest, 5 * weight(rest))
        H0, Hg = second_variation(strand, found, rest, 5 * weight(rest))
        expected = eigh(-Hg, H0, eigvals_only=True)[-1]
        print(f"{name}: critical factor {found.critical[0]:.5f}, dense {expected:.5f}")
        assert found.critical[0] == pytest.approx(expected, rel=2e-3, abs=2e-4)


def test_critical_factor_knows_what_the_head_holds() -> None:
    """Points with a reaction can only move along the head: the second variation on that subspace."""
    strand = grooms()["curly"][6, :12]
    rest, normal = shape(strand[None]), np.zeros((1, 12, 3))
    normal[0, [4, 7, 11]] = (0, 1, 0), (0.6, 0.8, 0), (0, 0.8, 0.6)
    load = 30 * weight(rest)
    found = balance(rest, load, normal)
    total = load + found.reaction[..., None] * normal
    H0, Hg = second_variation(strand, found, rest, total)
    edges, rows = np.diff(strand, axis=0), []
    for k in np.flatnonzero(found.reaction[0]):
        arms = np.where(np.arange(1, 11)[:, None] < k, np.cross(edges[1:], normal[0, k]), 0)
        rows.append(arms.ravel())
    N = null_space(np.array(rows))
    expected = eigh(-N.T @ Hg @ N, N.T @ H0 @ N, eigvals_only=True)[-1]
    alone = balance(rest, load).critical[0]
    print(
        f"critical factor {found.critical[0]:.4f} with {len(rows)} contacts, dense {expected:.4f}, without {alone:.4f}"
    )
    assert found.critical[0] == pytest.approx(expected, rel=0.02)
    assert found.critical[0] < 0.7 * alone


def test_upright_strand_buckles_at_greenhills_length() -> None:
    """w L^3 / EI = 7.8373 (Greenhill 1881), with second order in the spacing; the clamp is half way along segment 0."""
    errors, counts = [], np.array([16, 32, 64])
    for count in counts:
        rest = shape(np.linspace([0, 0, 0], [0, 0.1, 0], count)[None])
        free = 0.1 - 0.5 * rest.length[0, 0]
        found = balance(rest, weight(rest))
        errors.append(abs(MASS_PER_LENGTH * 9.81 * free**3 / BENDING / found.critical[0] / 7.8373 - 1))
    order = -np.polyfit(np.log(counts), np.log(errors), 1)[0]
    print(f"Greenhill: errors {', '.join(f'{100 * e:.3f} %' for e in errors)}, order {order:.2f}")
    assert errors[1] < 2e-3


def test_stiffening_makes_a_long_strand_stable_by_the_margin() -> None:
    """The critical factor scales with the stiffness: with the factor given, what is left is 1 / margin."""
    rest = shape(grooms()["straight"])
    found = balance(rest, weight(rest), margin=1.5)
    for name in ("bending", "bending_2", "twisting"):
        setattr(rest, name, getattr(rest, name) * found.factor)
    again = balance(rest, weight(rest)).critical[found.factor > 1]
    print(
        f"{len(again)} of 9 strands stiffened by up to {found.factor.max():.1f}; critical then {again.max():.4f}"
    )
    assert len(again) > 5
    assert again == pytest.approx(np.full(len(again), 1 / 1.5), rel=1e-3)
    capped = balance(shape(grooms()["straight"]), weight(rest), most=2.0)
    assert capped.factor.max() == 2.0
    assert np.array_equal(capped.needed, found.needed)


def test_no_rest_strain_changes_by_more_than_a_quarter_turn() -> None:
    """Past half a turn a twist would wrap round and hold nothing. Hanging strands are stable under any load."""
    hanging = grooms()["curly"][4:5] @ rotation((0, 0, 1), -np.pi / 2).T
    rest = shape(hanging)
    load = 400 * weight(rest)
    found = balance(rest, load, margin=1.0, most=1e4)
    change = np.abs(found.strain - rest.strain).max()
    print(
        f"critical factor {found.critical[0]:.1f}, given {found.factor[0]:.1f}, largest change {change:.3f} rad"
    )
    assert found.factor[0] > 1.1 * found.critical[0]
    assert change == pytest.approx(np.pi / 2, rel=1e-9)
    assert residual(rest, found, load) < 1e-8


def lying(count: int = 32) -> tuple[kernels.RestShape, Points]:
    """A strand that lies along a ground for half of its length, and the normals of the head at its points."""
    points = np.linspace([0, 0, 0], [0.12, 0, 0], count)
    points[:, 1] = 0.01 * np.clip((0.05 - points[:, 0]) / 0.05, 0, 1) ** 2
    normal = np.zeros((count, 3))
    normal[points[:, 1] == 0] = (0, 1, 0)
    return shape(points[None]), normal[None]


def test_reactions_change_the_rest_shape_least() -> None:
    """Non-negative least squares of what gravity leaves to the rest shape, and of the head's yield (1e-3 L^3 / 3B)."""
    rest, normal = lying()
    load = weight(rest)
    found = balance(rest, load, normal)
    u, B = rest.strain[0], np.array([BENDING, BENDING, TWISTING])
    dl = (rest.length[0, 1:] + rest.length[0, :-1])[:, None] / 2

    def change(force: Points) -> Points:
        """What a load does to the rest strains, in square roots of its energy: linear in the load."""
        return ((balance(rest, force).strain[0] - u) * np.sqrt(B / dl)).ravel() * balance(rest, force).factor[
            0
        ]

    supported = np.flatnonzero(normal[0].any(axis=1))
    columns = []
    for k in supported:
        force = np.zeros_like(load)
        force[0, k] = 1e-7 * normal[0, k]
        columns.append(change(force) / 1e-7)
    give = np.sqrt(1e-3 * rest.length[0, 1:].sum() ** 3 / (3 * BENDING)) * np.eye(len(supported))
    wanted = np.concatenate([-change(load), np.zeros(len(supported))])
    expected, _ = nnls(np.concatenate([np.array(columns).T, give]), wanted)
    carried = found.reaction.sum() / -load[0, 2:, 1].sum()
    print(
        f"{(found.reaction > 0).sum()} of {len(supported)} points carry {100 * carried:.0f} % of the weight"
    )
    assert found.reaction[0, supported] == pytest.approx(expected, rel=1e-5, abs=1e-6 * expected.max())
    assert residual(rest, found, load, normal) < 1e-8
    assert found.critical[0] < balance(lying()[0], load).critical[0]


def test_the_statics_depend_neither_on_threads_nor_on_neighbours() -> None:
    points = np.concatenate(list(grooms().values()))
    rest = shape(points)
    normal = np.tile(np.array([0.0, 1, 0]), (*points.shape[:2], 1))
    results = []
    for threads in (1, 2):
        kernels.set_threads(threads)
        results.append(balance(rest, weight(rest), normal))
    kernels.set_threads(0)
    one = shape(points[17:18])
    alone = balance(one, weight(one), normal[:1])
    for name in ("strain", "tension", "reaction", "critical", "factor"):
        both = [getattr(found, name) for found in results]
        assert np.array_equal(*both)
        assert np.array_equal(both[0][17], getattr(alone, name)[0])


@pytest.mark.parametrize("held", [(-1,), (-2, -1), (14, 15, -2, -1), (20,)])
@pytest.mark.parametrize("name", ["straight", "wavy", "curly"])
def test_strands_held_elsewhere_too_are_in_equilibrium(name: str, held: tuple[int, ...]) -> None:
    """A hinged or clamped tip, and points in between: their holders take what changes the rest shape least."""
    points = grooms()[name]
    pins = roots(*points.shape[:2])
    pins[:, list(held)] = 2
    rest, alone = shape(points, pins), shape(points)
    load = weight(rest)
    found, without = balance(rest, load), balance(alone, load)
    change, most = (np.abs(f.strain - rest.strain).max() for f in (found, without))
    print(
        f"{name}, held at {held}: net force {residual(rest, found, load):.1e}, largest change {change:.4f} "
        f"({most:.4f} without), critical factor {found.critical.max():.3f} ({without.critical.max():.3f})"
    )
    assert residual(shape(points, pins), found, load) < 1e-8
    assert found.critical.max() < without.critical.max()


def test_strands_without_a_clamp_keep_the_groom() -> None:
    points = grooms()["wavy"]
    pins = roots(9, 32)
    pins[3, 1] = pins[4, :2] = 0
    found = balance(shape(points, pins), weight(shape(points)))
    groomed = shape(points).strain
    assert found.strain[3:5] == pytest.approx(groomed[3:5], abs=1e-14)
    assert np.abs(found.strain[2] - groomed[2]).max() > 1e-3
    assert (found.tension[3:5] == 0).all()
    assert (found.factor[3:5] == 1).all()
