"""Head meshes: read from files, welded, triangulated and checked, or taken from a grid of distances.

A mesh that is not closed is refused with what is open, because contact needs an inside.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import InputError
from pipeline.groom.axes import upright
from pipeline.groom.mesh_file import MeshFile, read_apart

Points = NDArray[np.float64]
Faces = NDArray[np.int64]

_SAME = 1e-6  # of the mesh's size: points this near are one
_FLAT = 1e-9  # of the size cubed: less is no volume


@dataclass(frozen=True)
class Mesh:
    """A closed mesh, y up."""

    points: NDArray[np.float32]
    """(V, 3) [m]"""
    triangles: NDArray[np.int32]
    """(T, 3), wound outwards."""
    uv: NDArray[np.float32] | None
    """(T, 3, 2) texture coordinates of the triangles' corners; None where the file has none."""
    arrays: dict[str, NDArray[np.float32]]
    """Numbers (V,) on its points, by name; bytes and the like as parts of their largest value, colours as red, green, blue."""


def load_mesh(path: Path, unit_scale: float = 1.0, up_axis: str = "y", face_axis: str | None = None) -> Mesh:
    """Read a closed mesh with what is painted on it.

    `unit_scale` is metres per unit of the file. Raises InputError for a missing or unreadable file, points that are
    not finite, indices out of range, a mesh without triangles, and a mesh with holes or with edges of three faces.
    """
    file = next(read_apart([path], painted=True))
    points, faces, first, kept = _welded(*_checked(path, file))
    _require_closed(path, faces)
    given, faces = faces, _wound_outwards(points, faces)
    if len(faces) == 0 or _volumes(points, faces).sum() < _FLAT * np.ptp(points, axis=0).max() ** 3:
        raise InputError(f"{path}: the surface encloses no volume; scene.head needs a solid head")
    points = upright(points * unit_scale, up_axis, face_axis)
    uv = None
    if file.uv is not None:
        uv = file.uv[file.faces[kept]]
        turned_over = (given[:, 0] != faces[:, 0])[:, None, None]
        uv = np.where(turned_over, uv[:, ::-1], uv)
    arrays = {name: values[first] for name, values in file.arrays.items()}
    return Mesh(points.astype(np.float32), np.ascontiguousarray(faces, np.int32), uv, arrays)


def load_poses(
    head: Path,
    files: Sequence[Path],
    unit_scale: float = 1.0,
    up_axis: str = "y",
    face_axis: str | None = None,
) -> Iterator[NDArray[np.float32]]:
    """Points (V, 3) float32 [m] of each file, in the order that `load_mesh` gives those of `head`.

    Raises InputError for what `load_mesh` refuses in a file, and for points or faces that are not those of the head.
    """
    meshes = zip([head, *files], read_apart([head, *files]), strict=True)
    raw, faces = _checked(*next(meshes))
    kept = _welded(raw, faces)[2]
    for path, mesh in meshes:
        points, own = _checked(path, mesh)
        if len(points) != len(raw) or not np.array_equal(own, faces):
            raise InputError(
                f"{path}: {len(points)} points and {len(own)} triangles that are not the {len(raw)} and {len(faces)} "
                f"of {head.name}; export all frames from one mesh, without reordering points"
            )
        yield upright(points[kept] * unit_scale, up_axis, face_axis).astype(np.float32)


def zero_surface(values: NDArray[Any]) -> tuple[Points, NDArray[np.int32]]:
    """Where values (nx, ny, nz), negative inside, are zero: points (V, 3) in nodes, triangles (T, 3) wound outwards."""
    from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
    from vtkmodules.vtkCommonDataModel import vtkImageData
    from vtkmodules.vtkFiltersCore import vtkFlyingEdges3D

    grid = vtkImageData()
    grid.SetDimensions(*values.shape)
    grid.GetPointData().SetScalars(numpy_to_vtk(values.ravel(order="F"), deep=True))
    contour = vtkFlyingEdges3D()
    contour.SetInputData(grid)
    contour.SetValue(0, 0.0)
    contour.ComputeNormalsOff()
    contour.ComputeScalarsOff()
    contour.Update()
    found = contour.GetOutput()
    triangles = vtk_to_numpy(found.GetPolys().GetConnectivityArray()).reshape(-1, 3)
    # Flying edges winds inwards where the inside is negative.
    points = vtk_to_numpy(found.GetPoints().GetData()).astype(float)
    return points, np.ascontiguousarray(triangles[:, ::-1], np.int32)


