"""Mesh files as they are: points, triangles, texture coordinates and what is painted on the points.

OBJ, PLY, STL and VTP are read by VTK, other formats by meshio; in a process of its own, bounded in memory and time,
because damaged files make readers crash or never end, and what they print is for programmers.
"""

import resource
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import InputError

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
                        f"{path}: not a readable mesh; scene.head takes OBJ, PLY, STL, VTP or what meshio reads"
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
    if path.suffix.lower() in (".obj", ".ply", ".stl", ".vtp"):
        return _read_vtk(path, painted)
    import meshio

    mesh = meshio.read(path)
    cells = [_fans(block.data) for block in mesh.cells if block.type in ("triangle", "quad", "polygon")]
    faces = np.concatenate([np.zeros((0, 3), np.int64), *cells])
    return MeshFile(np.asarray(mesh.points)[:, :3], faces, None, _painted(mesh.point_data) if painted else {})


def _read_vtk(path: Path, painted: bool) -> MeshFile:
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
    faces = vtk_to_numpy(mesh.GetPolys().GetConnectivityArray()).reshape(-1, 3)
    if not painted:
        return MeshFile(points, faces, None, {})
    data = mesh.GetPointData()
    uv = data.GetTCoords()
    numbers = (data.GetArray(k) for k in range(data.GetNumberOfArrays()))
    arrays = {
        array.GetName(): vtk_to_numpy(array) for array in numbers if array is not None and array is not uv
    }
    if path.suffix.lower() == ".ply":
        arrays |= _ply_properties(path, len(points))
    flat = None if uv is None else vtk_to_numpy(uv)[:, :2].astype(np.float32)
    return MeshFile(points, faces, flat, _painted(arrays))


def _ply_properties(path: Path, count: int) -> dict[str, NDArray[Any]]:
    """What VTK does not read: single numbers on the points of a PLY file."""
    import meshio

    found: dict[str, NDArray[Any]] = {}
    with suppress(
        Exception, SystemExit
    ):  # meshio reads fewer files than VTK does, and raises whatever it meets
        found = meshio.read(path).point_data
    return {name: values for name, values in found.items() if len(values) == count}


def _painted(arrays: Mapping[str | None, NDArray[Any]]) -> dict[str, NDArray[np.float32]]:
    """Arrays of one number a point; colours and vectors part by part, whole numbers of 8 or 16 bits from 0 to 1."""
    found: dict[str, NDArray[np.float32]] = {}
    for name, given in arrays.items():
        if name is None or given.dtype.kind not in "iuf":
            continue
        whole = given.dtype in (np.uint8, np.uint16)
        values = given / np.iinfo(given.dtype).max if whole else given
        columns = values.reshape(len(values), -1)
        parts = [name] if columns.shape[1] == 1 else [f"{name}.{k}" for k in range(columns.shape[1])]
        if name in ("RGB", "RGBA"):
            parts = ["red", "green", "blue", "alpha"][: columns.shape[1]]
        found |= {part: column.astype(np.float32) for part, column in zip(parts, columns.T, strict=True)}
    return found


def _fans(polygons: NDArray[Any]) -> Faces:
    """Triangles of convex polygons of one size (N, K)."""
    p = np.asarray(polygons, np.int64)
    return np.concatenate([p[:, [0, k, k + 1]] for k in range(1, p.shape[1] - 1)])


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
