"""Distance to a mesh: exact near it, signed, the same for any number of threads; feet and how far they move."""

import numpy as np
import pytest
from numpy.typing import NDArray

from pipeline import kernels

SPACING, SHAPE, ORIGIN = 0.01, (25, 25, 25), np.full(3, -0.12)
FACES = np.array(
    [[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2], [1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]], np.int32
)
CORNERS = 0.08 * np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [-1, 0, 0], [0, -1, 0], [0, 0, -1]], np.float64)


def octahedron() -> kernels.MeshDistance:
    return kernels.MeshDistance(CORNERS, FACES, ORIGIN, SPACING, SHAPE)


def nodes() -> NDArray[np.float64]:
    axis = ORIGIN[0] + SPACING * np.arange(25)
    return np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1)


def test_the_distance_is_exact_inside_and_near_the_faces() -> None:
    values = octahedron().values
    planes = (np.abs(nodes()).sum(axis=-1) - 0.08) / np.sqrt(3)  # below all planes is inside
    near = (np.abs(planes) < 2 * SPACING) & (planes < 0)
    error = np.abs(values - planes)[near].max()
    wrong = int((np.sign(values) != np.sign(planes))[np.abs(planes) > 1e-9].sum())
    print(f"off by {error:.1e} m inside near the surface, {wrong} wrong signs")
    assert error < 1e-7
    assert wrong == 0
    assert (values >= planes - 1e-6)[planes > 0].all()


def test_it_does_not_depend_on_the_number_of_threads() -> None:
    found = []
    for threads in (1, 2):
        kernels.set_threads(threads)
        found.append(octahedron().values.tobytes())
    assert found[0] == found[1]


def test_feet_and_their_drift_follow_a_mesh_that_turns_and_grows() -> None:
    mesh = octahedron()
    growth = 1.1 * CORNERS[:, [1, 2, 0]]
    points = np.random.default_rng(2).uniform(-0.05, 0.05, (200, 3))
    triangle, weight = mesh.feet(points)
    feet = np.einsum("nk,nkx->nx", weight, CORNERS[FACES[triangle]])
    expected = np.abs((np.abs(points).sum(axis=1) - 0.08) / np.sqrt(3))
    inside = np.abs(points).sum(axis=1) < 0.08
    error = np.abs(np.linalg.norm(points - feet, axis=1) - expected)[inside].max()
    drift = mesh.drift(growth)
    largest = np.linalg.norm(drift, axis=0).max()
    print(f"feet of points inside off by {error:.1e} m; drift up to {largest:.4f} m")
    assert error < 1e-6
    assert largest <= np.linalg.norm(growth - CORNERS, axis=1).max() + 1e-6
    way = np.array([0.01, 0.0, -0.02])
    assert np.abs(mesh.drift(CORNERS + way) - way[:, None, None, None]).max() < 1e-7


def test_meshes_that_do_not_fit_are_refused() -> None:
    for points, faces, message in (
        (CORNERS, FACES + 1, "names no point"),
        (CORNERS * np.nan, FACES, "not finite"),
        (CORNERS + 1e9, FACES, "outside the grid"),
        (CORNERS, FACES[:0], "expected triangles"),
    ):
        with pytest.raises(ValueError, match=message):
            kernels.MeshDistance(points, faces, ORIGIN, SPACING, SHAPE)
