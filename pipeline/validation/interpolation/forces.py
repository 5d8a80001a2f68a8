"""Strands rebuilt from blended internal forces, each with its own material and rest shape.

What the forces inside a guide bear, a load on each of its points, is known from its simulation. A strand that bears the mean
of its guides' loads is where it is in equilibrium with it:
    minimal energy of bending and twisting (its own rest strains) - sum_j L_j . x_j,    L_j = sum_g w_g L_gj
found by steps with much drag, from where tangent rotation puts the strand. With its own loads a strand is found again to 1e-5
of its length (test_interpolation_error.py), so that what is left is the error of blending.
Source: Hsu et al., "Real-time Physically Guided Hair Interpolation" (ACM TOG 43, 2024), of which this is the idea and not the
algorithm: they solve for orientations in closed form, on a model that stretches.
"""

import numpy as np
from numpy.typing import NDArray

from pipeline import kernels
from pipeline.validation.interpolation.methods import Following, tangent_rotation, tangents, turns
from pipeline.validation.interpolation.scene import Moment

Floats = NDArray[np.float64]

_STEPS, _DT, _DRAG = 300, 4e-3, 20.0  # how a strand is brought to rest [s, 1/s]


def internal_forces(to: Following, guides: Moment) -> Floats:
    """Points (n, P, 3) [m] of strands that bear the mean of their guides' loads."""
    return in_equilibrium(to, to.mean(guides.load), tangent_rotation(to, guides), _directors(to, guides))


def in_equilibrium(to: Following, load: Floats, points: Floats, directors: Floats) -> Floats:
    """Strands (n, P, 3) [m] at rest under a load (n, P, 3) [N], from points and directors (n, P-1, 3) near by."""
    rest = to.scene.simulation(to.strands).rest
    rest.load = np.ascontiguousarray(load)
    settings = kernels.StepSettings()
    settings.torsion, settings.gravity = "kirchhoff", (0.0, 0.0, 0.0)
    settings.dt, settings.theta, settings.tolerance = _DT, 1.0, 1e-8
    settings.drag, settings.drag_speed, settings.damping = _DRAG, 0.0, 0.0
    state = kernels.at_rest(np.ascontiguousarray(points), np.ascontiguousarray(directors))
    drive = kernels.Drive(np.tile(np.eye(4), (_STEPS + 1, 1, 1)), np.zeros((_STEPS, 3)))
    kernels.advance(state, rest, None, drive, settings)
    return np.asarray(state.points, np.float64)


def _directors(to: Following, guides: Moment) -> Floats:
    """The directors at rest, turned as the guides have, square to the tangents that this gives."""
    u, _, v = np.linalg.svd(to.mean(turns(to.guide_rest, guides.points)))
    rest = to.scene.simulation(to.strands).rest
    found = np.einsum("npij,npj->npi", u @ v, rest.directors)
    t = tangents(tangent_rotation(to, guides))
    found -= (found * t).sum(axis=2, keepdims=True) * t
    return np.asarray(found / np.linalg.norm(found, axis=2, keepdims=True))
