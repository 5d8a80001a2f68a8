"""OpenUSD: UsdGeomBasisCurves of a stage (.usd, .usda, .usdc, .usdz).

A strand is a curve; strands are counted over the prims in the order of the stage. Read are all prims that are drawn:
active, visible, of purpose "default" or "render", instances too, each where its transforms put it at the first time
of the stage. `widths` are diameters in the space of their prim. The stage says its unit and its up axis; one that
does not is in centimetres with y up, by definition. Source: the documentation of UsdGeomBasisCurves and
UsdGeomMetrics.
"""

from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args

import numpy as np
from numpy.typing import NDArray

from pipeline.errors import InputError
from pipeline.strands.formats.curves import Curves, Kind, Wrap, polylines
from pipeline.strands.formats.ragged import Ragged, gathered

if TYPE_CHECKING:
    from pxr import Usd, UsdGeom

_DRAWN = ("default", "render")


def read_usd(path: Path) -> Ragged:
    """Read the curves of a stage. Raises InputError, naming prim and attribute, for what does not fit together.

    To be called where the library may crash: see `apart`.
    """
    from pxr import Tf, Usd, UsdGeom

    try:
        stage = Usd.Stage.Open(str(path))
    except Tf.ErrorException as error:
        raise InputError(f"{path}: OpenUSD cannot read it: {_reason(error)}") from None
    time = Usd.TimeCode(stage.GetStartTimeCode()) if stage.HasAuthoredTimeCodeRange() else None
    places = UsdGeom.XformCache(time or Usd.TimeCode.EarliestTime())
    pieces = [_read_prim(path, prim, places) for prim in _drawn(stage, places.GetTime())]
    if not pieces:
        raise InputError(f"{path}: no BasisCurves in it that are drawn, so no strands")
    metres = UsdGeom.GetStageMetersPerUnit(stage)
    if not metres > 0:
        raise InputError(f"{path}: metersPerUnit is {metres:g}; expected a number above 0")
    return gathered(pieces, metres, UsdGeom.GetStageUpAxis(stage).lower())


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
    said = [line.split(" : ", 1)[1] for line in str(error).splitlines() if " : " in line]
    return said[0].strip("' ") if said else "not a stage"
