"""Grooms of other programs: USD, VTK and Alembic, written by their own libraries, read back by ringlet."""

import struct
import sys
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from pipeline.errors import InputError
from pipeline.groom.imported import in_metres
from pipeline.strands.formats import Ragged, read_groom
from pipeline.strands.formats.apart import Limits, read_apart, received, send

SHARED = Path(__file__).parents[2].parent / "shared/data"
COUNTS = [5, 2, 9]
POINTS = np.random.default_rng(4).normal(size=(sum(COUNTS), 3)).astype(np.float32)
WIDTHS = np.linspace(1e-4, 5e-5, sum(COUNTS)).astype(np.float32)


def stage(path: Path, text: str) -> Path:
    path.write_text("#usda 1.0\n" + text.replace("}", "\n}\n"))
    return path


def write_vtp(
    path: Path, points: NDArray[np.float32] = POINTS, ids: object = None, mode: str = "Binary"
) -> Path:
    from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
    from vtkmodules.vtkCommonCore import vtkPoints
    from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
    from vtkmodules.vtkIOXML import vtkXMLPolyDataWriter

    mesh, places, lines, writer = vtkPolyData(), vtkPoints(), vtkCellArray(), vtkXMLPolyDataWriter()
    places.SetData(numpy_to_vtk(points, deep=True))
    ids = np.arange(len(points)) if ids is None else np.asarray(ids)
    offsets = np.r_[0, np.cumsum(COUNTS)]
    lines.SetData(*(numpy_to_vtkIdTypeArray(a.astype(np.int64), deep=True) for a in (offsets, ids)))
    mesh.SetPoints(places)
    mesh.SetLines(lines)
    widths = numpy_to_vtk(WIDTHS, deep=True)
    widths.SetName("width")
    mesh.GetPointData().AddArray(widths)
    writer.SetFileName(str(path))
    writer.SetInputData(mesh)
    getattr(writer, f"SetDataModeTo{mode}")()
    writer.Write()
    return path


def write_alembic(path: Path, kind: str = "kLinear", matrix: NDArray[np.float64] | None = None) -> Path:
    import imath
    from alembic3d import Abc, AbcGeom

    archive = Abc.OArchive(str(path))
    parent = archive.getTop()
    if matrix is not None:
        moved = AbcGeom.OXform(parent, "moved")
        sample = AbcGeom.XformSample()
        sample.setMatrix(imath.M44d(*map(float, matrix.ravel())))
        moved.getSchema().set(sample)
        parent = moved
    curves = AbcGeom.OCurves(parent, "hair")
    sample = AbcGeom.OCurvesSchemaSample(
        imath.V3fArrayFromBuffer(POINTS),
        imath.IntArrayFromBuffer(np.array(COUNTS, np.int32)),
        getattr(AbcGeom.CurveType, kind),
        AbcGeom.CurvePeriodicity.kNonPeriodic,
    )
    widths = imath.FloatArrayFromBuffer(WIDTHS)
    sample.setWidths(AbcGeom.OFloatGeomParamSample(widths, AbcGeom.GeometryScope.kVertexScope))
    curves.getSchema().set(sample)
    return path


USD_CURVES = [  # file, strands, how many of them are none, up axis
    ("BasisCurves2.usda", 451, 0, "y"),
    ("basicCurves.usda", 7, 1, "z"),
    ("basisCurves_example.usda", 10, 0, "y"),
    ("bunnyCurves.usda", 6, 3, "z"),
    ("pinnedCurves.usda", 4, 1, "y"),
]


@pytest.mark.parametrize(("name", "strands", "none", "up"), USD_CURVES)
def test_the_curves_of_openusd_are_strands(name: str, strands: int, none: int, up: str) -> None:
    pytest.importorskip("pxr")
    if not (SHARED / "usd_curves" / name).exists():
        pytest.skip(f"the shared file {name} is not on this machine")
    read = read_groom(SHARED / "usd_curves" / name)
    assert (len(read), int((read.counts == 0).sum())) == (strands, none)
    assert (read.metres, read.up_axis) == (0.01, up)
    assert np.isfinite(read.points).all()
    assert read.widths is not None
    assert read.widths.min() >= 0
    assert len(read.points) == len(read.widths) == read.counts.sum()


