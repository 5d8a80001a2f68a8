"""Alembic: the ICurves of an archive, at their first sample.

A strand is a curve; strands are counted over the objects in the order of the archive. Widths are diameters. There is
neither unit nor up axis; transforms of objects are applied. Written are metres with y up and linear curves, sampled
evenly in time. Source: the documentation of AbcGeom's ICurvesSchema and OCurvesSchema.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import InputError
from pipeline.strands.formats.curves import Curves, Kind, Wrap, polylines
from pipeline.strands.formats.lines import Chunks, Lines
from pipeline.strands.formats.ragged import Ragged, gathered

_BASES: dict[str, Kind] = {
    "kBezierBasis": "bezier",
    "kBsplineBasis": "bspline",
    "kCatmullromBasis": "catmullRom",
}
_SCOPES = {
    "kConstantScope": "constant",
    "kUniformScope": "uniform",
    "kVaryingScope": "varying",
    "kVertexScope": "vertex",
    "kFacevaryingScope": "vertex",
}


def read_alembic(path: Path) -> Ragged:
    """Read the curves of an archive. Raises InputError, naming object and property, for what does not fit together.

    To be called where the library may crash: see `apart`.
    """
    import imath  # noqa: F401, brings the types of the arrays
    from alembic3d import Abc

    try:
        archive = Abc.IArchive(str(path))
        pieces = [_read_object(path, *found) for found in _curves(archive.getTop(), np.eye(4))]
    except RuntimeError as error:
        raise InputError(f"{path}: Alembic cannot read it: {_reason(error)}") from None
    if not pieces:
        raise InputError(f"{path}: no curves in it, so no strands")
    return gathered(pieces)


class AlembicWriter:
    """Writes moments as samples of one archive: topology and widths once, points each time.

    Chunks of strands are objects /strands_000 and so on; a sample goes to the file at once.
    """

    def __init__(self, path: Path, lines: Lines, first: int) -> None:
        """Begin a file whose first moment is frame `first`. Raises ModuleNotFoundError without Alembic."""
        import imath  # noqa: F401, brings the types of the arrays
        from alembic3d import Abc, AbcCoreAbstract

        self._lines, self._next = lines, first
        self._archive = Abc.CreateArchiveWithInfo(str(path), "ringlet", lines.about)
        times = AbcCoreAbstract.TimeSampling(1 / lines.fps, (first - 1) / lines.fps)
        self._times = self._archive.addTimeSampling(times)
        self._objects: list[Any] = []

    def append(self, frame: int, chunks: Chunks) -> None:
        """Append a moment; frames follow one another without gaps, or ValueError is raised."""
        import imath
        from alembic3d import AbcGeom

        if frame != self._next:
            raise ValueError(f"frame {frame}: expected {self._next}")
        self._next += 1
        begin = 0
        for number, points in enumerate(chunks):
            positions = imath.V3fArrayFromBuffer(np.ascontiguousarray(points.reshape(-1, 3), np.float32))
            if number < len(self._objects):
                self._objects[number].getSchema().set(AbcGeom.OCurvesSchemaSample(positions))
            else:
                made = AbcGeom.OCurves(self._archive.getTop(), f"strands_{number:03d}", self._times)
                made.getSchema().set(self._first_sample(positions, begin, len(points)))
                self._objects.append(made)
            begin += len(points)

    def _first_sample(self, positions: Any, begin: int, strands: int) -> Any:
        """What only the first sample of an object says: topology, widths and UVs of roots."""
        import imath
        from alembic3d import AbcGeom

        counts = np.full(strands, self._lines.points, np.int32)
        widths = np.tile(self._lines.widths, strands).astype(np.float32)
        sample = AbcGeom.OCurvesSchemaSample(
            positions,
            imath.IntArrayFromBuffer(counts),
            AbcGeom.CurveType.kLinear,
            AbcGeom.CurvePeriodicity.kNonPeriodic,
        )
        scope = AbcGeom.GeometryScope
        sample.setWidths(
            AbcGeom.OFloatGeomParamSample(imath.FloatArrayFromBuffer(widths), scope.kVertexScope)
        )
        if self._lines.uv is not None:
            uv = imath.V2fArrayFromBuffer(np.ascontiguousarray(self._lines.uv[begin : begin + strands]))
            sample.setUVs(AbcGeom.OV2fGeomParamSample(uv, scope.kUniformScope))
        return sample

    def close(self) -> None:
        """Write what the library still holds."""
        self._objects = []
        del self._archive


def _curves(parent: Any, matrix: NDArray[np.float64]) -> Iterator[tuple[Any, NDArray[np.float64]]]:
    """All curves below an object, with the transform (4, 4, of rows) to the world."""
    from alembic3d import Abc, AbcGeom

    for child in list(parent.children):
        header = child.getHeader()
        below = matrix
        if AbcGeom.IXform.matches(header):
            schema = AbcGeom.IXform(parent, header.getName()).getSchema()
            sample = schema.getValue(Abc.ISampleSelector(0))
            own = np.array([list(row) for row in sample.getMatrix()], np.float64)
            below = own @ matrix if sample.getInheritsXforms() else own
        elif AbcGeom.ICurves.matches(header):
            yield AbcGeom.ICurves(parent, header.getName()), matrix
        yield from _curves(child, below)


def _read_object(path: Path, curves: Any, matrix: NDArray[np.float64]) -> Ragged:
    from alembic3d import Abc

    where = f"{path}: {curves.getFullName()}"
    schema = curves.getSchema()
    if not schema.getNumSamples():
        raise InputError(f"{where}: positions have no sample")
    sample = schema.getValue(Abc.ISampleSelector(0))
    points = np.array(sample.getPositions(), np.float64).reshape(-1, 3)
    counts = np.array(sample.getCurvesNumVertices(), np.int64).reshape(-1)
    kind: Kind = "linear"
    if sample.getType().name == "kCubic":
        if sample.getBasis().name not in _BASES:
            raise InputError(f"{where}: basis is {sample.getBasis().name}; ringlet reads {', '.join(_BASES)}")
        kind = _BASES[sample.getBasis().name]
    elif sample.getType().name != "kLinear":
        raise InputError(f"{where}: type is {sample.getType().name}; ringlet reads kLinear and kCubic")
    wrap: Wrap = "periodic" if sample.getWrap().name == "kPeriodic" else "nonperiodic"
    widths, interpolation = _widths(schema)
    x, found, diameters = polylines(Curves(where, points, counts, kind, wrap, widths, interpolation))
    pins = np.tile(np.array([2, 0], np.uint8), (len(found), 1))
    if diameters is not None:
        diameters *= np.float32(np.cbrt(abs(np.linalg.det(matrix[:3, :3]))))
    return Ragged(x @ matrix[:3, :3] + matrix[3, :3], found, pins, diameters)


def _widths(schema: Any) -> tuple[NDArray[np.float64] | None, str]:
    from alembic3d import Abc

    parameter = schema.getWidthsParam()
    if not parameter.valid() or not parameter.getNumSamples():
        return None, "vertex"
    sample = parameter.getExpandedValue(Abc.ISampleSelector(0))
    values = np.array(sample.getVals(), np.float64).reshape(-1)
    return (values if len(values) else None), _SCOPES.get(sample.getScope().name, "vertex")


def _reason(error: Exception) -> str:
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    return lines[-1] if lines else "not an archive"
