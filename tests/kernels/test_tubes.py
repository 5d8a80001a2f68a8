"""Tubes are those of VTK's tube filter, without the sides that no eye outside sees."""

import numpy as np
import pytest
from numpy.typing import NDArray
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
from vtkmodules.vtkFiltersCore import vtkTubeFilter

from pipeline import kernels

Points = NDArray[np.float32]
EYE = np.array([0.2, 0.1, 0.7])


def curls(strands: int = 21, points: int = 24) -> tuple[Points, Points]:
    """Helices that thin out, and their widths."""
    rng = np.random.default_rng(4)
    t = np.linspace(0, 1, points)
    turn = rng.uniform(3, 14, (strands, 1)) * t + rng.uniform(0, 6, (strands, 1))
    radius = rng.uniform(0.002, 0.02, (strands, 1))
    centre = rng.uniform(-0.05, 0.05, (strands, 2, 1))
    shape = [centre[:, 0] + radius * np.cos(turn), -0.1 * t + 0 * turn, centre[:, 1] + radius * np.sin(turn)]
    widths = np.broadcast_to(2e-3 * (1.05 - t), (strands, points))
    return np.stack(shape, axis=-1).astype(np.float32), np.ascontiguousarray(widths, np.float32)


def by_vtk(points: Points, widths: Points, sides: int) -> Points:
    """Corners (P, K, 3) of one strand by VTK's tube filter."""
    mesh, place, cells = vtkPolyData(), vtkPoints(), vtkCellArray()
    place.SetData(numpy_to_vtk(points, deep=True))
    cells.InsertNextCell(len(points))
    for j in range(len(points)):
        cells.InsertCellPoint(j)
    mesh.SetPoints(place)
    mesh.SetLines(cells)
    radius = numpy_to_vtk(widths.astype(np.float64) / 2, deep=True)
    radius.SetName("radius")
    mesh.GetPointData().SetScalars(radius)
    tube = vtkTubeFilter()
    tube.SetInputData(mesh)
    tube.SetNumberOfSides(sides)
    tube.SetVaryRadiusToVaryRadiusByAbsoluteScalar()
    tube.Update()
    return np.array(vtk_to_numpy(tube.GetOutput().GetPoints().GetData()), np.float32).reshape(-1, sides, 3)


def all_drawn(points: Points) -> NDArray[np.bool_]:
    return np.ones((points.shape[0], points.shape[1] - 1), bool)


@pytest.mark.parametrize("sides", [3, 4, 8])
def test_corners_are_those_of_vtks_tube_filter(sides: int) -> None:
    points, widths = curls()
    corners, _ = kernels.tubes(points, widths, all_drawn(points), sides, EYE)
    apart = max(np.abs(corners[s] - by_vtk(points[s], widths[s], sides)).max() for s in range(len(points)))
    print(f"{sides} sides: {apart:.1e} m apart at most, tubes are 2 mm wide")
    assert apart < 1e-8


def whole_tube(points: int, sides: int) -> NDArray[np.int64]:
    """All triangles (T, 3) of a tube, with both lids."""
    j, k = (part.ravel() for part in np.meshgrid(np.arange(points - 1), np.arange(sides), indexing="ij"))
    a, b = j * sides + k, j * sides + (k + 1) % sides
    sheets = [np.stack([a, a + sides, b], axis=1), np.stack([b, a + sides, b + sides], axis=1)]
    fan, last = np.arange(1, sides - 1), (points - 1) * sides
    lids = [np.stack([0 * fan, fan + 1, fan], axis=1), last + np.stack([0 * fan, fan, fan + 1], axis=1)]
    return np.concatenate(sheets + lids)


