"""Any head: a copy of the built-in one in other units and axes grows the same hair; paint, planes and what is told."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image
from shipped_configs import shipped

from pipeline import cache
from pipeline.cache.expansion import placement
from pipeline.config.schema import Camera, Config, Contact, Groom, Motion, Plane, Scalp, Scene, Simulate
from pipeline.errors import InputError
from pipeline.groom import stage
from pipeline.groom.head_mesh import load_mesh, zero_surface
from pipeline.groom.heads import Head, make_head
from pipeline.groom.procedural import Style
from pipeline.render.camera import CameraPath
from pipeline.simulate.motion import head_motion

pv = pytest.importorskip("pyvista")

TO_Z_UP = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])  # (x, y, z) -> (x, -z, y), as Blender's axes
MOVED, SIZE = np.array([3.0, 40.0, -7.0]), 1.2  # [cm] and times: where the copy stands, and its size


def written(path: Path, p: NDArray[np.floating[Any]], triangles: NDArray[np.integer]) -> Path:
    """A head in centimetres, z up, larger and elsewhere; with heights painted on it and texture coordinates."""
    points = 100 * SIZE * p @ TO_Z_UP.T + MOVED
    mesh = pv.PolyData(points, np.insert(triangles, 0, 3, axis=1).ravel())
    mesh.point_data["hair"] = np.clip((p[:, 1] - 0.05) / 0.02, 0, 1)
    mesh.point_data["bytes"] = np.where(p[:, 0] > 0, 255, 0).astype(np.uint8)
    mesh.point_data["metres"] = p[:, 1]
    mesh.active_texture_coordinates = np.column_stack([0.5 + 3 * p[:, 0], 0.5 + 3 * p[:, 1]]).astype(
        np.float32
    )
    mesh.save(path)
    return path


@pytest.fixture(scope="module")
def copy(mannequin: Head, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A coarse copy of the built-in head: its surface on a grid of 6 mm."""
    field = mannequin.field
    points, triangles = zero_surface(field.values[::2, ::2, ::2])
    place = field.origin + 2 * field.spacing * points
    return written(tmp_path_factory.mktemp("heads") / "copy.vtp", place, triangles)


def on_copy(path: Path, groom: Groom, **scene: Any) -> Config:
    options = {"head": str(path), "unit_scale": 0.01, "up_axis": "z"} | scene
    contact = Simulate(contact=Contact(spacing=0.006))
    return Config(name="copy", groom=groom, scene=Scene(**options), simulate=contact)


def made(path: Path, groom: Groom, **scene: Any) -> Head:
    head = make_head(on_copy(path, groom, **scene))
    assert head is not None
    return head


@pytest.fixture(scope="module")
def plain(copy: Path) -> Head:
    return made(copy, Groom())


def roots_on(head: Head, scalp: Scalp) -> NDArray[np.float64]:
    groom = shipped("default", strands=400, scalp=scalp)
    return Style(groom, replace(head, region=replace(head.region, options=scalp))).roots


def test_a_head_in_other_units_axes_and_size_grows_the_same_hair(mannequin: Head, tmp_path: Path) -> None:
    """The fit finds scale and place; strands are those of the built-in head, up to the first root over a threshold."""
    path = written(tmp_path / "copy.vtp", mannequin.skin.points, mannequin.skin.triangles)
    scene = Scene(head=str(path), unit_scale=0.01, up_axis="z")
    simulate = Simulate(contact=Contact(spacing=SIZE * mannequin.field.spacing))
    head = make_head(Config(name="copy", scene=scene, simulate=simulate))
    assert head is not None
    config = shipped("default", strands=1000)
    ours, theirs = (Style(config, of) for of in (mannequin, head))
    moved = np.linalg.norm(theirs.roots - ours.roots, axis=1)
    same = int(np.argmax(np.append(moved, 1) > 1e-3))
    points = (theirs.strands(0, same).points - head.offset) / head.scale
    apart = np.linalg.norm(points - ours.strands(0, same).points, axis=2).max(axis=1)
    place = MOVED @ TO_Z_UP / 100
    print(
        f"scale {head.scale:.5f}, place off by {1e3 * np.abs(head.offset - place).max():.3f} mm; the first {same} roots "
        f"are the same, within {1e3 * moved[:same].max():.3f} mm; farthest points of strands {1e3 * np.median(apart):.2f} "
        f"mm apart in the median, {1e3 * np.quantile(apart, 0.95):.2f} mm for 95 of 100"
    )
    assert head.scale == pytest.approx(SIZE, rel=1e-3)
    assert np.abs(head.offset - place).max() < 0.1e-3
    assert same > 200
    assert np.median(apart) < 0.5e-3
    assert np.quantile(apart, 0.95) < 5e-3


