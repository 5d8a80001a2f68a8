"""Export: what the libraries of other programs find in the files is what was simulated, to the last bit."""

import importlib.util
import sys
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.typing import NDArray

from pipeline import cache
from pipeline.cache.expansion import expansion_from
from pipeline.cli.main import call
from pipeline.config import load
from pipeline.errors import InputError
from pipeline.export.export import export
from pipeline.render.geometry import drawn_width, taper
from pipeline.strands.formats import read_groom
from pipeline.strands.formats.alembic import AlembicWriter
from pipeline.strands.formats.hair import write_hair_moment
from pipeline.strands.formats.lines import Lines
from pipeline.strands.formats.usd import UsdWriter
from pipeline.strands.formats.vtk_lines import write_vtp

Points = NDArray[np.float32]

CONFIG = """\
name = "small"
[scene]
head = "none"
[groom]
source = "swatch"
strands = 12
guides = 4
points = 9
[interpolate]
strands = 30
[simulate]
frames = 3
fps = 25
settle = "0 s"
[simulate.motion]
preset = "shake"
period = "0.2 s"
"""
S, P, F = 30, 9, 3


@pytest.fixture(scope="module")
def config(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A config whose stages before the render are made."""
    path = tmp_path_factory.mktemp("export") / "small.toml"
    path.write_text(CONFIG)
    assert call(["run", str(path), "--until", "interpolate", "--outputs", str(path.parent)]) == 0
    return path


@pytest.fixture(scope="module")
def frames(config: Path) -> Points:
    """(F, S, P, 3): what the caches describe."""
    experiment = cache.Experiment(config.parent / "small")
    with (
        cache.open(experiment.groom) as groom,
        cache.open(experiment.strands) as strands,
        cache.open_guides(experiment.guides) as guides,
    ):
        expansion = expansion_from(groom, strands, load(config).config)
        found = []
        for at in range(F):
            expansion.frame(guides.frame(at), guides.pose(at))
            found.append(expansion.chunk(0, S))
    assert np.abs(found[0] - found[-1]).max() > 1e-5  # they move
    return np.stack(found)


@pytest.fixture(scope="module")
def widths(config: Path) -> Points:
    render = load(config).config.render
    profile = (drawn_width(render, S) * taper(render, P)).astype(np.float32)
    assert profile[-1] < profile[0]
    return np.tile(profile, S)


def exported(config: Path, to: Path, *options: str) -> Path:
    assert call(["export", str(config), "--outputs", str(config.parent), "--to", str(to), *options]) == 0
    return to


def test_usd_has_every_frame_as_a_time_sample_in_metres(
    config: Path, frames: Points, widths: Points, tmp_path: Path
) -> None:
    pytest.importorskip("pxr")
    from pxr import Usd, UsdGeom

    stage = Usd.Stage.Open(str(exported(config, tmp_path, "--format", "usd") / "strands.usdc"))
    assert UsdGeom.GetStageMetersPerUnit(stage) == 1
    assert UsdGeom.GetStageUpAxis(stage) == "Y"
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode()) == (1, F)
    assert stage.GetTimeCodesPerSecond() == stage.GetFramesPerSecond() == 25
    assert str(stage.GetDefaultPrim().GetPath()) == "/hair"
    curves = UsdGeom.BasisCurves(stage.GetPrimAtPath("/hair/strands_000"))
    assert curves.GetPointsAttr().GetTimeSamples() == [1, 2, 3]
    for at in range(F):
        assert np.array_equal(curves.GetPointsAttr().Get(at + 1), frames[at].reshape(-1, 3))
        lower, upper = np.array(curves.GetExtentAttr().Get(at + 1))
        assert (frames[at] > lower).all()
        assert (frames[at] < upper).all()
    assert np.array_equal(curves.GetCurveVertexCountsAttr().Get(), [P] * S)
    assert curves.GetCurveVertexCountsAttr().GetNumTimeSamples() == 0  # topology once
    assert (curves.GetTypeAttr().Get(), curves.GetBasisAttr().Get(), curves.GetWrapAttr().Get()) == (
        "cubic",
        "catmullRom",
        "pinned",
    )
    assert np.array_equal(curves.GetWidthsAttr().Get(), widths)
    assert curves.GetWidthsInterpolation() == "vertex"


def test_alembic_has_every_frame_as_a_sample_in_seconds(
    config: Path, frames: Points, widths: Points, tmp_path: Path
) -> None:
    pytest.importorskip("alembic3d")
    import imath  # noqa: F401
    from alembic3d import Abc, AbcGeom

    path = exported(config, tmp_path, "--format", "abc", "--frames", "2-3") / "strands.abc"
    archive = Abc.IArchive(str(path))
    schema = AbcGeom.ICurves(archive.getTop(), "strands_000").getSchema()
    assert schema.getNumSamples() == 2
    times = schema.getTimeSampling()
    assert [times.getSampleTime(at) for at in range(2)] == pytest.approx([1 / 25, 2 / 25])
    for at in range(2):
        sample = schema.getValue(Abc.ISampleSelector(at))
        assert np.array_equal(np.array(sample.getPositions()), frames[at + 1].reshape(-1, 3))
        assert np.array_equal(np.array(sample.getCurvesNumVertices()), [P] * S)
    assert np.array_equal(np.array(schema.getWidthsParam().getExpandedValue().getVals()), widths)


def test_hair_has_a_file_for_every_frame(
    config: Path, frames: Points, widths: Points, tmp_path: Path
) -> None:
    exported(config, tmp_path, "--format", "hair")
    for at in range(F):
        read = read_groom(tmp_path / f"strands/{at + 1:04d}.hair")
        assert np.array_equal(read.points, frames[at].reshape(-1, 3))
        assert read.counts.tolist() == [P] * S
        assert np.array_equal(read.widths, widths)


def test_vtk_has_a_file_for_every_frame_and_a_series(
    config: Path, frames: Points, widths: Points, tmp_path: Path
) -> None:
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOXML import vtkXMLPolyDataReader

    exported(config, tmp_path, "--format", "vtp")
    for at in range(F):
        reader = vtkXMLPolyDataReader()
        reader.SetFileName(str(tmp_path / f"strands/{at + 1:04d}.vtp"))
        reader.Update()
        mesh = reader.GetOutput()
        assert np.array_equal(vtk_to_numpy(mesh.GetPoints().GetData()), frames[at].reshape(-1, 3))
        assert np.array_equal(vtk_to_numpy(mesh.GetLines().GetOffsetsArray()), np.arange(S + 1) * P)
        assert np.array_equal(vtk_to_numpy(mesh.GetLines().GetConnectivityArray()), np.arange(S * P))
        assert np.array_equal(vtk_to_numpy(mesh.GetPointData().GetArray("width")), widths)
        assert np.array_equal(vtk_to_numpy(mesh.GetCellData().GetArray("strand")), np.arange(S))
    series = (tmp_path / "strands.pvd").read_text()
    for number, time in ((1, "0"), (2, "0.04"), (3, "0.08")):
        assert f'timestep="{time}" part="0" file="strands/{number:04d}.vtp"' in series


@pytest.mark.parametrize("ending", ["usdc", "abc", "hair", "vtp"])
def test_what_is_exported_can_be_imported(config: Path, frames: Points, tmp_path: Path, ending: str) -> None:
    pytest.importorskip({"usdc": "pxr", "abc": "alembic3d"}.get(ending, "numpy"))
    to = exported(config, tmp_path, "--format", ending.removesuffix("c") if ending == "usdc" else ending)
    path = to / (f"strands.{ending}" if ending in ("usdc", "abc") else f"strands/0001.{ending}")
    read = read_groom(path)
    assert len(read) == S
    for strand, first, count in zip(frames[0], read.first, read.counts, strict=True):
        found = read.points[first : first + count]
        missed = np.linalg.norm(found[:, None] - strand, axis=2).min(axis=0).max()
        assert missed < (1e-7 if ending == "usdc" else 1e-12)  # its curve goes through all points
    assert (read.metres, read.up_axis) == ((1, "y") if ending == "usdc" else (None, None))


def test_fewer_strands_are_a_prefix_and_wider(
    config: Path, frames: Points, widths: Points, tmp_path: Path
) -> None:
    exported(config, tmp_path, "--format", "hair", "--strands", "7", "--frames", "2")
    read = read_groom(tmp_path / "strands/0002.hair")
    assert np.array_equal(read.points, frames[1, :7].reshape(-1, 3))
    assert read.widths is not None
    assert read.widths[0] == pytest.approx(widths[0] * np.sqrt(S / 7))
    assert [path.name for path in (tmp_path / "strands").iterdir()] == ["0002.hair"]


def test_guides_are_exported_too(config: Path, tmp_path: Path) -> None:
    exported(config, tmp_path, "--format", "hair", "--what", "guides")
    with cache.open_guides(config.parent / "small/guides.h5") as guides:
        for at in range(F):
            read = read_groom(tmp_path / f"guides/{at + 1:04d}.hair")
            assert np.array_equal(read.points, guides.frame(at).reshape(-1, 3))


@pytest.mark.parametrize("ending", ["hair", "vtp"])
def test_an_export_that_was_cut_off_goes_on(config: Path, tmp_path: Path, ending: str) -> None:
    folder = exported(config, tmp_path, "--format", ending) / "strands"
    whole = {path.name: path.read_bytes() for path in folder.iterdir()}
    times = {path: path.stat().st_mtime_ns for path in folder.iterdir()}
    (folder / f"0002.{ending}").unlink()
    (folder / f"0003.{ending}").write_bytes(b"of something else")
    exported(config, tmp_path, "--format", ending)
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == whole
    again = {path.name for path in folder.iterdir() if path.stat().st_mtime_ns != times[path]}
    assert again == {f"0002.{ending}", f"0003.{ending}"}
    exported(config, tmp_path, "--format", ending, "--strands", "5")  # other strands, other files
    assert len((folder / f"0001.{ending}").read_bytes()) < len(whole[f"0001.{ending}"])


@pytest.mark.parametrize("kind", ["usd", "abc", "hair", "vtp"])
def test_an_export_that_fails_leaves_what_was_there(
    config: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    pytest.importorskip({"usd": "pxr", "abc": "alembic3d"}.get(kind, "numpy"))
    from pipeline.strands.expand import Expansion

    exported(config, tmp_path, "--format", kind)
    whole = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    for path in tmp_path.rglob("000*"):
        path.write_bytes(whole.setdefault(path, b"")[:200].replace(b"ringlet strands", b"other"))
    kept = {path: path.read_bytes() for path in whole}

    def fail(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(Expansion, "chunk", fail)
    options = ["--outputs", str(config.parent), "--to", str(tmp_path), "--format", kind]
    assert call(["export", str(config), *options]) == 130
    assert {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()} == kept


def test_a_missing_library_and_wrong_options_are_told(
    config: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "pxr", None)
    monkeypatch.setitem(sys.modules, "imath", None)
    loaded, experiment = load(config).config, cache.Experiment(config.parent / "small")
    for kind, extra in (("usd", "usd"), ("abc", "alembic")):
        with pytest.raises(InputError, match=rf'--format {kind} needs .* pip install "ringlet\[{extra}\]"'):
            export(loaded, experiment, kind, range(1, 2), folder=tmp_path)
    assert not list(tmp_path.iterdir())
    for options in (["--frames", "2-9"], ["--strands", "0"], ["--what", "heads"], ["--format", "obj"]):
        assert call(["export", str(config), "--format", "hair", *options]) == 2
        assert options[0] in capsys.readouterr().err


def test_what_does_not_fit_on_the_disk_is_not_begun(
    config: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("shutil.disk_usage", lambda _: SimpleNamespace(free=S * P * (12 * F + 4) - 1))
    options = ["--outputs", str(config.parent), "--to", str(tmp_path / "new"), "--format", "hair"]
    assert call(["export", str(config), *options]) == 2
    assert "3 frames of 30 strands take 0.0 GB, but 0.0 GB are free" in capsys.readouterr().err
    assert not (tmp_path / "new").exists()


def chunks(strands: int, each: int, points: int) -> Iterator[Points]:
    for a in range(0, strands, each):
        count = min(each, strands - a)
        yield np.full((count, points, 3), a, np.float32)


def test_chunks_become_prims_or_pieces_of_one_array(tmp_path: Path) -> None:
    lines = Lines(50, 4, np.array([4, 3, 2, 1], np.float32), 24, "about")
    whole = np.concatenate(list(chunks(50, 20, 4))).reshape(-1, 3)
    write_hair_moment(tmp_path / "a.hair", lines, chunks(50, 20, 4))
    write_vtp(tmp_path / "a.vtp", lines, chunks(50, 20, 4))
    files = [tmp_path / "a.hair", tmp_path / "a.vtp"]
    if all(importlib.util.find_spec(name) for name in ("pxr", "alembic3d")):
        usd = UsdWriter(tmp_path / "a.usdc", lines)
        abc = AlembicWriter(tmp_path / "a.abc", lines, 1)
        for writer in (usd, abc):
            for frame in (1, 2):
                writer.append(frame, chunks(50, 20, 4))
            writer.close()
        files += [tmp_path / "a.usdc", tmp_path / "a.abc"]
    for path in files:
        read = read_groom(path)
        ends = np.cumsum(read.counts) - 1
        assert np.array_equal(read.points[read.first], whole[::4])
        assert np.array_equal(read.points[ends], whole[3::4])
        assert read.widths is not None
        assert set(read.widths[ends]) == {1}


def test_uvs_of_roots_go_with_their_strands(tmp_path: Path) -> None:
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOXML import vtkXMLPolyDataReader

    uv = np.random.default_rng(1).random((50, 2), np.float32)
    lines = Lines(50, 4, np.full(4, 1e-4, np.float32), 24, "about", uv)
    write_vtp(tmp_path / "a.vtp", lines, chunks(50, 20, 4))
    reader = vtkXMLPolyDataReader()
    reader.SetFileName(str(tmp_path / "a.vtp"))
    reader.Update()
    assert np.array_equal(vtk_to_numpy(reader.GetOutput().GetCellData().GetArray("uv")), uv)
    assert np.array_equal(vtk_to_numpy(reader.GetOutput().GetCellData().GetArray("strand")), np.arange(50))
    assert len(read_groom(tmp_path / "a.vtp")) == 50
    if not all(importlib.util.find_spec(name) for name in ("pxr", "alembic3d")):
        return
    from alembic3d import Abc, AbcGeom
    from pxr import Usd, UsdGeom

    usd, abc = UsdWriter(tmp_path / "a.usdc", lines), AlembicWriter(tmp_path / "a.abc", lines, 1)
    for writer in (usd, abc):
        for frame in (1, 2):
            writer.append(frame, chunks(50, 20, 4))
        writer.close()
    stage, archive = Usd.Stage.Open(str(tmp_path / "a.usdc")), Abc.IArchive(str(tmp_path / "a.abc"))
    for number, begin in enumerate((0, 20, 40)):
        name = f"strands_{number:03d}"
        st = UsdGeom.PrimvarsAPI(stage.GetPrimAtPath(f"/hair/{name}")).GetPrimvar("st")
        assert np.array_equal(st.Get(), uv[begin : begin + 20])
        assert st.GetInterpolation() == "uniform"
        found = AbcGeom.ICurves(archive.getTop(), name).getSchema().getUVsParam().getExpandedValue()
        assert np.array_equal(np.array(found.getVals()), uv[begin : begin + 20])
        assert found.getScope() == AbcGeom.GeometryScope.kUniformScope


@pytest.mark.parametrize("kind", ["usd", "abc"])
def test_memory_does_not_grow_with_frames(tmp_path: Path, kind: str) -> None:
    """Memory in use after 4 and after 16 frames of 6 MB."""
    pytest.importorskip({"usd": "pxr", "abc": "alembic3d"}[kind])
    lines = Lines(16_000, 32, np.full(32, 1e-4, np.float32), 24, "about")
    writer: UsdWriter | AlembicWriter
    writer = (
        UsdWriter(tmp_path / "a.usdc", lines)
        if kind == "usd"
        else AlembicWriter(tmp_path / "a.abc", lines, 1)
    )
    used = []
    for frame in range(1, 17):
        points = np.random.default_rng(frame).random((16_000, 32, 3), np.float32)
        writer.append(frame, [points])
        used.append(int(Path("/proc/self/statm").read_text().split()[1]) * 4096 / 1e6)
    writer.close()
    size = next(tmp_path.iterdir()).stat().st_size / 1e6
    print(f"{kind}: {used[3]:.0f} MB after 4 frames, {used[-1]:.0f} MB after 16; the file has {size:.0f} MB")
    assert used[-1] - used[3] < 12
    assert size > 16 * 6
