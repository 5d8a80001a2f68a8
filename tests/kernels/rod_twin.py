"""Numpy twin of the "kirchhoff" energy, from the formulas of the header with trigonometry; takes complex arguments."""

from dataclasses import dataclass

import numpy as np
from energy_twins import Numbers, dot, spacing, unit_edges
from numpy.typing import NDArray
from strand_scenes import Points

from pipeline import kernels

STEP = 1e-30


@dataclass(frozen=True)
class Frame:
    """A configuration: points (P, 3) and the directors (P-1, 3) there; `twist` (P-2) chooses the windings."""

    points: Points
    directors: Points
    twist: Points


def transported(directors: Numbers, before: Numbers, after: Numbers) -> Numbers:
    """Directors taken along as tangents turn on the shortest way."""
    factor = dot(directors, after) / (1 + dot(before, after))
    return directors - factor[:, None] * (before + after)


def strains(t: Numbers, m: Numbers, twist: Points) -> tuple[Numbers, Numbers, Numbers]:
    """k1, k2 and twist of the joints between tangents t with directors m; windings nearest to `twist`."""
    n = np.cross(t, m)
    opened = 1 + dot(t[:-1], t[1:])
    cosine = (dot(m[:-1], m[1:]) + dot(n[:-1], n[1:])) / opened
    sine = (dot(n[:-1], m[1:]) - dot(m[:-1], n[1:])) / opened
    # atan2 of complex arguments: the real angle, and the analytic rest by arctan about it
    about = np.arctan2(sine.real, cosine.real)
    c, s = np.cos(about), np.sin(about)
    angle = about + np.arctan((sine * c - cosine * s) / (cosine * c + sine * s))
    angle = angle + 2 * np.pi * np.round((twist - angle.real) / (2 * np.pi))
    half_c, half_s = np.cos(angle / 2)[:, None], np.sin(angle / 2)[:, None]
    a1 = half_c * m[:-1] + half_s * n[:-1]
    a2 = half_c * n[:-1] - half_s * m[:-1]
    return 2 * dot(a1, t[1:]) / opened, 2 * dot(a2, t[1:]) / opened, angle


def energy(x: Numbers, theta: Numbers, at: Frame, rest: kernels.RestShape) -> complex:
    """Energy at points x with the directors of `at` transported there and turned by theta (P-1)."""
    t = unit_edges(x)
    m = transported(at.directors, unit_edges(at.points), t)
    m = np.cos(theta)[:, None] * m + np.sin(theta)[:, None] * np.cross(t, m)
    k1, k2, twist = strains(t, m, at.twist)
    r1, r2, r3 = rest.strain[0].T
    parts = rest.bending[0] * (k1 - r1) ** 2 + rest.bending_2[0] * (k2 - r2) ** 2
    return complex(((parts + rest.twisting[0] * (twist - r3) ** 2) / (2 * spacing(rest))).sum())


def gradients(at: Frame, rest: kernels.RestShape) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """dE/dx (P, 3) and dE/dtheta (P-1) by complex steps."""
    by_x, by_theta = np.zeros_like(at.points), np.zeros(len(at.directors))
    zero = np.zeros(len(at.directors), complex)
    for index in np.ndindex(by_x.shape):
        x = at.points.astype(complex)
        x[index] += 1j * STEP
        by_x[index] = energy(x, zero, at, rest).imag / STEP
    for j in range(len(by_theta)):
        theta = zero.copy()
        theta[j] += 1j * STEP
        by_theta[j] = energy(at.points.astype(complex), theta, at, rest).imag / STEP
    return by_x, by_theta
