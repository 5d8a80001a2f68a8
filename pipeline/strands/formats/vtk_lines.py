"""VTK's PolyData: the polylines of a .vtp or .vtkhdf file, one a strand; of a series, its first step.

A point array named `width` (or `widths`) holds diameters. There is neither unit nor up axis. Written are .vtp files with
raw appended data, the way that needs no library and no more memory than a chunk: an XML head with the byte offset of
each array, "_", then for each array its u64 number of bytes and the bytes. Source: "VTK XML file formats" of the VTK
documentation.
"""

import struct
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import InputError
from pipeline.strands.formats.lines import Chunks, Lines
from pipeline.strands.formats.ragged import Ragged, widened

_WIDTHS = ("width", "widths")
_TOGETHER = 1 << 16  # strands whose arrays are written at once
_ARRAY = '<DataArray type="{}" Name="{}" NumberOfComponents="{}" format="appended" offset="{}"/>'
_BYTES = {"Float32": (4, "<f4"), "Int32": (4, "<i4"), "Int64": (8, "<i8")}
_HEAD = """<?xml version="1.0"?>
<!-- {about} -->
<VTKFile type="PolyData" version="1.0" byte_order="LittleEndian" header_type="UInt64">
<PolyData><Piece NumberOfPoints="{points}" NumberOfVerts="0" NumberOfLines="{strands}" NumberOfStrips="0" NumberOfPolys="0">
<Points>{0}</Points>
<PointData>{1}</PointData>
<CellData>{2}{3}</CellData>
<Lines>{4}{5}</Lines>
</Piece></PolyData>
<AppendedData encoding="raw">
_"""
_TAIL = b"\n</AppendedData>\n</VTKFile>\n"


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


def write_vtp(path: Path, lines: Lines, chunks: Chunks) -> None:
    """Write one moment as a .vtp file, chunk by chunk: points with `width`, lines with `strand` number and root's `uv`."""
    S, P = lines.strands, lines.points
    uv = np.zeros((S, 0), np.float32) if lines.uv is None else lines.uv
    starts = [(a, min(a + _TOGETHER, S)) for a in range(0, S, _TOGETHER)]
    profile = np.tile(lines.widths, min(S, _TOGETHER))
    arrays: list[
        tuple[str, str, int, int, Iterable[NDArray[Any]]]
    ] = [  # type, name, components, rows, pieces
        ("Float32", "Points", 3, S * P, chunks),
        ("Float32", "width", 1, S * P, (profile[: (b - a) * P] for a, b in starts)),
        ("Int32", "strand", 1, S, (np.arange(a, b) for a, b in starts)),
        ("Float32", "uv", uv.shape[1], S, [uv]),
        ("Int64", "connectivity", 1, S * P, (np.arange(a * P, b * P) for a, b in starts)),
        ("Int64", "offsets", 1, S, (np.arange(a + 1, b + 1) * P for a, b in starts)),
    ]
    texts, place = [], 0
    for kind, name, components, rows, _ in arrays:
        texts.append(_ARRAY.format(kind, name, components, place) if components else "")
        place += 8 + components * rows * _BYTES[kind][0]
    with path.open("wb") as file:
        file.write(_HEAD.format(*texts, about=lines.about, points=S * P, strands=S).encode())
        for kind, _, components, rows, pieces in arrays:
            size, number = _BYTES[kind]
            file.write(struct.pack("<Q", components * rows * size))
            for piece in pieces:
                file.write(piece.astype(number).tobytes())
        file.write(_TAIL)


def write_series(path: Path, frames: Sequence[tuple[float, str]]) -> None:
    """Write a .pvd file, which ParaView opens as an animation: times [s] and the names of their .vtp files."""
    rows = "".join(f'<DataSet timestep="{time:.9g}" part="0" file="{file}"/>\n' for time, file in frames)
    head = '<?xml version="1.0"?>\n<VTKFile type="Collection" version="0.1">\n<Collection>\n'
    path.write_text(f"{head}{rows}</Collection>\n</VTKFile>\n", encoding="utf-8")


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