def nearest(
    eye: NDArray[np.float64], rays: NDArray[np.float64], corners: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Distance (N,) along rays (N, 3) to the first of triangles (T, 3, 3); endless where there is none.

    Moeller and Trumbore, Fast, minimum storage ray-triangle intersection, 1997.
    """
    first = np.full(len(rays), np.inf)
    for a, b, c in corners:
        across = np.cross(rays, c - a)
        volume = across @ (b - a)
        with np.errstate(divide="ignore", invalid="ignore"):
            u = across @ (eye - a) / volume
            v = rays @ np.cross(eye - a, b - a) / volume
            t = (c - a) @ np.cross(eye - a, b - a) / volume
        hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0)
        first[hit] = np.minimum(first[hit], t[hit])
    return first


@pytest.mark.parametrize("sides", [3, 4, 7])
def test_rays_meet_the_triangles_that_face_the_eye_where_they_meet_the_whole_tube(sides: int) -> None:
    points, widths = curls(1)
    corners, front = kernels.tubes(points, 3 * widths, all_drawn(points), sides, EYE)
    flat = corners.reshape(-1, 3).astype(np.float64)
    every = whole_tube(points.shape[1], sides)
    rng = np.random.default_rng(8)
    aims = points[0, rng.integers(0, points.shape[1], 1500)] + rng.uniform(-4e-3, 4e-3, (1500, 3))
    rays = aims - EYE
    found, wanted = (nearest(EYE, rays, flat[some]) for some in (front, every))
    hit = np.isfinite(wanted)
    print(f"{sides} sides: {len(front)} of {len(every)} triangles, {hit.sum()} of {len(rays)} rays hit")
    assert 0.4 * len(every) < len(front) < 0.6 * len(every)
    assert 300 < hit.sum() < 1400
    assert np.array_equal(hit, np.isfinite(found))
    assert np.abs(found[hit] - wanted[hit]).max() < 1e-9


def test_the_outline_of_a_fine_tube_covers_what_the_tube_covers() -> None:
    """At most a radius farther away, with a pair of triangles a segment; what is wider keeps its sides."""
    points, widths = curls(1, points=60)
    widths *= 0.2
    corners, front = kernels.tubes(points, widths, all_drawn(points), 4, EYE)
    _, outline = kernels.tubes(points, widths, all_drawn(points), 4, EYE, 1e-3)
    _, kept = kernels.tubes(points, widths, all_drawn(points), 4, EYE, 1e-5)
    assert np.array_equal(kept, front)
    flat = corners.reshape(-1, 3).astype(np.float64)
    rng = np.random.default_rng(8)
    aims = points[0, rng.integers(0, points.shape[1], 3000)] + rng.uniform(-4e-4, 4e-4, (3000, 3))
    found, wanted = (nearest(EYE, aims - EYE, flat[some]) for some in (outline, front))
    hit = np.isfinite(wanted)
    wrong = (hit != np.isfinite(found)).sum() / hit.sum()
    both = hit & np.isfinite(found)
    deeper = (found[both] - wanted[both]) * np.linalg.norm(aims - EYE, axis=1)[both] / widths.max()
    print(
        f"{len(outline)} triangles for {len(front)}; {hit.sum()} rays hit, {100 * wrong:.2f} % of them are wrong, "
        f"{np.median(deeper):.2f} of a width deeper, {np.quantile(deeper, 0.99):.2f} for 1 %"
    )
    assert len(outline) <= 2 * (points.shape[1] - 1) + 4
    assert hit.sum() > 500
    assert wrong < 0.01
    assert 0 <= np.median(deeper) < 0.5


def test_corners_go_round_at_half_the_width_and_across_the_strand() -> None:
    points, widths = curls()
    corners, _ = kernels.tubes(points, widths, all_drawn(points), 6, EYE)
    arms = (corners - points[:, :, None]).astype(np.float64)
    assert np.allclose(np.linalg.norm(arms, axis=3), widths[:, :, None] / 2, rtol=1e-4)
    along = points[:, 2:] - points[:, :-2]
    assert np.abs(arms.sum(axis=2)).max() < 1e-7
    direction = along / np.linalg.norm(along, axis=2, keepdims=True)
    assert np.abs(np.einsum("spkc,spc->spk", arms[:, 1:-1], direction)).max() < 1e-6


def test_tubes_depend_neither_on_threads_nor_on_the_strands_beside() -> None:
    points, widths = curls()
    drawn = all_drawn(points)
    drawn[4, 3:9] = False
    whole, triangles = kernels.tubes(points, widths, drawn, 4, EYE)
    kernels.set_threads(1)
    try:
        alone = [
            kernels.tubes(points[s : s + 1], widths[s : s + 1], drawn[s : s + 1], 4, EYE)
            for s in range(len(points))
        ]
    finally:
        kernels.set_threads(0)
    each = points.shape[1] * 4
    assert np.array_equal(whole, np.concatenate([corners for corners, _ in alone]))
    assert np.array_equal(triangles, np.concatenate([own + s * each for s, (_, own) in enumerate(alone)]))


def test_straight_and_broken_strands_have_finite_tubes() -> None:
    """A straight strand has no axis to turn about, one with coincident points no direction there."""
    straight = np.linspace([0, 0, 0], [0, -0.1, 0], 9)
    twice = np.repeat(straight[:3], 3, axis=0)
    back = np.concatenate([straight[:5], straight[3::-1]])
    points = np.stack([straight, twice, back, 0 * straight]).astype(np.float32)
    widths = np.full((4, 9), 1e-3, np.float32)
    corners, triangles = kernels.tubes(points, widths, all_drawn(points), 4, EYE)
    assert np.isfinite(corners).all()
    arms = np.linalg.norm(corners[0] - points[0, :, None], axis=2)
    print(
        f"{len(triangles)} triangles; the straight strand's corners are {arms.min():.2e} to {arms.max():.2e} m out"
    )
    assert np.allclose(arms, 5e-4, rtol=1e-4)


def test_wrong_shapes_are_refused() -> None:
    points, widths = curls(2)
    for wrong in (
        (points[:, :1], widths[:, :1], all_drawn(points), 4),
        (points, widths[:1], all_drawn(points), 4),
        (points, widths, all_drawn(points)[:, 1:], 4),
        (points, widths, all_drawn(points), 2),
        (points, widths, all_drawn(points), 33),
    ):
        with pytest.raises(ValueError, match="tubes"):
            kernels.tubes(*[np.ascontiguousarray(a) if isinstance(a, np.ndarray) else a for a in wrong], EYE)
