"""Load a head mesh: VTK's readers for OBJ, PLY, STL and VTP, meshio for other formats.

Meshes are welded, triangulated and checked; a mesh that is not closed is refused with what is open, because contact
needs an inside.
"""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import InputError
from pipeline.groom.axes import upright

_VTK_FORMATS = {".obj", ".ply", ".stl", ".vtp"}


def load_mesh(
    path: Path, unit_scale: float = 1.0, up_axis: str = "y"
) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Points (V, 3) float32 [m], y up, and triangles (T, 3) int32 wound outwards, of a closed mesh.

    `unit_scale` is metres per unit of the file. Raises InputError for a missing or unreadable file, points that are
    not finite, indices out of range, a mesh without triangles, and a mesh with holes or with edges of three faces.
    """
    if not path.is_file():
        raise InputError(f'{path}: no such mesh; scene.head takes a path, "builtin" or "none"')
    points, faces = _read(path)
    if not np.isfinite(points).all():
        bad = int(np.flatnonzero(~np.isfinite(points).all(axis=1))[0])
        raise InputError(f"{path}: point {bad} is not finite; repair the mesh")
    if len(faces) == 0:
        raise InputError(f"{path}: no faces; scene.head needs a surface")
    if faces.min() < 0 or faces.max() >= len(points):
        raise InputError(
            f"{path}: a face names point {int(faces.max())}, but there are {len(points)} points; export it again"
        )
    points, faces = _welded(points.astype(np.float64), faces)
    _require_closed(path, faces)
    points = upright(points * unit_scale, up_axis)
    if _volume(points, faces) < 0:
        faces = faces[:, ::-1]
    return points.astype(np.float32), np.ascontiguousarray(faces, np.int32)


def point_normals(points: NDArray[np.float32], triangles: NDArray[np.int32]) -> NDArray[np.float32]:
    """Unit outward normals (V, 3), the mean of the faces around a point weighted by area."""
    p = points.astype(np.float64)[triangles]
    area = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    normals = np.stack(
        [np.bincount(triangles.ravel(), np.repeat(area[:, k], 3), len(points)) for k in range(3)], axis=1
    )
    length = np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    return np.asarray(normals / length, np.float32)


def _read(path: Path) -> tuple[NDArray[Any], NDArray[np.int64]]:
    if path.suffix.lower() in _VTK_FORMATS:
        return _read_vtk(path)
    import meshio

    try:
        mesh = meshio.read(path)
    except (meshio.ReadError, SystemExit, ValueError, KeyError, IndexError) as error:
        raise InputError(f"{path}: meshio cannot read it ({error}); use OBJ, PLY, STL or VTP") from error
    cells = [_fans(block.data) for block in mesh.cells if block.type in ("triangle", "quad", "polygon")]
    faces = np.concatenate(cells) if cells else np.zeros((0, 3), np.int64)
    return np.asarray(mesh.points)[:, :3], faces


def _read_vtk(path: Path) -> tuple[NDArray[Any], NDArray[np.int64]]:
    import pyvista as pv
    import vtk

    if path.stat().st_size == 0:
        raise InputError(f"{path}: the file is empty")
    log = vtk.vtkObject.GetGlobalWarningDisplay()
    vtk.vtkObject.GlobalWarningDisplayOff()
    try:
        mesh = pv.PolyData(str(path)).triangulate()
    except (OSError, ValueError, RuntimeError) as error:
        raise InputError(f"{path}: not a readable mesh ({error})") from error
    finally:
        vtk.vtkObject.SetGlobalWarningDisplay(log)
    if mesh.n_points == 0:
        raise InputError(f"{path}: not a readable mesh, or one without points")
    faces = np.asarray(mesh.faces, np.int64).reshape(-1, 4)[:, 1:]
    return np.asarray(mesh.points), faces


def _fans(polygons: NDArray[Any]) -> NDArray[np.int64]:
    """Triangles of convex polygons of one size (N, K)."""
    p = np.asarray(polygons, np.int64)
    return np.concatenate([p[:, [0, k, k + 1]] for k in range(1, p.shape[1] - 1)])


def _welded(
    points: NDArray[np.float64], faces: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Merge points that lie within a millionth of the mesh's size; drop triangles that collapse and lone points."""
    cell = max(float(np.ptp(points[faces.ravel()], axis=0).max()), 1e-30) * 1e-6
    _, first, merged = np.unique(
        np.round(points / cell).astype(np.int64), axis=0, return_index=True, return_inverse=True
    )
    faces = merged.reshape(-1)[faces]
    a, b, c = faces.T
    faces = faces[(a != b) & (b != c) & (c != a)]
    used, faces = np.unique(faces, return_inverse=True)
    return points[first[used]], faces.reshape(-1, 3).astype(np.int64)


def _require_closed(path: Path, faces: NDArray[np.int64]) -> None:
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    unique, count = np.unique(edges, axis=0, return_counts=True)
    crowded, open_edges = int((count > 2).sum()), unique[count == 1]
    if crowded:
        raise InputError(f"{path}: {crowded} edges belong to three or more faces; make the surface manifold")
    if len(open_edges):
        raise InputError(
            f"{path}: the surface is open: {len(open_edges)} boundary edges in {_loops(open_edges)} loops; "
            "close the holes (neck, eyes, mouth) and export it again"
        )


def _loops(edges: NDArray[np.int64]) -> int:
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    names, index = np.unique(edges, return_inverse=True)
    a, b = index.reshape(-1, 2).T
    graph = coo_matrix((np.ones(len(a)), (a, b)), shape=(len(names), len(names)))
    return int(connected_components(graph, directed=False)[0])


def _volume(points: NDArray[np.float64], faces: NDArray[np.int64]) -> float:
    p = points[faces]
    return float(np.einsum("ij,ij->", p[:, 0], np.cross(p[:, 1], p[:, 2])) / 6)
