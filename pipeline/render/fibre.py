"""Light scattered by one hair fibre, seen from afar: tables for the shading kernel.

A fibre scatters in four lobes p = R, TT, TRT and the rest (TRRT and beyond): S = sum M_p N_p. M_p, along the fibre,
has a closed form that the kernel evaluates; N_p, around it, is the mean over the offset h across the fibre,

    N_p(theta, phi) = 1/2 int_{-1}^{1} A_p(h) D_p(phi - Phi_p(h)) dh,

and G_p its mean over phi +- pi/2, which multiple scattering needs. theta is the eye's inclination theta_o, or, for who
wants light and eye to change places, theta_d = (theta_o - theta_i) / 2; phi = 0 has the light and the eye on the same
side; absorption sigma_a is in 1 / (fibre radius).

Sources: Marschner et al., Light Scattering from Human Hair Fibers, SIGGRAPH 2003 (lobes); d'Eon et al., An
Energy-Conserving Hair Reflectance Model, EGSR 2011 (A_p, M_p); Chiang et al., A Practical and Controllable Hair and
Fur Model, Eurographics 2016, eq. 7-8 (D_p, roughness), who takes Fresnel and absorption at theta_o, where a white fibre
returns to any eye all that it gets; Marschner takes them at theta_d, which is reciprocal.
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from pipeline import kernels

_F32 = NDArray[np.float32]
_F64 = NDArray[np.float64]

ETA: Final = 1.55
"""Refractive index of keratin."""
ABSORPTION_MAX: Final = 8.0
"""[1/radius] absorption at the last level: darker hair shows only its R lobe, as this does."""
LEVELS, INCLINATIONS, AZIMUTHS, NODES = 24, 52, 48, 140
_PLACES: Final = 8  # from the middle of a fibre to its side: see near_field.hpp
_DIRECTIONS: Final = 64
_INCLINED, _AROUND = 16, 24  # fibres and azimuths of the mean answer to light from a direction
_GREY: Final = 0.9999
"""Albedo of the whitest hair when the slant is looked for: in white hair nothing fades, aslant or not."""


def variance(roughness: _F64 | float) -> _F64:
    """Longitudinal variance v (...) of the lobe R (Chiang et al. 2016, eq. 7)."""
    v: _F64 = np.square(0.726 * roughness + 0.812 * np.power(roughness, 2) + 3.7 * np.power(roughness, 20))
    return v


def variances(roughness: float) -> _F64:
    """Longitudinal variances v (4,) of all lobes (Chiang et al. 2016, section 4.1)."""
    return np.asarray(variance(roughness) * np.array([1.0, 0.25, 4.0, 4.0]))


def scale(roughness: float) -> float:
    """Scale s of the azimuthal logistic (Chiang et al. 2016, eq. 8)."""
    return float(np.sqrt(np.pi / 8) * (0.265 * roughness + 1.194 * roughness**2 + 5.372 * roughness**22))


def fresnel(cosine: _F64) -> _F64:
    """Reflectance of unpolarised light that meets keratin at this cosine of incidence."""
    inside = np.sqrt(1 - (1 - cosine**2) / ETA**2)
    parallel = (ETA * cosine - inside) / (ETA * cosine + inside)
    perpendicular = (cosine - ETA * inside) / (cosine + ETA * inside)
    reflectance: _F64 = (parallel**2 + perpendicular**2) / 2
    return reflectance


def attenuation(cosine: _F64, h: _F64, sigma: _F64) -> _F64:
    """A_p (4, ...): what leaves in each lobe, at cos(theta), offset h and absorption sigma; sums to 1 at sigma = 0."""
    sine2 = 1 - cosine**2
    inner = np.sqrt(1 - (h * cosine) ** 2 / (ETA**2 - sine2))
    transmitted = np.exp(-2 * sigma * inner / np.sqrt(1 - sine2 / ETA**2))
    f = fresnel(cosine * np.sqrt(1 - h**2)) + 0 * transmitted
    tt = (1 - f) ** 2 * transmitted
    trt = tt * transmitted * f
    return np.stack([f, tt, trt, trt * transmitted * f / (1 - transmitted * f)])


def deflection(p: int, cosine: _F64, h: _F64) -> _F64:
    """Phi_p [rad]: the azimuth in which a ray leaves that met the smooth fibre at offset h."""
    inner = np.arcsin(h * cosine / np.sqrt(ETA**2 - 1 + cosine**2))
    angle: _F64 = 2 * p * inner - 2 * np.arcsin(h) + p * np.pi
    return angle


def logistic(x: _F64, s: float) -> _F64:
    """D: density [1/rad] of the logistic trimmed to one turn, at any angle x."""
    e = np.exp(-np.abs((x + np.pi) % (2 * np.pi) - np.pi) / s)
    density: _F64 = e / (s * (1 + e) ** 2 * np.tanh(np.pi / (2 * s)))
    return density


def logistic_integral(x: _F64, s: float) -> _F64:
    """Integral of D from 0 to any angle x; grows by 1 with every turn."""
    turns = np.floor((x + np.pi) / (2 * np.pi))
    integral: _F64 = turns + np.tanh((x - 2 * np.pi * turns) / (2 * s)) / (2 * np.tanh(np.pi / (2 * s)))
    return integral


def _along(cosines: _F64, sines: _F64, v: float) -> _F64:
    """M from cos ti cos to and sin ti sin to, of variance v; I0 is the Bessel function."""
    a = cosines / v
    few, many = np.minimum(a, 50), np.maximum(a, 50)
    series = np.sqrt(1 / (2 * np.pi * many)) * (1 + 1 / (8 * many) + 9 / (128 * many**2))
    scaled = np.where(a < 50, np.i0(few) * np.exp(-few), series)
    m: _F64 = scaled * np.exp(a - (1 + sines) / v) / (v * (1 - np.exp(-2 / v)))
    return m


def _between(table: _F64, x: _F64, y: _F64) -> _F64:
    """Entries of a table (X, Y) at places 0 <= x <= X - 1, 0 <= y <= Y - 1, linear between neighbours."""
    i = np.minimum(x.astype(int), table.shape[0] - 2)
    j = np.minimum(y.astype(int), table.shape[1] - 2)
    u, v = x - i, y - j
    low, high = ((1 - v) * table[k, j] + v * table[k, j + 1] for k in (i, i + 1))
    return np.asarray((1 - u) * low + u * high)


@lru_cache
def _gauss() -> tuple[_F64, _F64]:
    """Gauss and Legendre's nodes and weights across the fibre."""
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    return nodes, weights


