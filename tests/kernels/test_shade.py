"""The shading kernel against its formula in numpy, and the laws of light."""

import itertools
from dataclasses import dataclass

import numpy as np
import pytest
from numpy.typing import NDArray
from own_colours import own_colours
from scipy.integrate import solve_bvp
from scipy.special import ive

from pipeline import kernels
from pipeline.render import fibre

_F32 = NDArray[np.float32]
_F64 = NDArray[np.float64]

SCATTERING = fibre.Scattering(0.3, 0.3, np.radians(2))
FAR = 1e4


@dataclass(frozen=True)
class Room:
    """The same everywhere: strands towards the light and behind, whether the head is before it, and a normal."""

    n: float = 0.0
    behind: float = 0.0
    dark: bool = False
    sky: float = 0.0
    normal: tuple[float, float, float] = (0.0, 1.0, 0.0)

    def light(self, directions: _F64, irradiance: float = 1.0, glints: bool = False) -> kernels.Illumination:
        """These depths for lights in these directions (L, 3)."""
        corner, n = np.ones(3), 4
        shadows = kernels.Shadows(directions.astype(np.float32))
        shadows.begin(-corner, corner, 0.5, 1e-9)
        shadows.finish(np.zeros((1, 1, 1), np.float32), corner, 1.0, None, np.eye(4))
        for index in range(len(directions)):
            surface, layers, solid = shadows.map(index)
            # Far behind the first strand no ray to the eye shares strands with the one to the light
            surface[..., 0], surface[..., 1] = -1e6, self.n + self.behind
            layers[...], solid[...] = np.float16(32 * self.n).view(np.uint16), -1e9 if self.dark else 1e9
        around = np.zeros((n // 2, n // 2, n // 2, 16), np.float32)
        around[..., :3], around[..., 4:7] = 1, self.normal
        light = kernels.Illumination(
            directions.astype(np.float32),
            np.full((len(directions), 3), irradiance, np.float32),
            np.full(3, self.sky, np.float32),
            shadows,
            around,
            np.ones((n // 2, n // 2, n // 2, 4), np.float32),
        )
        light.glints = glints
        return light


def unit(vectors: _F64) -> _F64:
    scaled: _F64 = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
    return scaled


def spread(count: int) -> _F64:
    i = np.arange(count) + 0.5
    z, turn = 1 - 2 * i / count, i * np.pi * (3 - np.sqrt(5))
    return np.stack([np.sqrt(1 - z**2) * np.cos(turn), np.sqrt(1 - z**2) * np.sin(turn), z], axis=-1)


def radiance(
    tangents: _F64, eye: _F64, light: kernels.Illumination, sigma: float, rough: float = 0.3
) -> _F32:
    """Radiance (S, 3) of one point each on short strands with these tangents (S, 3), seen from a direction."""
    points = np.stack([-tangents, tangents], axis=1).astype(np.float32) * np.float32(1e-3)
    pigment, usual = own_colours(np.full((2, 3), sigma, np.float32))
    usual[:, 1] = fibre.variance(rough) / fibre.variance(0.3)
    variation = usual[np.zeros(len(tangents), int)]
    key = np.arange(len(tangents), dtype=np.uint32)
    return kernels.shade(points, variation, key, FAR * eye, light, SCATTERING.tables(pigment)).reshape(
        *points.shape
    )[:, 0]


def along(sine_i: _F64, sine_o: _F64, v: float | _F64) -> _F64:
    """M (d'Eon et al. 2011), with scipy's Bessel function."""
    a = np.sqrt((1 - sine_i**2) * (1 - sine_o**2)) / v
    M: _F64 = ive(0, a) * np.exp(a - (1 + sine_i * sine_o) / v) / (v * -np.expm1(-2 / v))
    return M


def formula(tangents: _F64, eye: _F64, L: _F64, sigma: float, room: Room, rough: float = 0.3) -> _F64:
    """Radiance (S,) by the closed form, without tables; sigma is one channel, which also stands for green."""
    v, tilt = fibre.variances(rough), np.radians(2) * np.array([2, -1, -4, 0])
    si, so = tangents @ L, tangents @ eye
    theta = np.abs(np.arcsin(so))
    phi = np.arccos(np.clip((eye @ L - so * si) / np.sqrt((1 - so**2) * (1 - si**2)), -1, 1))
    result = np.empty(len(tangents))
    for k in range(len(tangents)):
        angles = np.array([phi[k], np.pi - phi[k], 0, np.pi])
        N, G = (a[:, 0, 0] for a in fibre.far_field(np.cos(theta[k : k + 1]), angles, np.array([sigma]), 0.3))
        back, forward = np.pi * G[:, 2], np.pi * G[:, 3]
        a_f, a_b = forward.sum(), back.sum()
        v_f, v_b = (v @ forward) / a_f, (v @ back) / a_b
        g, n = 1 - a_f, room.n
        kappa = np.sqrt(max(g**2 - a_b**2, 1e-6))
        down, up = streams(a_f, a_b, *(_tabled(sigma, theta[k], i) for i in (2, 3)), n, room.behind)
        v_I = min(2, v_f * (n * a_f / -np.expm1(-n * a_f) if n else 1))
        v_J = min(2, v_b + 2 * v_f / (g + kappa))
        shifted = np.sin(np.arcsin(so[k]) + tilt)
        direct = sum(along(si[k], shifted[p], v[p]) * N[p, 0] for p in range(4))
        scattered = sum(along(si[k], so[k], v[p] + v_I) * G[p, 0] for p in range(4))
        reflected = sum(along(si[k], so[k], v[p] + v_J) * G[p, 1] for p in range(4))
        c = max(0.2, float(np.dot(room.normal, L)))
        result[k] = np.exp(-n) * direct + down * scattered + c * up * reflected
    return result


def _tabled(sigma: float, theta: float, entry: int) -> float:
    """What the sums of the tables say of light at an inclination."""
    rows = [
        np.interp(theta, np.linspace(0, np.pi / 2, fibre.INCLINATIONS), row)
        for row in SCATTERING.sums[..., entry]
    ]
    return float(np.interp(np.sqrt(sigma), np.sqrt(SCATTERING.levels), rows))


def streams(a_f: float, a_b: float, s: float, m: float, n: float, behind: float) -> tuple[float, float]:
    """Fluence of light that goes down and up at depth n, by solving the two equations numerically."""

    def slope(x: _F64, y: _F64) -> _F64:
        direct, g = np.exp(-x), 1 - a_f - a_b + s
        return m * np.array([-g * y[0] + s * y[1] + a_f * direct, g * y[1] - s * y[0] - a_b * direct])

    depth = min(n + behind, 60.0)
    if n == 0 == behind:
        return 0.0, 0.0
    mesh = np.unique(np.concatenate([np.linspace(0, depth, 60), [n]]))
    found = solve_bvp(
        slope, lambda top, end: np.array([top[0], end[1]]), mesh, np.zeros((2, mesh.size)), tol=1e-7
    )
    down, up = found.sol(n)
    return float(down), float(up)


def random_tangents(count: int, seed: int) -> _F64:
    return unit(np.random.default_rng(seed).normal(size=(count, 3)))


@pytest.mark.parametrize("rough", [0.3, 0.5])
@pytest.mark.parametrize(
    "room", [Room(), Room(n=0.4, behind=2.0), Room(n=3.0, behind=0.5), Room(n=12.0, behind=20.0)]
)
def test_kernel_follows_the_two_flux_formula(room: Room, rough: float) -> None:
    """Also where a strand is rougher than the fibre of the tables."""
    eye, L = unit(np.array([0.3, 0.4, 0.9])), unit(np.array([-0.5, 0.7, 0.2]))
    tangents = random_tangents(100, 1)
    tangents = tangents[(np.abs(tangents @ eye) < 0.95) & (np.abs(tangents @ L) < 0.95)]
    for level in (2, 6, 12):
        sigma = float(SCATTERING.levels[level])
        shaded = radiance(tangents, eye, room.light(L[None]), sigma, rough)[:, 1].astype(np.float64)
        exact = formula(tangents, eye, L, sigma, room, rough)
        error = np.sqrt(np.mean((shaded - exact) ** 2)) / exact.mean()
        print(f"{room} roughness {rough} sigma {sigma:.2f}: rms {error:.1e} of the mean")
        # Alone on the way the narrow lobes show, whose peaks a bilinear table clips by one part in a hundred
        assert error < (6e-3 if room.n else 2e-2)


def test_absorption_between_levels_costs_little() -> None:
    eye, L = unit(np.array([0.3, 0.4, 0.9])), unit(np.array([-0.5, 0.7, 0.2]))
    tangents = random_tangents(60, 2)
    room = Room(n=0.5, behind=1.0)
    for sigma in (0.07, 0.389, 0.721, 1.639):
        shaded = radiance(tangents, eye, room.light(L[None]), sigma)[:, 1].astype(np.float64)
        exact = formula(tangents, eye, L, sigma, room)
        error = np.sqrt(np.mean((shaded - exact) ** 2)) / exact.mean()
        print(f"sigma {sigma}: {error:.1e}")
        assert error < 0.02


def test_white_furnace_returns_what_it_gets() -> None:
    """Light from everywhere on an unshadowed white fibre: it disappears."""
    count = 3000
    light = Room().light(spread(count), 4 * np.pi / count)
    for degrees, rough in itertools.product((0, 20, 40, 60), (0.3, 0.4)):
        theta = np.radians(degrees)
        tangent = np.array([[np.sin(theta), np.cos(theta), 0]])
        found = radiance(tangent, np.array([1.0, 0, 0]), light, 0.0, rough)[0, 0]
        print(f"theta_o {degrees}, roughness {rough}: {found:.4f}")
        # What is missing is what tables between their entries miss
        assert found == pytest.approx(1, abs=2e-3)


def test_behind_the_head_no_light_comes() -> None:
    lit, dark = (
        radiance(random_tangents(8, 6), np.array([0.0, 0, 1]), room.light(spread(3)), 0.3)
        for room in (Room(), Room(dark=True))
    )
    assert lit.min() > 0
    assert dark.max() == 0


def test_sky_alone_lights_a_fibre_with_its_albedo() -> None:
    shaded = radiance(
        random_tangents(8, 3), np.array([0.0, 0, 1]), Room(sky=2.0).light(np.zeros((0, 3))), 0.0
    )
    assert shaded == pytest.approx(2.0, abs=1e-5)


def test_swapping_light_and_eye_changes_nothing() -> None:
    flat = fibre.Scattering(0.3, 0.3, 0.0, reciprocal=True)
    tangents = random_tangents(300, 4)
    a, b = unit(np.array([0.2, 0.5, 0.8])), unit(np.array([-0.6, 0.3, 0.1]))
    points = np.stack([-tangents, tangents], axis=1).astype(np.float32) * np.float32(1e-3)
    pigment, variation = own_colours(np.full((300, 3), 0.3, np.float32))
    key = np.zeros(300, np.uint32)
    there, back = (
        kernels.shade(points, variation, key, FAR * eye, Room().light(L[None]), flat.tables(pigment))
        for eye, L in ((a, b), (b, a))
    )
    error = np.abs(there - back).max() / there.mean()
    print(f"reciprocity: {error:.1e}")
    assert error < 2e-3


def test_highlight_moves_to_the_tip_and_the_second_one_to_the_root() -> None:
    """The cuticle's scales turn R by -2 tilt and TRT by +4 tilt: theta_i + theta_o = -4 degrees for R."""
    L = np.array([0.0, 0, 1])
    theta_o = np.radians(np.linspace(-40, 40, 801))
    # Light across the fibre, eye at theta_o, on the light's side: black hair shows R alone
    tangents = np.stack([np.zeros_like(theta_o), np.cos(theta_o), np.sin(theta_o)], axis=-1)
    eye = np.array([0.0, 0, 1])
    shaded = radiance(tangents, eye, Room().light(L[None]), 8.0)[:, 0]
    # Here eye = light, so theta_i = theta_o = theta: R peaks at 2 theta = -4 degrees
    peak = np.degrees(theta_o[np.argmax(shaded)])
    print(f"R peaks at {peak:.1f} degrees")
    assert peak == pytest.approx(-2.0, abs=0.5)


def test_white_slab_returns_no_more_than_it_gets() -> None:
    """Exitance of a deep white layer of parallel fibres, lit along its normal: what is missing is the model's error."""
    nodes, weights = np.polynomial.laguerre.laggauss(12)
    lit = np.array([[0.0, 1, 0]])
    theta, wt = np.polynomial.legendre.leggauss(8)
    phi, wp = np.polynomial.legendre.leggauss(8)
    exitance = 0.0
    for t, a in zip(theta * np.pi / 2, wt * np.pi / 2, strict=True):
        for f, b in zip(phi * np.pi / 2, wp * np.pi / 2, strict=True):
            eye = np.array([np.sin(t), np.cos(t) * np.cos(f), np.cos(t) * np.sin(f)])
            # Along the eye's ray a fibre at depth n is seen with probability e^{-n / cos phi}
            pixel = sum(
                w * radiance(np.array([[1.0, 0, 0]]), eye, Room(n * np.cos(f), 1e4).light(lit), 0.0)[0, 0]
                for n, w in zip(nodes, weights, strict=True)
            )
            exitance += a * b * np.cos(t) * np.cos(t) * np.cos(f) * pixel
    print(f"white slab: exitance {exitance:.3f} of irradiance")
    assert 0.7 < exitance < 1.0


def walked(around: _F64, count: int, edges: _F64, deepest: float) -> tuple[_F64, _F64]:
    """Fluence of scattered light down and up between depths, by random walks of `count` photons among parallel fibres.

    A layer of this many fibres is lit along its normal; N (H,) over phi in [0, pi] says where each fibre sends light.
    """
    rng = np.random.default_rng(7)
    whole = np.concatenate([around, around[-2::-1]])
    turn = np.linspace(0, 2 * np.pi, whole.size)
    sums = np.concatenate([[0], np.cumsum((whole[1:] + whole[:-1]) / 2 * np.diff(turn))])
    depth, way, left = np.zeros(count), np.zeros(count), np.ones(count)
    fluence = np.zeros((2, len(edges) - 1))
    for scattered in range(300):
        depth = depth + rng.exponential(size=len(depth)) * np.cos(way)
        inside = (depth > 0) & (depth < deepest)
        depth, way, left = depth[inside], way[inside], left[inside]
        if scattered:
            for row, there in enumerate((np.cos(way) > 0, np.cos(way) <= 0)):
                fluence[row] += np.histogram(depth[there], edges, weights=left[there])[0]
        left = left * sums[-1]
        kept = rng.random(len(left)) < np.minimum(left / 0.05, 1)
        depth, way, left = depth[kept], way[kept], np.maximum(left[kept], 0.05)
        if not len(left):
            break
        way = way + np.interp(rng.random(len(way)) * sums[-1], sums, turn) - np.pi
    down, up = fluence / count / np.diff(edges)
    return down, up


@pytest.mark.parametrize(("level", "off"), [(2, 0.2), (4, 0.13), (6, 0.13), (9, 0.2)])
@pytest.mark.parametrize("deepest", [5.0, 50.0])
def test_scattered_light_is_that_of_a_layer_of_fibres(level: int, off: float, deepest: float) -> None:
    """The largest error at ten depths, of the largest fluence of each stream."""
    edges = np.array([0, 0.2, 0.5, 1, 1.5, 2, 2.5, 3, 3.5, 4, 4.5])
    lobes, means = (table[:, level, 0].sum(0) for table in SCATTERING.far_field)
    down, up = walked(lobes, 40_000, edges, deepest)
    a_f, a_b = np.pi * means[-1], np.pi * means[0]
    s, m = SCATTERING.sums[level, 0, 2:4]
    middles = (edges[1:] + edges[:-1]) / 2
    ours = np.array([streams(a_f, a_b, s, m, n, deepest - n) for n in middles]).T
    errors = [np.abs(mine - walk).max() / walk.max() for mine, walk in zip(ours, (down, up), strict=True)]
    print(
        f"sigma {SCATTERING.levels[level]:.2f}, {deepest:.0f} fibres: down off by {errors[0]:.3f}, up by {errors[1]:.3f}"
    )
    assert max(errors) < off


@pytest.mark.parametrize("n", [0.2, 1.0, 2.5])
def test_glints_keep_the_mean(n: float) -> None:
    tangents = np.repeat([[1.0, 0, 0]], 200_000, axis=0)
    eye, L = np.array([0.0, 0, 1]), unit(np.array([0.1, 0.5, 0.8]))[None]
    room = Room(n=n, behind=1.0)
    smooth = radiance(tangents[:1], eye, room.light(L), 0.5)[0]
    glinting = radiance(tangents, eye, room.light(L, glints=True), 0.5)
    error = np.abs(glinting.mean(0, dtype=np.float64) / smooth - 1).max()
    print(f"n {n}: mean moves by {error:.1e}; contrast {glinting[:, 0].std() / smooth[0]:.2f}")
    assert error < 0.01
    assert glinting[:, 0].std() > 0.1 * smooth[0]


def test_shading_does_not_depend_on_threads_or_company() -> None:
    before = kernels.threads()
    rng = np.random.default_rng(5)
    points = np.cumsum(rng.normal(size=(203, 7, 3)), axis=1).astype(np.float32) * np.float32(1e-3)
    pigment, own = own_colours(rng.uniform(0, 2, (203, 3)).astype(np.float32))
    own[:, 1] = rng.uniform(0.5, 2, 203)
    key = rng.integers(0, 2**32, 203, dtype=np.uint32)
    light = Room(n=0.5, behind=1.0).light(spread(3), glints=True)
    eye, tables = np.array([0.1, 0.2, 1.0]), SCATTERING.tables(pigment)
    kernels.set_threads(1)
    alone = kernels.shade(points, own, key, eye, light, tables)
    kernels.set_threads(3)
    assert np.array_equal(kernels.shade(points, own, key, eye, light, tables), alone)
    kernels.set_threads(before)
    part = kernels.shade(points[50:90], own[50:90], key[50:90], eye, light, tables)
    count = points.shape[1]
    assert np.array_equal(part, alone[50 * count : 90 * count])
    some = np.arange(7, len(alone), 11, dtype=np.uint32)
    assert np.array_equal(kernels.shade(points, own, key, eye, light, tables, some), alone[some])


def test_broken_strands_give_finite_colours() -> None:
    points = np.zeros((3, 4, 3), np.float32)
    points[1] = 1e30
    points[2] = np.nan
    light = Room(n=0.5, behind=1.0).light(spread(2))
    pigment, own = own_colours(np.full((3, 3), 0.5, np.float32))
    key, tables = np.zeros(3, np.uint32), SCATTERING.tables(pigment)
    shaded = kernels.shade(points, own, key, np.array([0.0, 0, 1]), light, tables)
    assert np.isfinite(shaded[:4]).all()


def test_wrong_arrays_are_refused() -> None:
    light, tables = Room().light(spread(2)), SCATTERING.tables(np.ones((2, 2, 4), np.float32))
    points, key = np.zeros((2, 4, 3), np.float32), np.zeros(2, np.uint32)
    with pytest.raises(ValueError, match="do not fit points"):
        kernels.shade(points, np.zeros((3, 3), np.float32), key, np.zeros(3), light, tables)
    with pytest.raises(ValueError, match="2 or more points"):
        kernels.shade(points[:, :1].copy(), np.zeros((2, 3), np.float32), key, np.zeros(3), light, tables)
    with pytest.raises(ValueError, match="beyond the last"):
        beyond = np.array([8], np.uint32)
        kernels.shade(points, np.zeros((2, 3), np.float32), key, np.zeros(3), light, tables, beyond)
