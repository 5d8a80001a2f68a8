"""Sections of fibres: mass, stiffness, and how an elliptic section lies along a strand.

An ellipse with semi-axes a >= b has the area of the round section, pi r^2, so that a = r sqrt(e), b = r / sqrt(e) with
the ellipticity e = a / b. Towards a direction of its plane it bends with E I = E pi a b^3 / 4 (towards its minor
axis, where it is soft) and E pi a^3 b / 4; it twists with G J = G pi a^3 b^3 / (a^2 + b^2).

Hair leaves its follicle with one curvature in one direction of its section, which it keeps: so the minor axis follows
the curl. Source of typical ellipticities: Asian 1.29, Caucasian 1.41, African 1.66 (Robbins, "Chemical and Physical
Behavior of Human Hair", 5th edition 2012).
"""

import numpy as np
from numpy.typing import NDArray

from pipeline import kernels
from pipeline.config.schema import Hair


def mass_per_length(hair: Hair) -> float:
    """Mass of a fibre per length, rho pi r^2 [kg/m]."""
    return hair.density * np.pi * hair.radius**2


def bending_stiffness(hair: Hair) -> tuple[float, float]:
    """E I [N m^2] towards the minor and towards the major axis of the section."""
    round_one = hair.young_modulus * np.pi * hair.radius**4 / 4
    return round_one / hair.ellipticity, round_one * hair.ellipticity


def twisting_stiffness(hair: Hair) -> float:
    """G J [N m^2]."""
    return hair.shear_modulus * np.pi * hair.radius**4 / (hair.ellipticity + 1 / hair.ellipticity)


def lay_sections(rest: kernels.RestShape, straightest: float) -> None:
    """Turn the rest directors to the minor axes of the sections, and take the strains seen from there.

    Along the strand the axis goes without twist, but at a joint of curvature kappa towards the curvature (or against
    it, whichever is nearer), by the part kappa^2 / (kappa^2 + straightest^2): what is straighter than `straightest`
    [1/m] has no direction of its own.
    """
    length = rest.length
    curvature = rest.strain[..., 0] + 1j * rest.strain[..., 1]  # in the frame without twist
    bent = np.abs(curvature) / ((length[:, 1:] + length[:, :-1]) / 2)
    weight = bent**2 / (bent**2 + straightest**2)
    towards = np.exp(1j * np.angle(curvature))
    backwards = _follow(np.ones(len(weight), complex), towards[:, ::-1], weight[:, ::-1])
    axis = _follow(backwards[:, -1], towards, weight)
    # A segment lies between two joints
    turn = np.concatenate([axis[:, :1], axis[:, 1:] + axis[:, :-1], axis[:, -1:]], axis=1)
    turn = (turn / np.abs(turn))[..., None]
    tangents = np.diff(rest.points, axis=1) / length[..., None]
    rest.directors = np.ascontiguousarray(
        turn.real * rest.directors + turn.imag * np.cross(tangents, rest.directors)
    )
    rest.strain = kernels.strains(rest.points, rest.directors)


def _follow(
    start: NDArray[np.complex128], towards: NDArray[np.complex128], weight: NDArray[np.float64]
) -> NDArray[np.complex128]:
    """Axes (G, J) of the joints, from `start` (G,): each the one before, drawn towards that of the joint."""
    axes, axis = [], start
    for direction, part in zip(towards.T, weight.T, strict=True):
        along = np.where((direction * axis.conj()).real < 0, -direction, direction)
        axis = (1 - part) * axis + part * along
        axis = axis / np.abs(axis)
        axes.append(axis)
    return np.stack(axes, axis=1)
