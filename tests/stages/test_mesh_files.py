"""PLY and OFF files: every way of writing a mesh is the same mesh, and one that does not hold up is refused."""

import struct
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from pipeline.errors import InputError
from pipeline.groom.head_mesh import load_mesh
from pipeline.groom.off import read_off
from pipeline.groom.ply import read_ply

POINTS = [(x, y, z) for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.5)]
QUADS = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
MIXED = [QUADS[0], *[(q[0], q[k], q[k + 1]) for q in QUADS[1:4] for k in (1, 2)], *QUADS[4:]]
RED = [10 * i for i in range(8)]
HEADER = (
    "ply\nformat {kind} 1.0\ncomment a box\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\n"
    "property uchar red\nproperty float mask\nelement edge {edges}\nproperty int a\n"
    "element face {faces}\nproperty list uchar int vertex_indices\nproperty short part\nend_header\n"
)


def box(kind: str, faces: list[tuple[int, ...]]) -> bytes:
    """A box with a colour and numbers on its points, and numbers that are nobody's."""
    header = HEADER.format(kind=kind, edges=2, faces=len(faces)).encode()
    rows = [(*p, red, 0.5 * p[0]) for p, red in zip(POINTS, RED, strict=True)]
    if kind == "ascii":
        lines = [*rows, (3,), (4,), *((len(f), *f, 7) for f in faces)]
        return header + "".join(" ".join(map(str, line)) + "\n" for line in lines).encode()
    order = "<" if "little" in kind else ">"
    body = b"".join(struct.pack(f"{order}3fBf", *row) for row in rows) + struct.pack(f"{order}2i", 3, 4)
    return header + body + b"".join(struct.pack(f"{order}B{len(f)}ih", len(f), *f, 7) for f in faces)


def volume(points: NDArray[np.float32], triangles: NDArray[np.int32]) -> float:
    p = points.astype(np.float64)[triangles]
    return float(np.einsum("ij,ij->", p[:, 0], np.cross(p[:, 1], p[:, 2])) / 6)


@pytest.mark.parametrize("faces", [QUADS, MIXED])
@pytest.mark.parametrize("kind", ["ascii", "binary_little_endian", "binary_big_endian"])
def test_a_ply_file_is_the_same_head_however_it_is_written(
    tmp_path: Path, kind: str, faces: list[tuple[int, ...]]
) -> None:
    (tmp_path / "box.ply").write_bytes(box(kind, faces))
    mesh = load_mesh(tmp_path / "box.ply")
    print(f"{len(mesh.triangles)} triangles, volume {volume(mesh.points, mesh.triangles):.6f}")
    assert len(mesh.triangles) == 12
    assert volume(mesh.points, mesh.triangles) == pytest.approx(1.5)
    assert np.allclose(mesh.arrays["mask"], mesh.points[:, 0] / 2)
    order = np.lexsort(mesh.points.T[::-1])
    assert np.allclose(mesh.arrays["red"][order], np.array(RED) / 255)


