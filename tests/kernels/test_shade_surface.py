"""Light on the head: Lambert, its own shadow, the shadow of hair; and one frame of `Lighting` as a whole."""

import numpy as np
import pytest
from numpy.typing import NDArray

from pipeline import kernels
from pipeline.body.normals import point_curvature
from pipeline.config.schema import Fibre, Light, Scene
from pipeline.render.lighting import Lighting

_F32 = NDArray[np.float32]
_F64 = NDArray[np.float64]

RADIUS = 0.09
EYE = np.array([0.0, 0.1, 0.9])
NOWHERE = np.eye(4)


def sphere() -> kernels.DistanceField:
    n, h = 81, 3e-3
    x = (np.stack(np.meshgrid(*[np.arange(n)] * 3, indexing="ij"), axis=-1) - n // 2) * h
    return kernels.DistanceField(
        (np.linalg.norm(x, axis=-1) - RADIUS).astype(np.float32), np.full(3, -(n // 2) * h), h
    )


def directions(count: int) -> _F64:
    i = np.arange(count) + 0.5
    z, turn = 1 - 2 * i / count, i * np.pi * (3 - np.sqrt(5))
    return np.stack([np.sqrt(1 - z**2) * np.cos(turn), z, np.sqrt(1 - z**2) * np.sin(turn)], axis=-1)


def fur(count: int, length: float, lowest: float = 0.0) -> tuple[_F32, _F32]:
    """Strands that stand on the sphere's cap above this height, 0.2 mm wide."""
    out = directions(2 * count)
    out = out[out[:, 1] > lowest]
    points = out[:, None] * (RADIUS + length * np.linspace(0, 1, 8))[:, None]
    return points.astype(np.float32), np.full(points.shape[:2], 2e-4, np.float32)


def lit(
    scene: Scene, hair: tuple[_F32, _F32], head: kernels.DistanceField | None, **fibre: object
) -> Lighting:
    lighting = Lighting(scene, Fibre.model_validate({"glints": False} | fibre), 64)
    points, widths = hair
    lighting.begin(points.min((0, 1)).astype(float), points.max((0, 1)).astype(float), 2e-4)
    lighting.add(points, widths)
    lighting.finish(head, NOWHERE)
    return lighting


def skin(lighting: Lighting, normals: _F64, albedo: float = 0.5) -> _F32:
    n = normals.astype(np.float32)
    return lighting.shade_surface(n * np.float32(RADIUS), n, np.full_like(n, albedo), EYE)


SUN = Scene(lights=(Light(direction=(0, 1, 0), irradiance=2.0),), environment=(0, 0, 0))
SKY = Scene(lights=(), environment=(1, 1, 1))
ONE_HAIR = fur(1, 0.02)


def test_bare_head_is_lambertian_and_dark_on_the_far_side() -> None:
    normals = directions(4000)
    shaded = skin(lit(SUN, ONE_HAIR, sphere()), normals, 0.5)[:, 0]
    lambert = 0.5 * 2.0 / np.pi * np.maximum(normals[:, 1], 0)
    bright = (normals[:, 1] > 0.3) & (normals[:, 2] < 0)
    error = np.abs(shaded[bright] / lambert[bright] - 1).max()
    print(f"Lambert within {error:.1e} (sheen included, away from the eye)")
    assert error < 0.05
    assert shaded[normals[:, 1] < 0].max() == 0
    assert (shaded >= 0).all()


@pytest.mark.parametrize("radius", [0.1, 0.02, 0.01])
def test_light_goes_round_a_curve_as_the_profile_blurs_it_on_a_ring(radius: float) -> None:
    """Against the integral over the ring of the cosine and the Gaussians of Gems 3 (variances in mm^2)."""
    variance = np.array([0.0064, 0.0484, 0.187, 0.567, 1.99, 7.41])
    weight = np.array(
        [
            [0.233, 0.455, 0.649],
            [0.100, 0.336, 0.344],
            [0.118, 0.198, 0.0],
            [0.113, 0.007, 0.007],
            [0.358, 0.004, 0.0],
            [0.078, 0.0, 0.0],
        ]
    )
    angle = np.linspace(0, np.pi, 181)
    normals = np.stack([np.sin(angle), np.cos(angle), 0 * angle], axis=-1).astype(np.float32)
    curvature = np.full(len(angle), 1 / radius, np.float32)
    lighting = lit(SUN, ONE_HAIR, None)
    far = (normals * np.float32(10), normals)  # far from the hair
    shaded, gloss = (
        lighting.shade_surface(*far, np.full_like(normals, albedo), EYE, curvature) for albedo in (1.0, 0.0)
    )
    x = np.linspace(-1.2, 1.2, 4801)
    blurred = np.zeros((len(angle), 3))
    for v, w in zip(variance, weight, strict=True):
        profile = np.exp(-0.5 * (x * radius * 1e3) ** 2 / v)
        mean = np.maximum(np.cos(angle[:, None] + x), 0) @ (profile / profile.sum())
        blurred += mean[:, None] * w
    error = np.abs((shaded - gloss) - 2.0 / np.pi * blurred).max(axis=0)
    beyond = (shaded - gloss)[100] / (2.0 / np.pi)
    print(f"radius {1e3 * radius:.0f} mm: off by {error}; ten degrees beyond the terminator {beyond}")
    assert error.max() < 2e-3
    assert beyond[0] >= beyond[1] >= beyond[2]
    if radius < 0.05:
        assert beyond[0] > 5e-4


def test_the_gloss_of_skin_reflects_a_few_per_cent_and_more_at_grazing_angles() -> None:
    """Albedo of the gloss: its integral over directions of the eye, from light at 0, 60 and 80 degrees."""
    out = directions(4000)
    out = out[out[:, 1] > 0]
    albedo = []
    for slant in np.radians([0.0, 60.0, 80.0]):
        light = Light(direction=(float(np.sin(slant)), float(np.cos(slant)), 0), irradiance=1.0)
        lighting = lit(Scene(lights=(light,), environment=(0, 0, 0)), ONE_HAIR, None)
        up = np.array([[0, 1, 0]], np.float32)
        seen = [lighting.shade_surface(up * 9, up, 0 * up, up[0] * 9.0 + 5.0 * eye)[0, 0] for eye in out[::4]]
        radiosity = 2 * np.pi * np.mean(np.array(seen) * out[::4, 1])
        albedo.append(radiosity / np.cos(slant))
    print(f"gloss at 0, 60, 80 degrees: {albedo}")
    assert 0.02 < albedo[0] < 0.04
    assert albedo[0] < albedo[1] < albedo[2] < 1


def test_curvature_of_a_sphere_is_one_over_its_radius() -> None:
    import pyvista as pv

    mesh = pv.Icosphere(radius=0.05, nsub=3)
    points = np.asarray(mesh.points)
    found = point_curvature(points, points / 0.05, mesh.regular_faces)
    print(f"curvature {found.min():.3f} to {found.max():.3f}, expected 20")
    assert np.allclose(found, 20, rtol=1e-3)


def test_head_shadows_itself_beyond_its_own_normals() -> None:
    """A small sphere above another: light from above cannot reach the lower one's pole."""
    n, h = 81, 4e-3
    x = (np.stack(np.meshgrid(*[np.arange(n)] * 3, indexing="ij"), axis=-1) - n // 2) * h
    two = np.minimum(np.linalg.norm(x, axis=-1) - 0.05, np.linalg.norm(x - [0, 0.12, 0], axis=-1) - 0.03)
    field = kernels.DistanceField(two.astype(np.float32), np.full(3, -(n // 2) * h), h)
    lighting = lit(SUN, ONE_HAIR, field)
    points = np.array([[0, 0.05, 0], [0.048, 0.014, 0]], np.float32)
    shaded = lighting.shade_surface(points, points / np.float32(0.05), np.ones_like(points), EYE)
    assert shaded[0].max() < 1e-3
    assert shaded[1, 0] > 0.9 * 2.0 / np.pi * 0.28


def test_skin_between_roots_has_less_gloss_than_light() -> None:
    """What strands have scattered is light, but no gloss: albedo 0 leaves the gloss alone."""
    top = np.array([[0.0, 1.0, 0.0], [0.1, 0.995, 0.0]])
    normals = top / np.linalg.norm(top, axis=1, keepdims=True)
    behind = Scene(lights=(Light(direction=(0, 1, -1)),), environment=(0, 0, 0))
    bare, furry = lit(behind, ONE_HAIR, sphere()), lit(behind, fur(8000, 0.03), sphere())
    gloss = (skin(furry, normals, 0.0) / skin(bare, normals, 0.0)).mean(0)
    light = (skin(furry, normals) / skin(bare, normals)).mean(0)
    print(f"under hair: gloss {gloss}, light {light} of what bare skin has")
    assert (gloss < 0.6 * light).all()
    assert np.ptp(gloss) < 1e-3 * gloss.mean()  # a mirror has no colour


def test_hair_shadows_the_skin_by_its_loss() -> None:
    top = np.array([[0.0, 1.0, 0.0], [0.1, 0.995, 0.0]])
    normals = top / np.linalg.norm(top, axis=1, keepdims=True)
    slanted = Scene(lights=(Light(direction=(1, 1, 0)),), environment=(0, 0, 0))
    bare, dense = lit(slanted, ONE_HAIR, sphere()), lit(slanted, fur(20_000, 0.03), sphere())
    through = skin(dense, normals) / skin(bare, normals)
    print("light on the skin under brown hair", through[0])
    assert (through < 0.65).all()
    assert (np.diff(through, axis=1) < 0).all(), "brown hair takes more blue than red"


def band(height: float) -> tuple[_F32, _F32]:
    """Strands side by side over a strip of 2 cm, as high above y = 0, one on the way of light in the mean."""
    z = (np.arange(200) + 0.5) * 1e-4 - 0.01
    x = np.linspace(-0.2, 0.2, 64)
    points = np.stack(np.broadcast_arrays(x, height + 0.0005 * (z[:, None] * 3e4 % 2), z[:, None]), axis=-1)
    return points.astype(np.float32), np.full(points.shape[:2], 1e-4, np.float32)


def test_light_that_a_lock_scatters_reaches_the_skin_as_little_as_the_lock_is_seen_from_there() -> None:
    """From a distance of five widths a lock fills a quarter of the cone that its light comes from, from fifty none."""
    z = np.linspace(-0.004, 0.004, 33)
    points = np.stack([0 * z, 0 * z, z], axis=-1).astype(np.float32)
    up = np.tile(np.float32([0, 1, 0]), (len(z), 1))
    part = {}
    for height in (0.004, 0.1, 1.0):
        lighting = lit(SUN, band(height), None, melanin=0.3)
        seen = [
            lighting.shade_surface(points, up, albedo * np.ones_like(points), EYE) for albedo in (1.0, 0.0)
        ]
        part[height] = (seen[0] - seen[1]).mean(0) / (2.0 / np.pi)
    near, far = part[0.004] - part[1.0], part[0.1] - part[1.0]
    print(f"scattered light under the lock {near}, 10 cm below {far}; {part[1.0]} goes straight past")
    assert (part[1.0] < 0.4).all()
    assert near[0] > 0.3
    assert (far > 0.1 * near).all()
    assert (far < 0.4 * near).all()


def test_skin_under_open_sky_shows_its_albedo() -> None:
    shaded = skin(lit(SKY, ONE_HAIR, sphere()), directions(500), 0.4)
    print(f"under the sky {shaded.mean():.3f} of 0.4")
    assert shaded.max() <= 0.4 + 1e-6
    assert shaded.mean() > 0.3


def all_of(lighting: Lighting, points: NDArray[np.float32]) -> NDArray[np.float32]:
    """Linear RGB (S, P, 3) of all points of strands (S, P, 3)."""
    strands, count, _ = points.shape
    which = np.arange(strands * count, dtype=np.uint32)
    usual, key = np.tile(np.float32([0.5, 1, 0]), (strands, 1)), np.arange(strands, dtype=np.uint32)
    return lighting.shade(points, usual, key, EYE, which).reshape(points.shape)


def test_hair_in_the_heads_shadow_is_dark() -> None:
    points, widths = fur(4000, 0.03, lowest=0.8)
    both = np.concatenate([points, points * np.array([1, -1, 1], np.float32)])
    lighting = lit(SUN, (both, np.concatenate([widths, widths])), sphere(), melanin=0.4)
    shaded = all_of(lighting, both)
    upper, lower = shaded[: len(points)].mean(), shaded[len(points) :].mean()
    print(f"lit {upper:.4f}, in the head's shadow {lower:.5f}")
    assert lower < 0.1 * upper


def test_white_hair_in_a_white_sky_disappears() -> None:
    points, widths = fur(3000, 0.03)
    lighting = lit(SKY, (points, widths), None, melanin=0.0, melanin_jitter=0.0)
    shaded = all_of(lighting, points)
    error = np.abs(shaded - 1).max()
    print(f"furnace: {error:.1e}")
    assert error < 1e-4


def test_more_and_thinner_strands_look_the_same() -> None:
    few, many = fur(2000, 0.03), fur(8000, 0.03)
    means = []
    for points, width in ((few[0], 4e-4), (many[0], 1e-4)):
        lighting = lit(SUN, (points, np.full(points.shape[:2], width, np.float32)), sphere(), melanin=0.5)
        means.append(all_of(lighting, points).mean((0, 1)))
    print("few wide / many thin", means[0] / means[1])
    assert means[0] / means[1] == pytest.approx(1, abs=0.03)


def test_a_frame_is_finished_before_it_is_shaded() -> None:
    lighting = Lighting(SUN, Fibre(), 64)
    with pytest.raises(ValueError, match="begin"):
        lighting.add(*ONE_HAIR)
    with pytest.raises(ValueError, match="finish"):
        all_of(lighting, ONE_HAIR[0])
    with pytest.raises(ValueError, match="bounds"):
        lighting.begin(np.full(3, np.inf), np.full(3, -np.inf), 1e-4)
