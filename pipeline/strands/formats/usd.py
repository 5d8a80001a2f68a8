"""OpenUSD: UsdGeomBasisCurves of a stage (.usd, .usda, .usdc, .usdz).

A strand is a curve; strands are counted over the prims in the order of the stage. Read are all prims that are drawn:
active, visible, of purpose "default" or "render", instances too, each where its transforms put it at the first time
of the stage. `widths` are diameters in the space of their prim. The stage says its unit and its up axis; one that
does not is in centimetres with y up, by definition. Layers that it names are read too. Written are metres with y up and Catmull and Rom's curves through the points, pinned; the time of
a sample is the frame's number; primvars:st are the UVs of roots. Source: the documentation of UsdGeomBasisCurves and UsdGeomMetrics.
"""

from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import InputError
from pipeline.strands.formats.curves import Curves, Kind, Wrap, polylines
from pipeline.strands.formats.lines import Chunks, Lines
from pipeline.strands.formats.ragged import Ragged, gathered

if TYPE_CHECKING:
    from pxr import Usd, UsdGeom

_DRAWN = ("default", "render")
_UNSAVED = 128 << 20  # [bytes] points that wait in memory for being saved


def read_usd(path: Path) -> Ragged:
    """Read the curves of a stage. Raises InputError, naming prim and attribute, for what does not fit together.

    To be called where the library may crash: see `apart`.
    """
    from pxr import Tf

    try:
        return _read(path)
    except Tf.ErrorException as error:
        raise InputError(f"{path}: OpenUSD cannot read it: {_reason(error)}") from None


def _read(path: Path) -> Ragged:
    from pxr import Usd, UsdGeom

    stage = Usd.Stage.Open(str(path))
    time = Usd.TimeCode(stage.GetStartTimeCode()) if stage.HasAuthoredTimeCodeRange() else None
    places = UsdGeom.XformCache(time or Usd.TimeCode.EarliestTime())
    pieces = [_read_prim(path, prim, places) for prim in _drawn(stage, places.GetTime())]
    if not pieces:
        raise InputError(f"{path}: no BasisCurves in it that are drawn, so no strands")
    metres = UsdGeom.GetStageMetersPerUnit(stage)
    if not metres > 0:
        raise InputError(f"{path}: metersPerUnit is {metres:g}; expected a number above 0")
    return gathered(pieces, metres, UsdGeom.GetStageUpAxis(stage).lower())


class UsdWriter:
    """Writes moments as time samples of one .usdc file: topology and widths once, points and extent each time.

    Chunks of strands are prims /hair/strands_000 and so on, of which only what is not saved yet is in memory.
    """

    def __init__(self, path: Path, lines: Lines) -> None:
        """Begin a file. Raises ModuleNotFoundError without OpenUSD."""
        from pxr import Sdf, Usd, UsdGeom

        self._path, self._lines = path, lines
        layer = Sdf.Layer.New(Sdf.FileFormat.FindById("usdc"), str(path))
        self._stage = Usd.Stage.Open(layer)
        UsdGeom.SetStageMetersPerUnit(self._stage, 1.0)
        UsdGeom.SetStageUpAxis(self._stage, "Y")
        self._stage.SetTimeCodesPerSecond(lines.fps)
        self._stage.SetFramesPerSecond(lines.fps)
        layer.comment = lines.about
        root = UsdGeom.Xform.Define(self._stage, "/hair")
        self._stage.SetDefaultPrim(root.GetPrim())
        self._prims: list[UsdGeom.BasisCurves] = []

    def append(self, frame: int, chunks: Chunks) -> None:
        """Append a moment; frames ascend. Raises InputError when the file cannot be written."""
        from pxr import Vt

        unsaved = begin = 0
        for number, points in enumerate(chunks):
            if number == len(self._prims):
                self._prims.append(self._define(number, begin, len(points)))
            prim, margin = self._prims[number], self._lines.widths.max() / 2
            flat = np.ascontiguousarray(points.reshape(-1, 3), np.float32)
            extent = np.stack([flat.min(axis=0) - margin, flat.max(axis=0) + margin])
            prim.GetPointsAttr().Set(Vt.Vec3fArray.FromNumpy(flat), frame)
            prim.CreateExtentAttr().Set(Vt.Vec3fArray.FromNumpy(extent), frame)
            unsaved += flat.nbytes
            begin += len(points)
            if unsaved > _UNSAVED:
                self._save()
                unsaved = 0
        if not self._stage.HasAuthoredTimeCodeRange():
            self._stage.SetStartTimeCode(frame)
        self._stage.SetEndTimeCode(frame)
        self._save()

    def close(self) -> None:
        """Let the file go; it is whole after every moment."""
        self._prims = []
        del self._stage

    def _save(self) -> None:
        from pxr import Tf

        try:
            self._stage.Save()
        except Tf.ErrorException as error:
            raise InputError(f"{self._path}: OpenUSD cannot write it: {_reason(error)}") from None

    def _define(self, number: int, begin: int, strands: int) -> "UsdGeom.BasisCurves":
        from pxr import Sdf, UsdGeom, Vt

        curves = UsdGeom.BasisCurves.Define(self._stage, f"/hair/strands_{number:03d}")
        curves.CreateTypeAttr("cubic")
        curves.CreateBasisAttr("catmullRom")
        curves.CreateWrapAttr("pinned")
        counts = np.full(strands, self._lines.points, np.int32)
        curves.CreateCurveVertexCountsAttr(Vt.IntArray.FromNumpy(counts))
        curves.CreateWidthsAttr(Vt.FloatArray.FromNumpy(np.tile(self._lines.widths, strands)))
        curves.SetWidthsInterpolation("vertex")
        curves.CreatePointsAttr()
        if self._lines.uv is not None:
            kind = Sdf.ValueTypeNames.TexCoord2fArray
            primvar = UsdGeom.PrimvarsAPI(curves.GetPrim()).CreatePrimvar("st", kind, "uniform")
            primvar.Set(Vt.Vec2fArray.FromNumpy(self._lines.uv[begin : begin + strands]))
        return curves