def test_texture_coordinates_of_corners_split_the_points_of_seams(tmp_path: Path) -> None:
    """Two triangles share an edge, whose ends have other coordinates in the second."""
    text = (
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
        "element face 2\nproperty list uchar int vertex_indices\nproperty list uchar float texcoord\nend_header\n"
        "0 0 0\n1 0 0\n0 1 0\n1 1 0\n3 0 1 2 6 0 0 .5 0 0 .5\n3 1 3 2 6 1 0 1 1 0 .5\n"
    )
    (tmp_path / "seam.ply").write_text(text)
    ply = read_ply(tmp_path / "seam.ply")
    assert ply.uv is not None
    corners = np.concatenate([np.column_stack([ply.points[p], ply.uv[p]]) for p in ply.polygons[0]])
    print(f"{len(ply.points)} points of 4")
    assert len(ply.points) == 5  # (0, 1, 0) has the same coordinates on both sides
    assert corners.tolist() == [
        [0, 0, 0, 0, 0],
        [1, 0, 0, 0.5, 0],
        [0, 1, 0, 0, 0.5],
        [1, 0, 0, 1, 0],
        [1, 1, 0, 1, 1],
        [0, 1, 0, 0, 0.5],
    ]


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("element vertex 8", "element vertex 4000000000"),
        ("element face 6", "element face 99999999999"),
        ("element vertex 8", "element vertex -8"),
        ("property float y", "property list uchar float y"),
        ("property float y", "property float x"),
        ("format ascii", "format binary_little_endian"),
        ("uchar int vertex_indices", "uchar int other"),
        ("end_header", "end_heade"),
        ("4 0 1 3 2", "400000000 0 1 3 2"),
        ("4 0 1 3 2", "nan 0 1 3 2"),
        ("4 0 1 3 2", "-4 0 1 3 2"),
        ("4 0 1 3 2", "4 0 1 3 1e30"),
        ("4 0 1 3 2", "four"),
        ("10 0.0", "1000 0.0"),
    ],
)
def test_a_ply_file_that_does_not_hold_up_is_refused(tmp_path: Path, old: str, new: str) -> None:
    text = box("ascii", QUADS).decode()
    assert old in text
    (tmp_path / "bad.ply").write_text(text.replace(old, new, 1))
    with pytest.raises(ValueError, match=r"\w") as error:
        read_ply(tmp_path / "bad.ply")
    print(error.value)
    with pytest.raises(InputError, match=r"bad\.ply"):
        load_mesh(tmp_path / "bad.ply")


def off(faces: list[tuple[int, ...]]) -> str:
    lines = [" ".join(map(str, p)) for p in POINTS] + [" ".join(map(str, (len(f), *f))) for f in faces]
    return f"OFF # a box\n8 {len(faces)} 0\n\n" + "\n".join(lines) + "\n"


@pytest.mark.parametrize("faces", [QUADS, MIXED])
def test_an_off_file_is_the_same_head(tmp_path: Path, faces: list[tuple[int, ...]]) -> None:
    (tmp_path / "box.off").write_text(off(faces))
    mesh = load_mesh(tmp_path / "box.off")
    print(f"{len(mesh.triangles)} triangles, volume {volume(mesh.points, mesh.triangles):.6f}")
    assert len(mesh.triangles) == 12
    assert volume(mesh.points, mesh.triangles) == pytest.approx(1.5)


@pytest.mark.parametrize(
    ("old", "new"),
    [("8 6 0", "9999999999999 6 0"), ("8 6 0", "8 7 0"), ("8 6 0", "8"), ("4 0 1 3 2", "5 0 1 3 2"),
     ("4 0 1 3 2", "-1"), ("4 0 1 3 2", "4 0 1 3 9999999999999999999999"), ("0.0 0.0 0.0", "0.0 0.0"), ("OFF", "FOO")],
)  # fmt: skip
def test_an_off_file_that_does_not_hold_up_is_refused(tmp_path: Path, old: str, new: str) -> None:
    assert old in off(QUADS)
    (tmp_path / "bad.off").write_text(off(QUADS).replace(old, new, 1))
    with pytest.raises(ValueError, match=r"\w") as error:
        read_off(tmp_path / "bad.off")
    print(error.value)


def test_numbers_that_are_not_one_for_each_point_are_passed_over(tmp_path: Path) -> None:
    """An OBJ file with fewer normals than points: VTK hands on an array that is too short."""
    lines = [f"v {x} {y} {z}" for x, y, z in POINTS] + ["vn 0 0 1"] * 8
    lines += ["f " + " ".join(f"{i + 1}//{i + 1}" for i in q) for q in QUADS]
    lines[8:12] = ["v 0.5 0.5 0.5"] * 4  # in place of normals
    (tmp_path / "box.obj").write_text("\n".join(lines) + "\n")
    mesh = load_mesh(tmp_path / "box.obj")
    print({name: len(values) for name, values in mesh.arrays.items()})
    assert len(mesh.points) == 8
    assert all(len(values) == 8 for values in mesh.arrays.values())