@pytest.mark.parametrize(("up", "face", "told"), [("z", "y", "-y"), ("z", "x", "-y"), ("y", None, "-y")])
def test_a_head_that_looks_another_way_is_told_how_it_looks(
    copy: Path, up: str, face: str | None, told: str
) -> None:
    with pytest.raises(InputError, match=f'look along "{told}" of its file with "z" up') as said:
        made(copy, Groom(), up_axis=up, face_axis=face)
    print(said.value)


def test_painted_numbers_and_texture_coordinates_are_read_where_they_are(
    mannequin: Head, copy: Path, plain: Head
) -> None:
    p = mannequin.on_skin(np.random.default_rng(1).uniform(-0.6, 0.6, (500, 2)))
    height, uv = plain.array("metres", p), plain.uv(p)
    off = [np.abs(height - p[:, 1]).max(), np.abs(uv - 0.5 - 3 * p[:, :2]).max() / 3]
    print(
        f"arrays {sorted(plain.arrays)}; heights off by {1e3 * off[0]:.2f} mm, texture coordinates by {1e3 * off[1]:.2f} mm"
    )
    assert max(off) < 1.5e-3
    assert set(np.unique(plain.arrays["bytes"])) == {0, 1}


@pytest.mark.parametrize("ending", ["obj", "ply", "vtp"])
def test_texture_coordinates_of_files_follow_triangles_through_seams_and_turns(
    tmp_path: Path, ending: str
) -> None:
    """A tetrahedron with a seam and one face inside out: every corner keeps its own coordinates."""
    corners = np.array([[0.0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]])
    faces = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 2, 3]])  # the last one inside out
    uv = np.random.default_rng(2).uniform(0, 1, (4, 3, 2)).astype(np.float32)
    path = tmp_path / f"seams.{ending}"
    if ending == "obj":
        lines = [f"v {x} {y} {z}" for x, y, z in corners] + [f"vt {u} {v}" for u, v in uv.reshape(-1, 2)]
        lines += [
            "f " + " ".join(f"{c + 1}/{3 * t + k + 1}" for k, c in enumerate(face))
            for t, face in enumerate(faces)
        ]
        path.write_text("\n".join(lines))
    elif ending == "ply":
        head = ["ply", "format ascii 1.0", "element vertex 12"]
        head += [f"property float {name}" for name in ("x", "y", "z", "u", "v")]
        head += ["element face 4", "property list uchar int vertex_indices", "end_header"]
        rows = np.column_stack([corners[faces].reshape(-1, 3), uv.reshape(-1, 2)])
        ends = [f"3 {3 * t} {3 * t + 1} {3 * t + 2}" for t in range(4)]
        path.write_text("\n".join(head + [" ".join(map(str, row)) for row in rows] + ends) + "\n")
    else:
        mesh = pv.PolyData(
            corners[faces].reshape(-1, 3), np.insert(np.arange(12).reshape(4, 3), 0, 3, axis=1).ravel()
        )
        mesh.active_texture_coordinates = uv.reshape(-1, 2)
        mesh.save(path)
    found = load_mesh(path)
    assert found.uv is not None
    given, read = (
        {
            tuple(row)
            for row in np.round(1e4 * np.concatenate([place, tex], axis=2))
            .astype(int)
            .reshape(-1, 5)
            .tolist()
        }
        for place, tex in ((corners[faces], uv), (found.points[found.triangles], found.uv))
    )
    print(
        f"{ending}: {len(found.points)} points, {len(given & read)} of {len(given)} corners have their coordinates"
    )
    assert len(found.points) == 4
    assert given == read


def test_hair_grows_where_it_is_painted(plain: Head) -> None:
    """Painted from 5 cm up; half as dense where the paint is half."""
    roots = roots_on(plain, Scalp(array="hair"))
    print(f"lowest root at {1e3 * roots[:, 1].min():.1f} mm of 50")
    assert roots[:, 1].min() > 0.0495
    left = roots_on(plain, Scalp(array="bytes"))
    print(
        f"{(left[:, 0] > -1e-3).mean():.3f} of the roots where bytes are 255; {(left[:, 1] < -0.05).mean():.2f} low on the face"
    )
    assert (left[:, 0] > -6e-3).all()  # the paint falls off over one edge of the mesh


