"""Numpy twins of the energies, written from the formulas of the headers; they also take complex points.

Gradients come from complex steps: E(x + i h).imag / h is exact to rounding for any small h.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from pipeline import kernels

Numbers = NDArray[np.complex128] | NDArray[np.float64]


def dot(a: Numbers, b: Numbers) -> Numbers:
    """Products along the last axis, without conjugation: analytic in complex points."""
    return (a * b).sum(-1)


def norm(a: Numbers) -> Numbers:
    return np.sqrt(dot(a, a))


def unit_edges(x: Numbers) -> Numbers:
    edges = x[1:] - x[:-1]
    return edges / norm(edges)[:, None]


def spacing(rest: kernels.RestShape) -> NDArray[np.float64]:
    """dl of the inner points."""
    length = rest.length[0]
    return (length[1:] + length[:-1]) / 2


def bending(x: Numbers, rest: kernels.RestShape) -> complex:
    """Sum of k_kappa (kappa - kappa_r)^2 dl / 2, kappa = 2 |c| / (dl |e|), |c| rounded by 1e-4 of its rest value."""
    d, dl, kappa_r = unit_edges(x), spacing(rest), rest.curvature[0]
    c, e = d[1:] - d[:-1], d[1:] + d[:-1]
    kappa = 2 / dl * np.sqrt((dot(c, c) + (1e-4 * kappa_r * dl) ** 2) / dot(e, e))
    return complex((rest.bending[0] * (kappa - kappa_r) ** 2 * dl / 2).sum())


def rotor(x: Numbers, rest: kernels.RestShape) -> complex:
    """Sum of G/2 |sqrt(rho) R(phi) beta_i - beta_{i+1}/sqrt(rho)|^2, R turning about the edge between the two bends."""
    d = unit_edges(x)
    axis, before, after = d[1:-1], np.cross(d[:-2], d[1:-1]), np.cross(d[1:-1], d[2:])
    phi, root = rest.dihedral[0][:, None], np.sqrt(rest.ratio[0])[:, None]
    turned = np.cos(phi) * before + np.sin(phi) * np.cross(axis, before)
    r = root * turned - after / root
    return complex((rest.weight[0] * dot(r, r) / 2).sum())


def frenet(x: Numbers, rest: kernels.RestShape) -> complex:
    """Sum of k_tau (tau - s tau_r)^2 dl / 2, the lecture's general tau with |c|^2 + 0.3^2 for |c|^2 of unit edges."""
    d, dl, tau_r = unit_edges(x), spacing(rest)[1:-1], rest.torsion[0]
    c, e = d[1:] - d[:-1], d[1:] + d[:-1]
    u = c / (norm(e) * spacing(rest))[:, None]
    before, after = rest.length[0][1:-2, None], rest.length[0][2:-1, None]
    q = (before / after * u[2:] - after / before * u[:-2]) * dl[:, None]
    c, e = c[1:-1], e[1:-1]
    square = dot(c, c) + 0.3**2
    tau = dot(e, np.cross(c, q)) / (2 * dl * square)
    return complex((rest.twisting[0] * (tau - dot(c, c) / square * tau_r) ** 2 * dl / 2).sum())


def gradient(
    energy: Callable[[Numbers, kernels.RestShape], complex], x: NDArray[np.float64], rest: kernels.RestShape
) -> NDArray[np.float64]:
    """dE/dx by complex steps."""
    result = np.zeros_like(x)
    for index in np.ndindex(x.shape):
        stepped = x.astype(complex)
        stepped[index] += 1e-30j
        result[index] = energy(stepped, rest).imag / 1e-30
    return result
