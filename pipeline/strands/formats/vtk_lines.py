"""VTK's PolyData: the polylines of a .vtp or .vtkhdf file, one a strand; of a series, its first step.

A point array named `width` (or `widths`) holds diameters. There is neither unit nor up axis.
"""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import InputError
from pipeline.strands.formats.ragged import Ragged, widened

_WIDTHS = ("width", "widths")


def read_vtk(path: Path) -> Ragged:
    """Read the polylines of a file. Raises InputError, naming the array, for what does not fit together.

    To be called where the library may crash: see `apart`.
    """
    from vtkmodules.util.numpy_support import vtk_to_numpy

    mesh = _read(path)
    if mesh is None or mesh.GetPoints() is None or not mesh.GetNumberOfLines():
        raise InputError(f"{path}: no polylines in it, so no strands")
    points = vtk_to_numpy(mesh.GetPoints().GetData())
    offsets = vtk_to_numpy(mesh.GetLines().GetOffsetsArray()).astype(np.int64)
    ids = vtk_to_numpy(mesh.GetLines().GetConnectivityArray()).astype(np.int64)
    _check(path, len(points), offsets, ids)
    ids = ids[offsets[0] : offsets[-1]]
    counts = np.diff(offsets)
    pins = np.tile(np.array([2, 0], np.uint8), (len(counts), 1))
    return Ragged(widened(points[ids]), counts, pins, _widths(path, mesh, ids, len(points)))


def _read(path: Path) -> Any:
    """The PolyData of a file; what the reader complains about is an InputError."""
    if path.suffix.lower() == ".vtp":
        from vtkmodules.vtkIOXML import vtkXMLPolyDataReader as Reader
    else:
        from vtkmodules.vtkIOHDF import vtkHDFReader as Reader
    reader = Reader()
    reader.SetFileName(str(path))
    complaints: list[str] = []

    def complain(_object: object, _event: str, text: str) -> None:
        complaints.append(text)

    complain.CallDataType = "string0"  # type: ignore[attr-defined]
    for source in (reader, reader.GetExecutive()):
        source.AddObserver("ErrorEvent", complain)
    reader.Update()
    if complaints:
        said = complaints[0].strip().splitlines()[-1].split("): ", 1)[-1]  # without the object's address
        raise InputError(f"{path}: VTK cannot read it: {said}")
    mesh = reader.GetOutputDataObject(0)
    return mesh if mesh is not None and mesh.IsA("vtkPolyData") else None


def _check(path: Path, points: int, offsets: NDArray[np.int64], ids: NDArray[np.int64]) -> None:
    if offsets[0] < 0 or offsets[-1] > len(ids) or (np.diff(offsets) < 0).any():
        raise InputError(
            f"{path}: Lines: offsets do not ascend from 0 to the {len(ids)} numbers of connectivity"
        )
    if len(ids) and not (ids.min() >= 0 and ids.max() < points):
        raise InputError(f"{path}: Lines: connectivity names a point beyond the {points} that there are")


def _widths(path: Path, mesh: Any, ids: NDArray[np.int64], points: int) -> NDArray[np.float32] | None:
    from vtkmodules.util.numpy_support import vtk_to_numpy

    array = next((found for name in _WIDTHS if (found := mesh.GetPointData().GetArray(name))), None)
    if array is None:
        return None
    values = vtk_to_numpy(array)
    if values.shape != (points,):
        raise InputError(
            f"{path}: PointData: {array.GetName()} has shape {values.shape}, expected ({points},)"
        )
    return np.asarray(values[ids], np.float32)