def far_field(cosine: _F64, phi: _F64, sigma: _F64, azimuthal_roughness: float) -> tuple[_F64, _F64]:
    """N and its half-circle mean G, both (4, A, T, H) [1/rad].

    Args:
        cosine: (T,) of theta, > 0.
        phi: (H,) [rad].
        sigma: (A,) [1/radius].
        azimuthal_roughness: 0.1 .. 1.

    """
    s = scale(azimuthal_roughness)
    h, weight = _gauss()
    # A is even in h and Phi odd: nodes h > 0 see phi and -phi
    h, weight = h[NODES // 2 :], weight[NODES // 2 :] / 2
    leaving = weight * attenuation(cosine[:, None], h, sigma[:, None, None])
    lobes, means = (np.empty((4, sigma.size, cosine.size, phi.size)) for _ in range(2))
    for p in range(3):
        for t, c in enumerate(cosine):
            x = np.stack([phi, -phi])[..., None] - deflection(p, c, h)
            half_turn = logistic_integral(x + np.pi / 2, s) - logistic_integral(x - np.pi / 2, s)
            lobes[p, :, t] = leaving[p, :, t] @ logistic(x, s).sum(0).T
            means[p, :, t] = leaving[p, :, t] @ half_turn.sum(0).T / np.pi
    lobes[3] = means[3] = 2 * leaving[3].sum(-1)[..., None] / (2 * np.pi)
    return lobes, means


def decay(around: _F64, albedo: float) -> float:
    """Rate at which light fades with the number of fibres across which it goes, deep among parallel ones.

    The slowest of the exponentials that solve the equation of transfer in the plane across them, in 64 directions
    (Chandrasekhar, Radiative Transfer, 1950): (1 - K cos) psi = N * psi, for N (H,) over phi in [0, pi], scaled to an
    albedo below 1.
    """
    turn = (np.arange(_DIRECTIONS) + 0.5) * 2 * np.pi / _DIRECTIONS
    # phi is 0 where light goes back the way it came
    between = np.abs((turn[:, None] - turn) % (2 * np.pi) - np.pi)
    kernel = np.interp(between, np.linspace(0, np.pi, around.size), around)
    lost = np.eye(_DIRECTIONS) - albedo * kernel / kernel.sum(axis=1, keepdims=True)
    rates = np.linalg.eigvals(np.linalg.solve(lost, np.diag(np.cos(turn))))
    return float(1 / rates.real.max())


@dataclass(frozen=True)
class Scattering:
    """The tables of one kind of fibre: roughness along and around it, tilt [rad] of the cuticle's scales to the root."""

    roughness: float
    azimuthal_roughness: float
    tilt: float
    reciprocal: bool = False

    @cached_property
    def far_field(self) -> tuple[_F64, _F64]:
        """N and G (4, A, T, H) on the grid of the tables."""
        theta = np.linspace(0, np.pi / 2, INCLINATIONS)
        phi = np.linspace(0, np.pi, AZIMUTHS)
        # Grazing light: the last inclination stays just off the fibre's own direction
        return far_field(np.cos(np.minimum(theta, 1.5707)), phi, self.levels, self.azimuthal_roughness)

    @property
    def levels(self) -> _F64:
        """Absorption (A,) [1/radius] of the levels, uniform in its root."""
        return ABSORPTION_MAX * np.linspace(0, 1, LEVELS) ** 2

    @cached_property
    def sums(self) -> _F64:
        """(A, T, 8): a_f, a_b, s, m, twice the circle means of N for TT and TRT + rest, spreads v_f, v_b of forward and back.

        Of light from everywhere on one side s is scattered back to it; m is how much aslant such light goes: see shade.hpp.
        """
        lobes, means = self.far_field
        v = variances(self.roughness)[:, None, None]
        back, forward = np.pi * means[..., 0], np.pi * means[..., -1]
        twice = (back + forward) / np.pi
        a_f, a_b = forward.sum(0), back.sum(0)
        v_f, v_b = (v * forward).sum(0) / a_f, (v * back).sum(0) / a_b
        # By the mean cosine: where light fades slowly two streams are then right (m is the root of 2)
        turned = (1 + np.cos(np.linspace(0, np.pi, AZIMUTHS))) / 2
        s = (a_f + a_b) * ((lobes.sum(0) @ turned) / lobes.sum((0, 3)))
        around = lobes[:, :, 0].sum(0)
        albedo, share = _GREY * (a_f + a_b)[:, 0], _GREY * s[:, 0]
        rates = [decay(each, most) for each, most in zip(around, albedo, strict=True)]
        m = rates / np.sqrt((1 - albedo + share) ** 2 - share**2)
        slant = np.broadcast_to(m[:, None], s.shape)
        return np.stack([a_f, a_b, s, slant, twice[1], twice[2] + twice[3], v_f, v_b], axis=-1)

    def loss(self, sigma: _F32 | _F64) -> _F32:
        """Part k of the light that a fibre takes away for good, for absorption sigma (...): same shape, float32.

        k = sqrt((1 - a_f)^2 - a_b^2), the decay of diffuse light with the number of fibres; 0 for white hair.
        """
        a_f, a_b = (np.interp(np.sqrt(sigma), np.sqrt(self.levels), self.sums[:, 0, i]) for i in range(2))
        return np.sqrt(np.maximum((1 - a_f) ** 2 - a_b**2, 0)).astype(np.float32)

    def answer(self, cosine: _F64, sigma: _F64) -> tuple[_F64, _F64]:
        """How fibres answer to light from directions around the eye's: w (D, 3), R, G, B, and m (D,), green.

        A fibre of tangent t answers w + m P2(t . h), by what it does under an even sky, to light from a direction with the
        half vector h to the eye's. Fibres mirror light to the cone around them, where t . h = 0: for the sharpest of lobes
        m = -5/2 w, the second of Legendre's series of a delta.

        Args:
            cosine: (D,) of the angle between the direction that light comes from and that to the eye.
            sigma: (3,) [1/radius] absorption.

        Fibres of all directions count alike. The tilt of their scales, which those of opposite directions turn to opposite
        sides, is left out.

        """
        sine, weight = (each[:, None, None] for each in np.polynomial.legendre.leggauss(_INCLINED))
        out = np.sqrt(1 - sine**2)
        turn = (np.arange(_AROUND) + 0.5) * np.pi / _AROUND
        # The eye is z, the fibre lies in the plane of x and z
        arriving = (
            out * np.sqrt(np.maximum(1 - cosine**2, 0))[:, None] * np.cos(turn) + sine * cosine[:, None]
        )
        across = np.sqrt(np.maximum(1 - arriving**2, 1e-9))
        phi = np.arccos(np.clip((cosine[:, None] - arriving * sine) / (across * out), -1, 1))
        theta, azimuth = np.arccos(out) * ((INCLINATIONS - 1) * 2 / np.pi), phi * ((AZIMUTHS - 1) / np.pi)
        level = np.sqrt(np.minimum(sigma / ABSORPTION_MAX, 1)) * (LEVELS - 1)
        below = np.minimum(level.astype(int), LEVELS - 2)
        answers = np.zeros((3, *phi.shape))
        for lobe, v in zip(self.far_field[0], variances(self.roughness), strict=True):
            seen = _along(across * out, arriving * sine, v)
            for c, (k, u) in enumerate(zip(below, level - below, strict=True)):
                of_level = (1 - u) * lobe[k] + u * lobe[k + 1]
                answers[c] += seen * _between(of_level, theta, azimuth)
        albedo = self.sums[..., 0] + self.sums[..., 1]
        for c, (k, u) in enumerate(zip(below, level - below, strict=True)):
            of_level = (1 - u) * albedo[k] + u * albedo[k + 1]
            answers[c] *= 4 * np.pi / np.interp(theta, np.arange(INCLINATIONS), of_level)
        answers *= weight / (2 * _AROUND)
        half = (arriving + sine) / np.sqrt(np.maximum(2 + 2 * cosine, 1e-6))[:, None]
        second = 5 * answers[1] * (1.5 * np.minimum(half**2, 1) - 0.5)
        return answers.sum(axis=(1, 3)).T, second.sum(axis=(0, 2))

    @cached_property
    def across(self) -> _F64:
        """(A, T, 32): mean of A_p over each eighth of the way from the middle to a side, by that over all of it."""
        nodes, weights = np.polynomial.legendre.leggauss(NODES // _PLACES)
        cosine = np.cos(np.minimum(np.linspace(0, np.pi / 2, INCLINATIONS), 1.5707))
        h = (np.arange(_PLACES)[:, None] + (1 + nodes) / 2) / _PLACES
        leaving = attenuation(cosine[:, None, None], h, self.levels[:, None, None, None]) @ (weights / 2)
        shares = leaving / np.maximum(leaving.mean(-1, keepdims=True), 1e-300)
        return np.asarray(np.moveaxis(shares, 0, 2).reshape(LEVELS, INCLINATIONS, -1))

    def tables(self, pigment: _F32, near: bool = True) -> kernels.FibreTables:
        """The tables as the shading kernel takes them, with a `pipeline.render.pigment.table` (K, J, 4).

        Without `near`, wide strands show their mean over their width.
        """
        lobes, means = self.far_field
        record = [*lobes, means[0], means[1], means[2] + means[3], 0 * means[0]]
        # The cuticle's scales lean towards the tip: R turns to the tip, TT and TRT to the root
        tilt = self.tilt * np.array([2.0, -1.0, -4.0, 0.0])
        tables = kernels.FibreTables(
            np.ascontiguousarray(np.stack(record, axis=-1), np.float32),
            np.ascontiguousarray(self.sums, np.float32),
            pigment,
            variances(self.roughness).astype(np.float32),
            tilt.astype(np.float32),
            ABSORPTION_MAX,
        )
        tables.reciprocal = self.reciprocal
        if near:
            across = np.ascontiguousarray(self.across, np.float32)
            tables.vary_across(across, ETA, scale(self.azimuthal_roughness))
        return tables
