"""Cubic curves of files: their bases, their ends, and how near their points' chords are."""

from typing import get_args

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.interpolate import BPoly, BSpline, CubicHermiteSpline

from pipeline.errors import InputError
from pipeline.strands.formats.curves import Curves, Kind, Wrap, polylines, segment_counts

Points = NDArray[np.float64]
KINDS: tuple[Kind, ...] = get_args(Kind)


def curves(
    counts: list[int], kind: Kind, wrap: Wrap = "nonperiodic", widths: object = None, of: str = "vertex"
) -> Curves:
    steps = np.random.default_rng(2).normal((1.0, 0, 0), 0.4, (sum(counts), 3))
    points = np.cumsum(steps, axis=0)
    found = None if widths is None else np.asarray(widths, np.float64)
    return Curves("file: prim", points, np.array(counts), kind, wrap, found, of)


def exact(c: Points, kind: Kind, u: NDArray[np.float64]) -> Points:
    """An open curve by scipy's own bases, u from 0 to the number of segments."""
    if kind == "linear":
        return np.stack([np.interp(u, np.arange(len(c)), c[:, i]) for i in range(3)], axis=1)
    if kind == "bezier":
        pieces = c[3 * np.arange((len(c) - 1) // 3)[:, None] + np.arange(4)]
        return np.asarray(BPoly(pieces.swapaxes(0, 1), np.arange(len(pieces) + 1.0))(u))
    if kind == "bspline":
        return np.asarray(BSpline(np.arange(-3, len(c) + 1.0), c, 3)(u))
    slopes = (c[2:] - c[:-2]) / 2
    return np.asarray(CubicHermiteSpline(np.arange(len(c) - 2.0), c[1:-1], slopes)(u))


def distance_to(line: Points, points: Points) -> NDArray[np.float64]:
    """Of points (N, 3) from a polyline (M, 3)."""
    a, d = line[:-1], np.diff(line, axis=0)
    along = np.einsum("nmi,mi->nm", points[:, None] - a, d) / np.einsum("mi,mi->m", d, d)
    nearest = a + np.clip(along, 0, 1)[..., None] * d
    return np.asarray(np.linalg.norm(points[:, None] - nearest, axis=2).min(axis=1))


@pytest.mark.parametrize("kind", KINDS)
def test_points_lie_on_the_curve_and_chords_near_it(kind: Kind) -> None:
    many = curves([4, 7, 13, 4], kind)
    x, counts, _ = polylines(many)
    for first, n, begin, found in zip(
        (0, 4, 11, 24), (4, 7, 13, 4), np.cumsum(counts) - counts, counts, strict=True
    ):
        control = many.points[first : first + n]
        segments = {"linear": n - 1, "bezier": (n - 1) // 3}.get(kind, n - 3)
        dense = exact(control, kind, np.linspace(0, segments, 1000 * segments + 1))
        length = np.linalg.norm(np.diff(dense, axis=0), axis=1).sum()
        line = x[begin : begin + found]
        off, missed = distance_to(dense, line).max() / length, distance_to(line, dense).max() / length
        print(f"{kind} of {n}: {found} points, {off:.1e} of the length off the curve, chords {missed:.1e}")
        assert np.abs(line[[0, -1]] - dense[[0, -1]]).max() < 1e-12 * length
        assert off < 1e-6  # of the dense polyline itself
        assert missed < 3.1e-4


@pytest.mark.parametrize("kind", ["bspline", "catmullRom"])
@pytest.mark.parametrize("n", [2, 3, 8])
def test_a_pinned_curve_begins_and_ends_at_its_outermost_points(kind: Kind, n: int) -> None:
    pinned = curves([5, n], kind, "pinned")
    x, counts, _ = polylines(pinned)
    assert np.abs(x[counts[0]] - pinned.points[5]).max() < 1e-14
    assert np.abs(x[-1] - pinned.points[-1]).max() < 1e-14


def test_a_curve_of_catmull_and_rom_passes_its_points() -> None:
    pinned = curves([9], "catmullRom", "pinned")
    x, _, _ = polylines(pinned)
    for point in pinned.points:
        assert np.abs(x - point).max(axis=1).min() < 1e-14


@pytest.mark.parametrize("kind", KINDS)
def test_a_periodic_curve_comes_back(kind: Kind) -> None:
    x, counts, _ = polylines(curves([6, 9], kind, "periodic"))
    ends = np.cumsum(counts) - 1
    assert np.abs(x[ends] - x[ends - counts + 1]).max() < 1e-14


def test_a_periodic_bspline_of_a_regular_polygon_is_round() -> None:
    angle = np.arange(12) * 2 * np.pi / 12
    polygon = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    x, _, _ = polylines(Curves("", polygon, np.array([12]), "bspline", "periodic"))
    radius = np.linalg.norm(x, axis=1)
    print(f"radius {radius.min():.5f} to {radius.max():.5f}")
    assert np.ptp(radius) < 5e-4


@pytest.mark.parametrize(
    ("kind", "wrap", "counts", "segments"),
    [
        ("linear", "nonperiodic", [0, 1, 2, 5], [0, 0, 1, 4]),
        ("linear", "periodic", [1, 3], [0, 3]),
        ("bezier", "nonperiodic", [0, 1, 3, 4, 5, 7], [0, 0, 0, 1, 0, 2]),
        ("bezier", "periodic", [0, 3, 4, 6], [0, 1, 0, 2]),
        ("bezier", "pinned", [4, 7], [1, 2]),
        ("bspline", "nonperiodic", [3, 4, 6], [0, 1, 3]),
        ("bspline", "pinned", [1, 2, 3], [0, 1, 2]),
        ("catmullRom", "periodic", [2, 3, 4], [0, 3, 4]),
    ],
)
def test_numbers_of_points_that_fit_no_segment_give_no_strand(
    kind: Kind, wrap: Wrap, counts: list[int], segments: list[int]
) -> None:
    found = curves(counts, kind, wrap)
    assert segment_counts(found).tolist() == segments
    assert (polylines(found)[1] == 0).tolist() == [n == 0 for n in segments]


@pytest.mark.parametrize("kind", KINDS)
def test_widths_of_every_interpolation_go_from_root_to_tip(kind: Kind) -> None:
    n = 7
    ends = {"linear": n, "bezier": 3}.get(kind, n - 2)
    many = [1, n, n]  # the first has too few points, but for a line
    cases = {
        "constant": [0.5],
        "uniform": [9.0, 0.5, 0.25],
        "varying": np.tile(np.linspace(0, 1, ends), 2),
        "vertex": np.r_[9.0, np.tile(np.linspace(0, 1, n), 2)],
    }
    for of, widths in cases.items():
        x, counts, found = polylines(curves(many, kind, widths=widths, of=of))
        assert found is not None
        assert len(found) == len(x)
        root, tip = found[counts[0] + counts[1]], found[-1]
        if of in ("constant", "uniform"):
            assert root == tip == (0.5 if of == "constant" else 0.25)
        elif of == "varying" or kind in ("linear", "bezier"):
            assert (root, tip) == pytest.approx((0, 1), abs=1e-6)
        else:  # an open cubic curve begins at its second control point
            assert (root, tip) == pytest.approx((1 / 6, 5 / 6), abs=1e-6)
        assert (np.diff(found[-counts[2] :]) >= 0).all()


def test_what_does_not_fit_is_refused_by_name() -> None:
    with pytest.raises(InputError, match=r"file: prim: 5 widths with interpolation 'vertex'; expected 8"):
        polylines(curves([4, 4], "bspline", widths=np.ones(5)))
    with pytest.raises(InputError, match="file: prim: its curves have 8 points, but there are 9 positions"):
        Curves("file: prim", np.zeros((9, 3)), np.array([4, 4]), "linear", "nonperiodic")
    with pytest.raises(InputError, match="curve 1 has a negative number of points"):
        Curves("file: prim", np.zeros((3, 3)), np.array([4, -1]), "linear", "nonperiodic")


def test_a_curve_that_is_not_finite_is_left_to_the_repairs() -> None:
    broken = curves([4, 8], "bspline")
    broken.points[2] = np.nan
    x, counts, _ = polylines(broken)
    assert np.isnan(x[: counts[0]]).any()
    assert np.isfinite(x[counts[0] :]).all()