def test_transforms_and_units_of_a_stage_are_those_of_its_strands(tmp_path: Path) -> None:
    """Two prims, one under a parent that turns, doubles and moves: (x, y, z) -> (2 - 2 y, 2 x, 2 z)."""
    pytest.importorskip("pxr")
    curve = """def BasisCurves "{}" {{
        uniform token type = "linear"
        int[] curveVertexCounts = [2]
        point3f[] points = [(0, 0, 0), (1, 0, 0)]
        float[] widths = [0.1] (interpolation = "constant")
        }}"""
    read = read_groom(
        stage(
            tmp_path / "two.usda",
            '(metersPerUnit = 0.001\nupAxis = "Z")\n'
            + curve.format("still")
            + """def Xform "parent" {
                double3 xformOp:translate = (2, 0, 0)
                double xformOp:rotateZ = 90
                double3 xformOp:scale = (2, 2, 2)
                uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateZ", "xformOp:scale"]
            """
            + curve.format("moved")
            + "}\n",
        )
    )
    assert np.abs(read.points - [[0, 0, 0], [1, 0, 0], [2, 0, 0], [2, 2, 0]]).max() < 1e-12
    assert read.widths == pytest.approx([0.1, 0.1, 0.2, 0.2])
    metric = in_metres(read, None, None)
    assert metric.points[3] == pytest.approx([0.002, 0, -0.002])
    assert metric.widths == pytest.approx([1e-4, 1e-4, 2e-4, 2e-4])
    told = in_metres(read, 1.0, "y")  # the config goes before the file
    assert np.array_equal(told.points, read.points)


def test_only_what_is_drawn_is_read_and_instances_are(tmp_path: Path) -> None:
    pytest.importorskip("pxr")
    curve = """def BasisCurves "{0}" ({1}) {{
        uniform token type = "linear"
        int[] curveVertexCounts = [2]
        point3f[] points = [(0, 0, 0), (1, 0, {2})]
        {3}
        }}"""
    text = (
        curve.format("seen", "", 1, "")
        + curve.format("hidden", "", 2, 'token visibility = "invisible"')
        + curve.format("guide", "", 3, 'uniform token purpose = "guide"')
        + curve.format("off", "active = false", 4, "")
        + f'class Xform "lock" {{ {curve.format("inner", "", 5, "")} }}'
        + 'def "a" (instanceable = true\nreferences = </lock>) {}\ndef "b" (references = </lock>) {}\n'
    )
    read = read_groom(stage(tmp_path / "drawn.usda", text))
    assert read.points[1::2, 2].tolist() == [1, 5, 5]


@pytest.mark.parametrize("ending", [".usdc", ".usdz"])
def test_binary_stages_and_archives_of_stages_are_read(tmp_path: Path, ending: str) -> None:
    pytest.importorskip("pxr")
    from pxr import Usd, UsdGeom, UsdUtils, Vt

    made = Usd.Stage.CreateNew(str(tmp_path / "a.usdc"))
    curves = UsdGeom.BasisCurves.Define(made, "/hair")
    curves.CreateTypeAttr("linear")
    curves.CreateCurveVertexCountsAttr(Vt.IntArray(COUNTS))
    curves.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(POINTS))
    made.Save()
    if ending == ".usdz":
        UsdUtils.CreateNewUsdzPackage(str(tmp_path / "a.usdc"), str(tmp_path / "a.usdz"))
    read = read_groom(tmp_path / f"a{ending}")
    assert read.counts.tolist() == COUNTS
    assert np.array_equal(read.points, POINTS)
    assert read.widths is None


