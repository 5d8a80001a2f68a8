"""What the groom needs VTK for: head meshes, loaded from files or taken from a grid of distances.

OBJ, PLY, STL and VTP are read by VTK, other formats by meshio; in a process of its own, bounded in memory and time,
because damaged files make readers crash or never end, and what they print is for programmers. Meshes are welded,
triangulated and checked; one that is not closed is refused with what is open, because contact needs an inside.
"""

import resource
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import InputError
from pipeline.groom.axes import upright

Points = NDArray[np.float64]
Faces = NDArray[np.int64]

# What a reader may take, and more for each byte of the file: damaged files ask for anything, or never end.
_MEMORY, _MEMORY_A_BYTE = 4 << 30, 200  # [bytes]
_SECONDS, _SECONDS_A_BYTE = 10, 2e-6  # [s] of processor time
_FILES_AT_A_TIME = 64
_SAME = 1e-6  # of the mesh's size: points this near are one
_FLAT = 1e-9  # of the size cubed: less is no volume


def load_mesh(
    path: Path, unit_scale: float = 1.0, up_axis: str = "y"
) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """Points (V, 3) float32 [m], y up, and triangles (T, 3) int32 wound outwards, of a closed mesh.

    `unit_scale` is metres per unit of the file. Raises InputError for a missing or unreadable file, points that are
    not finite, indices out of range, a mesh without triangles, and a mesh with holes or with edges of three faces.
    """
    given, faces = next(_read_apart([path]))
    points, faces, _ = _welded(*_checked(path, given, faces))
    _require_closed(path, faces)
    faces = _wound_outwards(points, faces)
    if len(faces) == 0 or _volumes(points, faces).sum() < _FLAT * np.ptp(points, axis=0).max() ** 3:
        raise InputError(f"{path}: the surface encloses no volume; scene.head needs a solid head")
    points = upright(points * unit_scale, up_axis)
    return points.astype(np.float32), np.ascontiguousarray(faces, np.int32)


def load_poses(
    head: Path, files: Sequence[Path], unit_scale: float = 1.0, up_axis: str = "y"
) -> Iterator[NDArray[np.float32]]:
    """Points (V, 3) float32 [m] of each file, in the order that `load_mesh` gives those of `head`.

    Raises InputError for what `load_mesh` refuses in a file, and for points or faces that are not those of the head.
    """
    meshes = zip([head, *files], _read_apart([head, *files]), strict=True)
    path, mesh = next(meshes)
    raw, faces = _checked(path, *mesh)
    kept = _welded(raw, faces)[2]
    for path, mesh in meshes:
        points, own = _checked(path, *mesh)
        if len(points) != len(raw) or not np.array_equal(own, faces):
            raise InputError(
                f"{path}: {len(points)} points and {len(own)} triangles that are not the {len(raw)} and {len(faces)} "
                f"of {head.name}; export all frames from one mesh, without reordering points"
            )
        yield upright(points[kept] * unit_scale, up_axis).astype(np.float32)


def zero_surface(values: NDArray[Any]) -> tuple[Points, NDArray[np.int32]]:
    """Where values (nx, ny, nz), negative inside, are zero: points (V, 3) in nodes, triangles (T, 3) wound outwards."""
    import pyvista as pv

    grid = pv.ImageData(dimensions=values.shape)
    grid["values"] = values.ravel(order="F")
    found = grid.contour([0.0], scalars="values", method="flying_edges", compute_normals=False)
    # Flying edges winds inwards where the inside is negative.
    return np.asarray(found.points, float), np.ascontiguousarray(found.regular_faces[:, ::-1], np.int32)


def _checked(path: Path, points: Points, faces: Faces) -> tuple[Points, Faces]:
    """The mesh as it was read, with faces of points that exist and are finite."""
    if len(faces) == 0:
        raise InputError(f"{path}: no faces; scene.head needs a surface")
    if faces.min() < 0 or faces.max() >= len(points):
        raise InputError(f"{path}: a face names a point that is not among the {len(points)}; export it again")
    if not np.isfinite(points).all():
        bad = int(np.flatnonzero(~np.isfinite(points).all(axis=1))[0])
        raise InputError(f"{path}: point {bad} is not finite; repair the mesh")
    return points, faces


