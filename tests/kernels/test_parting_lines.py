"""Partings: exact crossings, one side of a line for every root, and neighbours that none lies before."""

from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray

from pipeline import kernels
from pipeline.strands.chart import Chart
from pipeline.strands.partings import NOBODY, Neighbours, Partings

FLAT = Chart.from_above()
RANDOM = np.random.default_rng(5)
ZIGZAG = np.stack([0.02 * np.array([1, -1] * 6), np.linspace(-0.1, 0.1, 12)], axis=1)


def ways(partings: Partings, a: NDArray[np.float64], b: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Whether the way from each a to the b of the same row crosses."""
    return partings.across(a, b, np.arange(len(a))[:, None])[:, 0]


def left_of(p: list[Fraction], q: list[Fraction], x: list[Fraction]) -> bool:
    return (q[0] - p[0]) * (x[1] - p[1]) - (q[1] - p[1]) * (x[0] - p[0]) >= 0


def test_crossings_are_those_of_exact_arithmetic() -> None:
    """Random ways over a zig-zag, and ways between points of a coarse lattice, which often touch ends and lines."""
    random = RANDOM.uniform(-0.1, 0.1, (2, 1500, 2))
    lattice = RANDOM.integers(-4, 5, (2, 1500, 2)) / 4.0
    corners = np.array([[-0.5, -1], [0, 0], [0.5, -0.5], [0.5, 0.75], [-1, 0.75]])
    for (a, b), line in ((random, ZIGZAG), (lattice, corners)):
        found = ways(Partings(FLAT, (line,)), a, b)
        wanted = []
        for one, other in zip(a, b, strict=True):
            ends = sorted([[Fraction(v) for v in one], [Fraction(v) for v in other]])
            points = [[Fraction(v) for v in corner] for corner in line]
            wanted.append(
                any(
                    left_of(p, q, ends[0]) != left_of(p, q, ends[1])
                    and left_of(*ends, p) != left_of(*ends, q)
                    for p, q in pairwise(points)
                )
            )
        print(f"{found.sum()} of {len(a)} ways cross, {np.sum(found != wanted)} of them differ")
        assert 100 < found.sum() < len(a) - 100
        assert np.array_equal(found, wanted)


def test_there_and_back_are_the_same_way() -> None:
    a, b = RANDOM.integers(-4, 5, (2, 4000, 2)) / 4.0
    box = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5], [-0.5, -0.5]])
    partings = Partings(FLAT, (box,))
    there, back = ways(partings, a, b), ways(partings, b, a)
    print(f"{there.sum()} of {len(a)} ways cross, {np.sum(there != back)} of them one way only")
    assert np.array_equal(there, back)


def test_a_way_into_a_closed_parting_crosses_it_and_one_inside_does_not() -> None:
    angle = np.linspace(0, 2 * np.pi, 90)
    ring = 0.05 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    ring[-1] = ring[0]
    a, b = RANDOM.uniform(-0.1, 0.1, (2, 20_000, 2))
    inside = [np.hypot(*p.T) < 0.0499 for p in (a, b)]
    outside = [np.hypot(*p.T) > 0.05 for p in (a, b)]
    found = ways(Partings(FLAT, (ring,)), a, b)
    into = (inside[0] & outside[1]) | (outside[0] & inside[1])
    print(f"{into.sum()} ways in or out, {found[into].sum()} cross; {(inside[0] & inside[1]).sum()} inside")
    assert found[into].all()
    assert not found[inside[0] & inside[1]].any()


def test_behind_the_end_of_a_line_hair_belongs_together() -> None:
    line = Partings(FLAT, (np.array([[0.0, 0.0], [0.0, 1.0]]),))
    a, b = np.array([[-0.1, 0.5], [-0.1, -0.5]]), np.array([[0.1, 0.5], [0.1, -0.5]])
    assert ways(line, a, b).tolist() == [True, False]


def test_neighbours_are_the_nearest_of_those_that_no_parting_lies_before() -> None:
    roots = np.zeros((3000, 3))
    roots[:, [0, 2]] = RANDOM.uniform(-0.1, 0.1, (3000, 2))
    points, targets = roots[:1000], roots[1000:1400]
    partings = Partings(FLAT, (ZIGZAG,))
    near = Neighbours(targets, partings).near(points, 12, enough=4)
    everyone = np.tile(np.arange(400), (1000, 1))
    across = partings.across(FLAT.uv(points), FLAT.uv(targets), everyone)
    distance = np.linalg.norm(points[:, None] - targets[None], axis=2)
    order = np.argsort(np.where(across, np.inf, distance), axis=1)[:, :12]
    there = near != NOBODY
    print(f"{there.sum(axis=1).min()} neighbours at least; {across.mean():.2f} of all ways cross")
    assert (there.sum(axis=1) >= 4).all()
    assert (near == order)[there].all()
    assert not np.take_along_axis(across, near, axis=1)[there].any()


def test_who_is_shut_in_alone_has_nobody() -> None:
    box = np.array([[-0.01, -0.01], [0.01, -0.01], [0.01, 0.01], [-0.01, 0.01], [-0.01, -0.01]])
    targets = np.array([[0.05, 0, 0], [0, 0, 0.05], [-0.05, 0, 0]])
    near = Neighbours(targets, Partings(FLAT, (box,))).near(np.array([[0.0, 0, 0], [0.04, 0, 0]]), 2)
    assert near[0].tolist() == [NOBODY, NOBODY]
    assert near[1, 0] == 0


def test_crossings_do_not_depend_on_threads() -> None:
    a, b = RANDOM.uniform(-0.1, 0.1, (2, 5000, 2))
    candidate = RANDOM.integers(0, 5000, (5000, 6))
    partings = Partings(FLAT, (ZIGZAG, ZIGZAG + 0.03))
    found = []
    for count in (1, 3):
        kernels.set_threads(count)
        found.append(partings.across(a, b, candidate))
    assert np.array_equal(*found)


def test_what_does_not_fit_is_refused() -> None:
    with pytest.raises(ValueError, match="not finite"):
        kernels.PartingLines(np.array([[[0, 0], [np.nan, 1]]]))
    lines = kernels.PartingLines(np.zeros((1, 2, 2)))
    with pytest.raises(ValueError, match="names no target"):
        lines.across(np.zeros((1, 2)), np.zeros((3, 2)), np.array([[3]]))
    with pytest.raises(ValueError, match="a row of candidates"):
        lines.across(np.zeros((2, 2)), np.zeros((3, 2)), np.array([[0]]))


def test_the_chart_keeps_areas_and_comes_back() -> None:
    turn = np.linalg.qr(RANDOM.normal(size=(3, 3)))[0]
    chart = Chart(np.array([0.1, 0.2, 0.3]), turn).placed(2.0, np.array([1.0, 0, 0]))
    uv = RANDOM.uniform(-0.66, 0.66, (4000, 2))
    back = chart.uv(chart.center + 0.07 * chart.rays(uv))
    step = 1e-5
    du, dv = ((chart.rays(uv + step * e) - chart.rays(uv - step * e)) / (2 * step) for e in np.eye(2))
    area = np.linalg.norm(np.cross(du, dv), axis=1)
    print(
        f"round trip {np.abs(back - uv).max():.1e}; area a unit of the chart {area.min():.6f} to {area.max():.6f}"
    )
    assert np.abs(back - uv).max() < 1e-12
    assert np.abs(area - 4).max() < 1e-6