STAGES = [
    (
        'def BasisCurves "c" { int[] curveVertexCounts = [3] }',
        "/c: its curves have 3 points, but there are 0",
    ),
    ('def BasisCurves "c" { int[] curveVertexCounts = [-1] }', "/c: curve 0 has a negative number"),
    ('def Xform "x" {}', "no BasisCurves"),
    ('def "broken', "OpenUSD cannot read it"),
    ('def BasisCurves "c" { uniform token basis = "hermite" }', "/c: basis is 'hermite'"),
    ('def BasisCurves "c" { uniform token wrap = "round" }', "/c: wrap is 'round'"),
    ('(metersPerUnit = 0)\ndef BasisCurves "c" {}', "metersPerUnit is 0"),
    (
        'def BasisCurves "c" { uniform token type = "linear"\nint[] curveVertexCounts = [2]\n'
        "point3f[] points = [(0, 0, 0), (1, 0, 0)]\nfloat[] widths = [1, 2, 3] }",
        "/c: 3 widths with interpolation 'vertex'; expected 2",
    ),
]


@pytest.mark.parametrize(("text", "named"), STAGES)
def test_a_stage_that_does_not_fit_together_is_refused_by_prim(tmp_path: Path, text: str, named: str) -> None:
    pytest.importorskip("pxr")
    path = stage(tmp_path / "wrong.usda", text)
    with pytest.raises(InputError) as refused:
        read_groom(path)
    assert str(refused.value).startswith(str(path))
    assert named in str(refused.value)


@pytest.mark.parametrize("mode", ["Ascii", "Binary", "Appended"])
def test_polylines_of_vtk_are_strands(tmp_path: Path, mode: str) -> None:
    read = read_groom(write_vtp(tmp_path / "groom.vtp", mode=mode))
    assert read.counts.tolist() == COUNTS
    assert np.array_equal(read.points, POINTS)
    assert np.array_equal(read.widths, WIDTHS)
    assert (read.metres, read.up_axis) == (None, None)


def test_a_strand_is_a_polyline_in_the_order_of_its_points(tmp_path: Path) -> None:
    ids = np.random.default_rng(1).permutation(len(POINTS))
    read = read_groom(write_vtp(tmp_path / "groom.vtp", ids=ids))
    assert np.array_equal(read.points, POINTS[ids])
    assert np.array_equal(read.widths, WIDTHS[ids])


def test_the_first_step_of_a_vtkhdf_series_is_a_groom(tmp_path: Path) -> None:
    from pipeline.cache import create_guides

    path = tmp_path / "guides.vtkhdf"
    frames = np.random.default_rng(1).normal(size=(3, 4, 8, 3)).astype(np.float32)
    with create_guides(path, "key", guides=4, points=8, fps=24) as writer:
        for frame in frames:
            writer.append(frame, np.eye(4))
    read = read_groom(path)
    assert read.counts.tolist() == [8] * 4
    assert np.array_equal(read.points, frames[0].reshape(-1, 3))


def test_a_mesh_without_lines_or_with_lines_beyond_its_points_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"Lines: connectivity names a point beyond the 16"):
        read_groom(write_vtp(tmp_path / "beyond.vtp", ids=np.arange(16) + 1))
    empty = tmp_path / "empty.vtp"
    empty.write_text(
        '<VTKFile type="PolyData" version="1.0"><PolyData>'
        '<Piece NumberOfPoints="0" NumberOfLines="0"></Piece></PolyData></VTKFile>'
    )
    with pytest.raises(InputError, match=r"empty\.vtp: no polylines"):
        read_groom(empty)
    (tmp_path / "noise.vtp").write_bytes(b"no XML at all")
    with pytest.raises(InputError, match=r"noise\.vtp: VTK cannot read it: "):
        read_groom(tmp_path / "noise.vtp")


def test_curves_of_alembic_are_strands_where_their_transforms_put_them(tmp_path: Path) -> None:
    pytest.importorskip("alembic3d")
    read = read_groom(write_alembic(tmp_path / "groom.abc"))
    assert read.counts.tolist() == COUNTS
    assert np.array_equal(read.points, POINTS)
    assert np.array_equal(read.widths, WIDTHS)
    matrix = np.array([[0, 2, 0, 0], [-2, 0, 0, 0], [0, 0, 2, 0], [1, 2, 3, 1.0]])
    moved = read_groom(write_alembic(tmp_path / "moved.abc", matrix=matrix))
    assert np.abs(moved.points - (POINTS @ matrix[:3, :3] + [1, 2, 3])).max() < 1e-12
    assert moved.widths == pytest.approx(2 * WIDTHS)