def _read_apart(paths: Sequence[Path]) -> Iterator[tuple[Points, Faces]]:
    """Points and triangles of each file, read by another process, many files at a time."""
    for path in paths:
        if not path.is_file():
            raise InputError(f'{path}: no such mesh; scene.head takes a path, "builtin" or "none"')
        if path.stat().st_size == 0:
            raise InputError(f"{path}: the file is empty; export the mesh again")
    for first in range(0, len(paths), _FILES_AT_A_TIME):
        with tempfile.TemporaryDirectory() as folder:
            some = paths[first : first + _FILES_AT_A_TIME]
            command = [
                sys.executable,
                "-m",
                "pipeline.groom.head_mesh",
                folder,
                *(str(p.absolute()) for p in some),
            ]
            subprocess.run(command, cwd=Path(__file__).parents[2], capture_output=True, check=False)
            for index, path in enumerate(some):
                found = Path(folder) / f"{index}.npz"
                if not found.is_file():
                    raise InputError(
                        f"{path}: not a readable mesh; scene.head takes OBJ, PLY, STL, VTP or what meshio reads"
                    )
                with np.load(found) as arrays:
                    yield arrays["points"].astype(np.float64), arrays["faces"].astype(np.int64)


def _read(path: Path) -> tuple[NDArray[Any], NDArray[Any]]:
    """Points and triangles as the file has them; anything may happen with a damaged one."""
    if path.suffix.lower() in (".obj", ".ply", ".stl", ".vtp"):
        return _read_vtk(path)
    import meshio

    mesh = meshio.read(path)
    cells = [_fans(block.data) for block in mesh.cells if block.type in ("triangle", "quad", "polygon")]
    return np.asarray(mesh.points)[:, :3], np.concatenate([np.zeros((0, 3), np.int64), *cells])


def _read_vtk(path: Path) -> tuple[NDArray[Any], NDArray[Any]]:
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkFiltersCore import vtkTriangleFilter
    from vtkmodules.vtkIOGeometry import vtkOBJReader, vtkSTLReader
    from vtkmodules.vtkIOPLY import vtkPLYReader
    from vtkmodules.vtkIOXML import vtkXMLPolyDataReader

    readers: dict[str, Any] = {
        ".obj": vtkOBJReader,
        ".ply": vtkPLYReader,
        ".stl": vtkSTLReader,
        ".vtp": vtkXMLPolyDataReader,
    }
    reader, triangles = readers[path.suffix.lower()](), vtkTriangleFilter()
    reader.SetFileName(str(path))
    triangles.SetInputConnection(reader.GetOutputPort())
    triangles.PassLinesOff()
    triangles.PassVertsOff()
    triangles.Update()
    mesh = triangles.GetOutput()
    points = vtk_to_numpy(mesh.GetPoints().GetData())
    return points, vtk_to_numpy(mesh.GetPolys().GetConnectivityArray()).reshape(-1, 3)


def _fans(polygons: NDArray[Any]) -> Faces:
    """Triangles of convex polygons of one size (N, K)."""
    p = np.asarray(polygons, np.int64)
    return np.concatenate([p[:, [0, k, k + 1]] for k in range(1, p.shape[1] - 1)])


def _welded(points: Points, faces: Faces) -> tuple[Points, Faces, Faces]:
    """Merge points that lie within a millionth of the mesh's size; drop triangles that collapse and lone points.

    Returns points, faces, and which of the given points (V,) were kept.
    """
    low = points[faces.ravel()].min(axis=0)
    cell = max(float((points[faces.ravel()] - low).max()), 1e-300) * _SAME
    used, faces = np.unique(faces, return_inverse=True)
    points = points[used]
    cells = np.round((points - low) / cell).astype(np.int64)
    _, first, merged = np.unique(cells, axis=0, return_index=True, return_inverse=True)
    a, b, c = merged.reshape(-1)[faces.reshape(-1, 3)].T
    kept = (a != b) & (b != c) & (c != a)
    return points[first], np.stack([a, b, c], axis=1)[kept].astype(np.int64), used[first]


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


def _main(folder: Path, paths: list[Path]) -> None:
    """Read meshes, whatever they may be, within bounds of memory and time, to folder/0.npz and so on."""
    size = sum(path.stat().st_size for path in paths)
    memory, seconds = _MEMORY + _MEMORY_A_BYTE * size, int(_SECONDS + _SECONDS_A_BYTE * size)
    for limit, value in (("AS", memory), ("CPU", seconds), ("CORE", 0)):
        resource.setrlimit(getattr(resource, f"RLIMIT_{limit}"), (value, value))
    for index, path in enumerate(paths):
        points, faces = _read(path)
        unfinished = folder / "unfinished.npz"
        np.savez(unfinished, points=points, faces=faces)
        unfinished.rename(folder / f"{index}.npz")


if __name__ == "__main__":
    _main(Path(sys.argv[1]), [Path(name) for name in sys.argv[2:]])
