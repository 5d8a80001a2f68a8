"""The mannequin: a closed, mirrored skin of a head's size, and a distance grid that agrees with its formula."""

import numpy as np
from numpy.typing import NDArray

from pipeline.config.schema import Config, Contact, Groom, Scene, Simulate
from pipeline.groom.head import distance, scalp
from pipeline.groom.heads import Head, Skin, make_head


def volume(skin: Skin) -> float:
    p = skin.points.astype(np.float64)[skin.triangles]
    return float(np.einsum("ij,ij->", p[:, 0], np.cross(p[:, 1], p[:, 2])) / 6)


def edges(triangles: NDArray[np.int32]) -> NDArray[np.int32]:
    return np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])


def test_every_edge_joins_two_triangles_of_opposite_direction(mannequin: Head) -> None:
    directed = edges(mannequin.skin.triangles)
    unique, count = np.unique(np.sort(directed, axis=1), axis=0, return_counts=True)
    used = np.unique(mannequin.skin.triangles)
    euler = len(used) - len(unique) + len(mannequin.skin.triangles)
    print(
        f"{len(mannequin.skin.triangles)} triangles, edges with two: {(count == 2).sum()} of {len(unique)}, V-E+F {euler}"
    )
    assert (count == 2).all()
    assert len(np.unique(directed, axis=0)) == len(directed)
    assert euler == 2


def test_the_head_is_its_own_mirror_image(mannequin: Head) -> None:
    p = np.random.default_rng(1).uniform([-0.12, -0.25, -0.12], [0.12, 0.14, 0.12], (4000, 3))
    formula = np.abs(distance.distance(p) - distance.distance(p * [-1, 1, 1])).max()
    grid = np.abs(mannequin.field.distance(p) - mannequin.field.distance(p * [-1, 1, 1])).max()
    mesh = np.abs(distance.distance(mannequin.skin.points * np.float32([-1, 1, 1]))).max()
    print(f"left against right: formula {formula:.1e} m, grid {grid:.1e} m, mesh {mesh:.1e} m")
    assert formula < 1e-12
    # A cell, deep inside, where the grid is swept; two different meshes could not be nearer there
    assert grid < 3e-3
    assert mesh < 2e-4


def test_the_head_has_the_size_of_a_head(mannequin: Head) -> None:
    """Breadth and circumference within two standard deviations of adults (ANSUR II, 2012: breadth 152 +- 6 mm)."""
    top = mannequin.skin.points[mannequin.skin.points[:, 1] > 0.06]
    breadth, depth = np.ptp(top[:, 0]), np.ptp(top[:, 2])
    litres = 1000 * volume(mannequin.skin)
    print(
        f"skull {1000 * breadth:.0f} mm wide, {1000 * depth:.0f} mm deep; {litres:.1f} l with neck and bust"
    )
    assert 0.138 < breadth < 0.168
    assert 0.17 < depth < 0.22
    assert 4 < litres < 12


def test_points_and_normals_of_the_skin_are_those_of_the_formula(mannequin: Head) -> None:
    skin = mannequin.skin
    off = np.abs(distance.distance(skin.points.astype(np.float64)))
    p = skin.points.astype(np.float64)[skin.triangles]
    facing = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
    outwards = np.einsum("ij,ij->i", facing, skin.normals[skin.triangles].mean(axis=1)) > 0
    print(f"off the surface: worst {1e6 * off.max():.1f} um; triangles facing inwards: {(~outwards).sum()}")
    assert off.max() < 1.5e-4
    assert np.quantile(off, 0.99) < 5e-5
    assert outwards.mean() > 0.9995
    assert np.abs(np.linalg.norm(skin.normals, axis=1) - 1).max() < 1e-5
    assert skin.albedo.min() >= 0
    assert skin.albedo.max() <= 1


def test_the_grid_tells_the_distance_to_the_skin(mannequin: Head) -> None:
    """At points off the mesh along its normals by known amounts, and everywhere with the right sign."""
    skin = mannequin.skin
    chosen = np.arange(0, len(skin.points), 7)
    convex = (
        np.abs(distance.distance((skin.points + 0.004 * skin.normals)[chosen].astype(np.float64)) - 0.004)
        < 1e-4
    )
    for away in (-0.001, 0.0, 0.001, 0.004):
        p = (skin.points + away * skin.normals)[chosen][convex].astype(np.float64)
        error = np.abs(mannequin.field.distance(p) - away)
        print(
            f"{1000 * away:+.0f} mm: worst {1000 * error.max():.2f} mm, 99 % {1000 * np.quantile(error, 0.99):.2f} mm"
        )
        assert np.quantile(error, 0.99) < 3e-4
    p = np.random.default_rng(2).uniform([-0.16, -0.27, -0.14], [0.16, 0.14, 0.13], (30_000, 3))
    d = distance.distance(p)
    clear = np.abs(d) > 1e-3
    wrong = np.sign(mannequin.field.distance(p[clear])) != np.sign(d[clear])
    print(f"wrong signs: {wrong.sum()} of {clear.sum()}")
    assert not wrong.any()


def test_the_grid_is_a_distance_everywhere(mannequin: Head) -> None:
    """From node to node it changes by no more than the way between them; a little more on the skeleton inside."""
    values, spacing = mannequin.field.values, mannequin.field.spacing
    steps = np.concatenate([np.abs(np.diff(values, axis=k)).ravel() for k in range(3)]) / spacing
    print(f"steepest edge {steps.max():.2f}; steeper than 1.05: {100 * (steps > 1.05).mean():.2f} %")
    assert steps.max() < 1.5
    assert (steps > 1.05).mean() < 0.005


def test_density_is_zero_on_the_face_and_one_on_the_crown() -> None:
    p = np.array([[0, 0.13, -0.02], [0, -0.02, 0.10], [0.05, 0.0, 0.08], [0, -0.15, 0.05]])
    found = scalp.density(p)
    print(f"crown {found[0]:.2f}, nose {found[1]:.2f}, cheek {found[2]:.2f}, throat {found[3]:.2f}")
    assert found[0] == 1
    assert (found[1:] == 0).all()


def test_there_is_no_head_when_none_is_wanted() -> None:
    config = Config(name="none", scene=Scene(head="none"), groom=Groom(source="swatch"))
    assert make_head(config) is None


def test_stubble_darkens_the_scalp_of_procedural_hair_only(mannequin: Head) -> None:
    bald = make_head(
        Config(name="bald", groom=Groom(source="swatch"), simulate=Simulate(contact=Contact(spacing=0.01)))
    )
    assert bald is not None
    crown = mannequin.skin.points[:, 1] > 0.11
    chin = (np.abs(mannequin.skin.points[:, 1] + 0.06) < 0.02) & (mannequin.skin.points[:, 2] > 0.08)
    ratio = mannequin.skin.albedo / bald.skin.albedo
    print(f"scalp at {ratio[crown].mean():.2f} of its colour, chin at {ratio[chin].mean():.2f}")
    assert ratio[crown].mean() < 0.5
    assert ratio[chin].mean() > 0.999