def _checked(path: Path, file: MeshFile) -> tuple[Points, Faces]:
    """The mesh as it was read, with faces of points that exist and are finite."""
    points, faces = file.points, file.faces
    if len(faces) == 0:
        raise InputError(f"{path}: no faces; scene.head needs a surface")
    if faces.min() < 0 or faces.max() >= len(points):
        raise InputError(f"{path}: a face names a point that is not among the {len(points)}; export it again")
    if not np.isfinite(points).all():
        bad = int(np.flatnonzero(~np.isfinite(points).all(axis=1))[0])
        raise InputError(f"{path}: point {bad} is not finite; repair the mesh")
    return points, faces


def _welded(points: Points, faces: Faces) -> tuple[Points, Faces, Faces, NDArray[np.bool_]]:
    """Merge points that lie within a millionth of the mesh's size; drop triangles that collapse and lone points.

    Returns points, faces, which of the given points (V,) were kept, and whether each given triangle was.
    """
    low = points[faces.ravel()].min(axis=0)
    cell = max(float((points[faces.ravel()] - low).max()), 1e-300) * _SAME
    used, faces = np.unique(faces, return_inverse=True)
    points = points[used]
    cells = np.round((points - low) / cell).astype(np.int64)
    _, first, merged = np.unique(cells, axis=0, return_index=True, return_inverse=True)
    a, b, c = merged.reshape(-1)[faces.reshape(-1, 3)].T
    kept = (a != b) & (b != c) & (c != a)
    return points[first], np.stack([a, b, c], axis=1)[kept].astype(np.int64), used[first], kept


def _require_closed(path: Path, faces: Faces) -> None:
    unique, count = np.unique(np.sort(_edges(faces), axis=1), axis=0, return_counts=True)
    crowded, open_edges = int((count > 2).sum()), unique[count == 1]
    if crowded:
        raise InputError(f"{path}: {crowded} edges belong to three or more faces; make the surface manifold")
    if len(open_edges):
        loops = _components(open_edges)[0]
        raise InputError(
            f"{path}: the surface is open: {len(open_edges)} boundary edges in {loops} loops; "
            "close the holes (neck, eyes, mouth) and export it again"
        )


def _wound_outwards(points: Points, faces: Faces) -> Faces:
    """Triangles of a closed mesh wound alike, and outwards as a whole; parts that were not alike, each outwards."""
    directed = _edges(faces)
    order = np.lexsort(np.sort(directed, axis=1).T)
    one, other = order.reshape(-1, 2).T  # the two triangles' sides of each edge
    alike = directed[one, 0] == directed[other, 1]
    pair = np.stack([one, other], axis=1) % len(faces)
    if not alike.all():
        # Each triangle as given (t) and reversed (t + T); what belongs together in space is joined in this graph.
        T = len(faces)
        given = np.where(alike[:, None], pair, pair + np.array([0, T]))
        reverse = np.where(alike[:, None], pair + T, pair + np.array([T, 0]))
        side = _components(np.concatenate([given, reverse]))[1]
        flipped = side[:T] > side[T:]
        faces = np.where(flipped[:, None], faces[:, ::-1], faces)
        part = _components(pair)[1]
        inwards = np.bincount(part, _volumes(points, faces)) < 0
        return np.where(inwards[part][:, None], faces[:, ::-1], faces)
    return faces[:, ::-1] if _volumes(points, faces).sum() < 0 else faces


def _components(links: NDArray[np.int64]) -> tuple[int, NDArray[np.int32]]:
    """Number of connected parts of the numbers that links (N, 2) join, and the part of each number, ascending."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    names, index = np.unique(links, return_inverse=True)
    a, b = index.reshape(-1, 2).T
    graph = coo_matrix((np.ones(len(a)), (a, b)), shape=(len(names), len(names)))
    count, part = connected_components(graph, directed=False)
    return int(count), part


def _edges(faces: Faces) -> Faces:
    """Directed edges (3 T, 2); edge e is of triangle e modulo T."""
    return np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])


def _volumes(points: Points, faces: Faces) -> NDArray[np.float64]:
    """Signed volumes (T,) between each triangle and the middle of the mesh."""
    a, b, c = (points - points.mean(axis=0))[faces].transpose(1, 0, 2)
    return np.asarray(np.einsum("ij,ij->i", a, np.cross(b, c)) / 6)