def _drawn(stage: "Usd.Stage", time: "Usd.TimeCode") -> "list[UsdGeom.BasisCurves]":
    from pxr import Usd, UsdGeom

    found = []
    for prim in Usd.PrimRange(stage.GetPseudoRoot(), Usd.TraverseInstanceProxies()):
        curves = UsdGeom.BasisCurves(prim)
        if curves and curves.ComputeVisibility(time) != "invisible" and curves.ComputePurpose() in _DRAWN:
            found.append(curves)
    return found


def _read_prim(path: Path, curves: "UsdGeom.BasisCurves", places: "UsdGeom.XformCache") -> Ragged:
    time, where = places.GetTime(), f"{path}: {curves.GetPath()}"
    matrix = np.array(places.GetLocalToWorldTransform(curves.GetPrim()))  # of rows
    points = np.array(curves.GetPointsAttr().Get(time) or (), np.float64).reshape(-1, 3)
    counts = np.array(curves.GetCurveVertexCountsAttr().Get(time) or (), np.int64)
    kind: Any = "linear" if curves.GetTypeAttr().Get() == "linear" else curves.GetBasisAttr().Get()
    wrap: Any = curves.GetWrapAttr().Get()
    if kind not in get_args(Kind):
        raise InputError(f"{where}: basis is {kind!r}; ringlet reads bezier, bspline and catmullRom")
    if wrap not in get_args(Wrap):
        raise InputError(f"{where}: wrap is {wrap!r}; expected nonperiodic, periodic or pinned")
    widths, interpolation = _widths(curves, time)
    x, found, diameters = polylines(Curves(where, points, counts, kind, wrap, widths, interpolation))
    pins = np.tile(np.array([2, 0], np.uint8), (len(found), 1))
    if diameters is not None:
        diameters *= np.float32(np.cbrt(abs(np.linalg.det(matrix[:3, :3]))))
    return Ragged(x @ matrix[:3, :3] + matrix[3, :3], found, pins, diameters)


def _widths(curves: "UsdGeom.BasisCurves", time: "Usd.TimeCode") -> tuple[NDArray[np.float64] | None, str]:
    """Widths and what they belong to; a primvar of that name goes before the attribute."""
    from pxr import UsdGeom

    primvar = UsdGeom.PrimvarsAPI(curves.GetPrim()).GetPrimvar("widths")
    if primvar and primvar.HasAuthoredValue():
        values, interpolation = primvar.ComputeFlattened(time), primvar.GetInterpolation()
    else:
        values, interpolation = curves.GetWidthsAttr().Get(time), curves.GetWidthsInterpolation()
    if values is None or not len(values):
        return None, interpolation
    return np.array(values, np.float64), interpolation


def _reason(error: Exception) -> str:
    """What the library says, without the places in its own code."""
    try:
        said = [line.split(" : ", 1)[1] for line in str(error).splitlines() if " : " in line]
    except UnicodeDecodeError:  # it quotes the file
        return "it is no text"
    return said[0].strip("' ") if said else "not a stage"