def test_hair_grows_beyond_planes(mannequin: Head) -> None:
    planes = (
        Plane(point=(0.0, 0.06, 0.0), normal=(0.0, 1.0, 0.0)),
        Plane(point=(0.0, 0.0, 0.02), normal=(0.0, 0.0, -2.0)),
    )
    roots = roots_on(mannequin, Scalp(planes=planes))
    print(f"roots from y = {roots[:, 1].min():.4f} m, to z = {roots[:, 2].max():.4f} m")
    assert roots[:, 1].min() > 0.06 - 1e-4
    assert roots[:, 2].max() < 0.02 + 1e-4
    assert roots[:, 2].min() < -0.05


def test_hair_grows_where_an_image_is_white(plain: Head, mannequin: Head, tmp_path: Path) -> None:
    """By the mesh's texture coordinates, whose v is 0.5 + 3 y; on the built-in head by the chart."""
    rows = np.where(np.arange(64)[:, None] < 16, 255, 0) * np.ones((1, 64))  # the upper quarter: v > 0.75
    Image.fromarray(rows.astype(np.uint8)).save(tmp_path / "hair.png")
    scalp = Scalp(map=str(tmp_path / "hair.png"))
    lowest = roots_on(plain, scalp)[:, 1].min()
    v = mannequin.uv(roots_on(mannequin, scalp))[:, 1].min()
    print(f"lowest root at {lowest:.4f} m of 0.0833; on the built-in head v from {v:.3f} of 0.75")
    assert lowest == pytest.approx(0.25 / 3, abs=4e-3)
    assert v == pytest.approx(0.75, abs=0.01)


@pytest.mark.parametrize(
    ("scalp", "message"),
    [
        (Scalp(array="beard"), 'no painted array "beard" on the points of this mesh; it has .*bytes'),
        (Scalp(array="metres"), '"metres" goes from -0.*paint 0'),
        (Scalp(map="/no/such.png"), "such.png: cannot be read as an image"),
        (
            Scalp(planes=(Plane(point=(0.0, 5.0, 0.0), normal=(0.0, 1.0, 0.0)),)),
            "planes: no skin .*normals point",
        ),
    ],
)
def test_regions_that_cannot_serve_are_refused(plain: Head, scalp: Scalp, message: str) -> None:
    with pytest.raises(InputError, match=message):
        roots_on(plain, scalp)


def test_paint_that_leaves_no_hair_is_refused(plain: Head) -> None:
    bald = replace(plain, arrays={"none": np.zeros(len(plain.skin.points), np.float32)})
    with pytest.raises(InputError, match='"none" leaves no hair; paint it with 1'):
        roots_on(bald, Scalp(array="none"))
    broken = replace(plain, arrays={"nan": np.full(len(plain.skin.points), np.nan, np.float32)})
    with pytest.raises(InputError, match='"nan" is not finite'):
        roots_on(broken, Scalp(array="nan"))


def test_a_scalp_is_told_in_one_way() -> None:
    with pytest.raises(ValueError, match="found array and map"):
        Scalp(array="a", map="b.png")
    with pytest.raises(ValueError, match="points nowhere"):
        Plane(point=(0.0, 0.0, 0.0), normal=(0.0, 0.0, 0.0))


def test_camera_and_pivot_follow_the_head(
    plain: Head, copy: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What is not told stands where it does on the built-in head; what is told stays."""
    monkeypatch.setattr(stage, "make_head", lambda _: plain)
    config = on_copy(copy, shipped("default", strands=50, guides=10, points=8).groom)
    stage.execute(config, cache.Experiment(tmp_path), "groom")
    with cache.open(tmp_path / "groom.h5", "groom") as groom:
        head = placement(groom)
    view, told = (
        CameraPath.of(camera, head).at(0.0) for camera in (Camera(), Camera(position=(1.0, 2.0, 3.0)))
    )
    pose = head_motion(Motion(preset="turn", amplitude=0.5), head=head).pieces[0](1.0)
    pivot = np.append(plain.to_world(np.array([0.0, -0.05, -0.015])), 1)
    print(
        f"camera at {view.position}, looks at {view.look_at}; pivot moves {np.abs(pose @ pivot - pivot).max():.1e} m"
    )
    assert view.position == pytest.approx(plain.to_world(np.array([0.40, 0.02, 0.80])))
    assert told.position.tolist() == [1, 2, 3]
    assert told.look_at == pytest.approx(view.look_at)
    assert np.abs(pose @ pivot - pivot).max() < 1e-12
    assert np.abs(pose - np.eye(4)).max() > 0.1
