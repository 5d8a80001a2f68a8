"""Mesh files as they are: points, triangles, texture coordinates and what is painted on the points.

OBJ, STL and VTP are read by VTK, PLY and OFF here (ply.py, off.py), other formats by meshio; in a process of its own, bounded in memory and time,
because damaged files make readers crash or never end, and what they print is for programmers.
"""

import resource
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import InputError
from pipeline.groom.off import read_off
from pipeline.groom.ply import read_ply

Faces = NDArray[np.int64]

# What a reader may take, and more for each byte of the file: damaged files ask for anything, or never end.
_MEMORY, _MEMORY_A_BYTE = 2 << 30, 200  # [bytes]
_SECONDS, _SECONDS_A_BYTE = 4, 2e-6  # [s] of processor time
_FILES_AT_A_TIME = 64


@dataclass(frozen=True)
class MeshFile:
    """A mesh as its file has it; nothing is checked."""

    points: NDArray[np.float64]
    """(V, 3) in the file's unit and axes."""
    faces: Faces
    """(T, 3)"""
    uv: NDArray[np.float32] | None
    """(V, 2) texture coordinates; points on seams are there more than once."""
    arrays: dict[str, NDArray[np.float32]]
    """Numbers (V,) on the points, by name."""


def read_apart(paths: Sequence[Path], painted: bool = False) -> Iterator[MeshFile]:
    """Each file, read by another process, many files at a time; with what is painted on it if that is asked for.

    Raises InputError for a file that is missing, empty or no mesh.
    """
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
                "pipeline.groom.mesh_file",
                folder,
                "painted" if painted else "",
                *(str(p.absolute()) for p in some),
            ]
            subprocess.run(command, cwd=Path(__file__).parents[2], capture_output=True, check=False)
            for index, path in enumerate(some):
                found = Path(folder) / f"{index}.npz"
                if not found.is_file():
                    raise InputError(
                        f"{path}: not a readable mesh; scene.head takes OBJ, PLY, STL, VTP, OFF or what meshio reads"
                    )
                yield _unpacked(found)


def _packed(file: MeshFile, path: Path) -> None:
    found: dict[str, Any] = {f"painted{k}": values for k, values in enumerate(file.arrays.values())}
    found |= {} if file.uv is None else {"uv": file.uv}
    np.savez(path, points=file.points, faces=file.faces, names=np.array(list(file.arrays), str), **found)


def _unpacked(path: Path) -> MeshFile:
    with np.load(path) as found:
        names = found["names"].tolist()
        return MeshFile(
            found["points"].astype(np.float64),
            found["faces"].astype(np.int64),
            found.get("uv"),
            {name: found[f"painted{k}"] for k, name in enumerate(names)},
        )


def _read(path: Path, painted: bool) -> MeshFile:
    """What the file has; anything may happen with a damaged one."""
    ending = path.suffix.lower()
    if ending in (".obj", ".stl", ".vtp"):
        return _read_vtk(path, painted)
    if ending == ".ply":
        ply = read_ply(path)
        arrays = _painted(ply.numbers, len(ply.points)) if painted else {}
        return MeshFile(ply.points, _triangles(ply.points, ply.polygons), ply.uv if painted else None, arrays)
    if ending == ".off":
        points, polygons = read_off(path)
        return MeshFile(points, _triangles(points, polygons), None, {})
    import meshio

    mesh = meshio.read(path)
    points = np.asarray(mesh.points, np.float64)[:, :3]
    polygons = [block.data for block in mesh.cells if block.type in ("triangle", "quad", "polygon")]
    return MeshFile(
        points, _triangles(points, polygons), None, _painted(mesh.point_data, len(points)) if painted else {}
    )