def test_cubic_curves_of_alembic_are_evaluated(tmp_path: Path) -> None:
    pytest.importorskip("alembic3d")
    read = read_groom(write_alembic(tmp_path / "cubic.abc", "kCubic"))  # of Bezier, its default
    assert (read.counts == 0).tolist() == [True, True, True]  # 5, 2 and 9 points fit no Bezier segments


def test_an_archive_that_is_none_is_refused(tmp_path: Path) -> None:
    pytest.importorskip("alembic3d")
    (tmp_path / "noise.abc").write_bytes(b"no archive")
    with pytest.raises(InputError, match=r"noise\.abc: Alembic cannot read it: "):
        read_groom(tmp_path / "noise.abc")


def test_a_library_that_is_missing_is_told_with_the_line_that_brings_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("pxr", "alembic3d", "imath"):
        (tmp_path / f"{name}.py").write_text(f"raise ModuleNotFoundError('no', name={name!r})")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    for file, extra in (("a.usda", "usd"), ("a.abc", "alembic")):
        (tmp_path / file).touch()
        with pytest.raises(InputError, match=rf'pip install "ringlet\[{extra}\]"'):
            read_groom(tmp_path / file)


def test_strands_arrive_as_they_were_sent(tmp_path: Path) -> None:
    pins = np.tile(np.array([2, 0], np.uint8), (3, 1))
    for widths in (None, WIDTHS):
        sent = Ragged(POINTS.astype(np.float64), np.array(COUNTS), pins, widths, 0.01, "z")
        with (tmp_path / "pipe").open("wb") as file:
            send(sent, file)
        found = received((tmp_path / "pipe").read_bytes())
        assert np.array_equal(found.points, sent.points)
        assert np.array_equal(found.counts, sent.counts)
        assert np.array_equal(found.pins, sent.pins)
        assert (found.widths is None) == (widths is None)
        assert (found.metres, found.up_axis) == (0.01, "z")


HARM = {  # what a library may do instead of reading, and what the message must say
    "crashed (SIGSEGV)": "import ctypes; ctypes.string_at(0)",
    "crashed (SIGABRT)": "import os; os.abort()",
    "takes more than": "x = bytearray(1 << 36)",
    "took more than 4 s": "import signal; signal.raise_signal(signal.SIGXCPU)",
    "cannot be read (KeyError: 4)": "import resource as r; {}[r.getrlimit(r.RLIMIT_CPU)[0]]",
    "cannot be read (KeyError: 2147483648)": "import resource as r; {}[r.getrlimit(r.RLIMIT_AS)[0]]",
    "cannot be read (KeyError: 'x')": "{}['x']",
}


@pytest.mark.parametrize("named", HARM)
def test_whatever_happens_to_the_child_is_a_message(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, named: str
) -> None:
    (tmp_path / "pxr.py").write_text(HARM[named])
    (tmp_path / "a.usda").touch()
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    with pytest.raises(InputError) as refused:
        read_apart(tmp_path / "a.usda")
    assert str(refused.value).startswith(str(tmp_path / "a.usda"))
    assert named in str(refused.value)


def test_limits_grow_with_the_file(tmp_path: Path) -> None:
    small, large = tmp_path / "small.abc", tmp_path / "large.abc"
    small.touch()
    with large.open("wb") as file:
        file.truncate(100_000_000)
    assert Limits.of(small) == Limits(2 << 30, 4)
    assert Limits.of(large) == Limits((2 << 30) + 6_400_000_000, 54)
    assert struct.calcsize("P") == 8, sys.platform  # such limits need addresses of 64 bits
    with pytest.raises(InputError, match="no such groom file"):
        Limits.of(tmp_path / "none.abc")