def _read_vtk(path: Path, painted: bool) -> MeshFile:
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkFiltersCore import vtkTriangleFilter
    from vtkmodules.vtkIOGeometry import vtkOBJReader, vtkSTLReader
    from vtkmodules.vtkIOXML import vtkXMLPolyDataReader

    readers: dict[str, Any] = {".obj": vtkOBJReader, ".stl": vtkSTLReader, ".vtp": vtkXMLPolyDataReader}
    reader, triangles = readers[path.suffix.lower()](), vtkTriangleFilter()
    reader.SetFileName(str(path))
    triangles.SetInputConnection(reader.GetOutputPort())
    triangles.PassLinesOff()
    triangles.PassVertsOff()
    triangles.Update()
    mesh = triangles.GetOutput()
    points = vtk_to_numpy(mesh.GetPoints().GetData())
    faces = vtk_to_numpy(mesh.GetPolys().GetConnectivityArray()).reshape(-1, 3)
    if not painted:
        return MeshFile(points, faces, None, {})
    data = mesh.GetPointData()
    uv = data.GetTCoords()
    numbers = (data.GetArray(k) for k in range(data.GetNumberOfArrays()))
    arrays = {
        array.GetName(): vtk_to_numpy(array) for array in numbers if array is not None and array is not uv
    }
    flat = None
    if uv is not None and uv.GetNumberOfTuples() == len(points) and uv.GetNumberOfComponents() >= 2:
        flat = vtk_to_numpy(uv)[:, :2].astype(np.float32)
    return MeshFile(points, faces, flat, _painted(arrays, len(points)))


def _painted(arrays: Mapping[Any, NDArray[Any]], count: int) -> dict[str, NDArray[np.float32]]:
    """Arrays of one number for each of `count` points; colours and vectors part by part, whole numbers of 8 or 16 bits from 0 to 1."""
    found: dict[str, NDArray[np.float32]] = {}
    for name, given in arrays.items():
        if not isinstance(name, str) or given.dtype.kind not in "iuf" or len(given) != count:
            continue
        whole = given.dtype in (np.uint8, np.uint16)
        values = given / np.iinfo(given.dtype).max if whole else given
        columns = values.reshape(len(values), -1)
        parts = [name] if columns.shape[1] == 1 else [f"{name}.{k}" for k in range(columns.shape[1])]
        if name in ("RGB", "RGBA"):
            parts = ["red", "green", "blue", "alpha"][: columns.shape[1]]
        found |= {part: column.astype(np.float32) for part, column in zip(parts, columns.T, strict=True)}
    return found


def _triangles(points: NDArray[np.float64], polygons: Sequence[NDArray[Any]]) -> Faces:
    """Triangles (T, 3) of runs of polygons (N, K); those of more points, which need not be convex, are cut by VTK."""
    runs = [np.ascontiguousarray(run, np.int64) for run in polygons if run.shape[1] >= 3]
    flat = np.concatenate([np.zeros(0, np.int64), *(run.ravel() for run in runs)])
    if len(flat) and (flat.min() < 0 or flat.max() >= len(points)):
        return flat[: len(flat) // 3 * 3].reshape(-1, 3)  # refused where indices are checked
    if all(run.shape[1] == 3 for run in runs):
        return flat.reshape(-1, 3)
    from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
    from vtkmodules.vtkFiltersCore import vtkTriangleFilter

    sizes = np.concatenate([np.full(len(run), run.shape[1]) for run in runs])
    given, cells, mesh, cut = vtkPoints(), vtkCellArray(), vtkPolyData(), vtkTriangleFilter()
    given.SetData(numpy_to_vtk(points, deep=True))
    offsets = numpy_to_vtkIdTypeArray(np.append(0, np.cumsum(sizes)), deep=True)
    cells.SetData(offsets, numpy_to_vtkIdTypeArray(flat, deep=True))
    mesh.SetPoints(given)
    mesh.SetPolys(cells)
    cut.SetInputData(mesh)
    cut.Update()
    return np.asarray(
        vtk_to_numpy(cut.GetOutput().GetPolys().GetConnectivityArray()).reshape(-1, 3), np.int64
    )


def _main(folder: Path, painted: bool, paths: list[Path]) -> None:
    """Read meshes, whatever they may be, within bounds of memory and time, to folder/0.npz and so on."""
    size = sum(path.stat().st_size for path in paths)
    memory, seconds = _MEMORY + _MEMORY_A_BYTE * size, int(_SECONDS + _SECONDS_A_BYTE * size)
    for limit, value in (("AS", memory), ("CPU", seconds), ("CORE", 0)):
        resource.setrlimit(getattr(resource, f"RLIMIT_{limit}"), (value, value))
    for index, path in enumerate(paths):
        unfinished = folder / "unfinished.npz"
        _packed(_read(path, painted), unfinished)
        unfinished.rename(folder / f"{index}.npz")


if __name__ == "__main__":
    _main(Path(sys.argv[1]), sys.argv[2] == "painted", [Path(name) for name in sys.argv[3:]])
