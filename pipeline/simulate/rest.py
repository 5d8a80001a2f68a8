"""From the config's material and air to what the kernels step with."""

import numpy as np
from numpy.typing import NDArray

from pipeline import kernels
from pipeline.config.schema import Hair, Simulate
from pipeline.simulate.section import bending_stiffness, lay_sections, mass_per_length, twisting_stiffness

# [1/m]: wavy hair bends with radii up to 5 cm, the torsion of what bends less is noise
_STRAIGHTEST_CURL = 20.0

_LOOK_AHEAD = 0.3  # [rad] that a segment is expected to turn at most

# The drag of air on an isolated fibre of 80 um and 1300 kg/m^3, c = 11 + 15 |u| [1/s], fitted to a cylinder's
# C_D = 1 + 10 Re^(-2/3); per mass it falls as 1 / (width density).
_DRAG, _DRAG_SPEED, _FITTED_WIDTH, _FITTED_DENSITY = 11.0, 15.0, 80e-6, 1300.0


def rest_shape(
    hair: Hair, points: NDArray[np.floating], held: NDArray[np.uint8], offset: NDArray[np.floating]
) -> kernels.RestShape:
    """The groom as rest shape: points (G, P, 3) [m], who holds them (G, P), contact offset (G, P) [m].

    Raises ValueError when points are not finite or a segment has no length.
    """
    count = len(points)
    soft, stiff = bending_stiffness(hair)
    rest = kernels.rest_shape(
        np.ascontiguousarray(points, np.float64),
        np.full(count, mass_per_length(hair)),
        np.full(count, soft),
        np.full(count, twisting_stiffness(hair)),
        np.ascontiguousarray(held, np.uint8),
        np.ascontiguousarray(offset, np.float64),
        kappa_0=_STRAIGHTEST_CURL,
    )
    # Nearly straight joints have any torsion ("frenet" divides by their bend); half a turn a segment is the most
    # that a strand can show, and what would act once it bends.
    half_turn = np.pi / rest.length.mean(axis=1, keepdims=True)
    rest.torsion = np.clip(rest.torsion, -half_turn, half_turn)
    if hair.ellipticity > 1:
        rest.bending_2 = np.full(count, stiff)
        lay_sections(rest, _STRAIGHTEST_CURL)
    return rest


def step_settings(simulate: Simulate) -> kernels.StepSettings:
    """How to step, as the config says."""
    settings = kernels.StepSettings()
    settings.dt = 1 / (simulate.fps * simulate.substeps)
    settings.theta = simulate.theta
    settings.look_ahead = _LOOK_AHEAD if simulate.look_ahead else 0.0
    settings.gravity = simulate.gravity
    settings.damping = simulate.hair.damping
    settings.torsion = simulate.torsion
    settings.relaxation = simulate.relaxation
    settings.tolerance = simulate.tolerance
    settings.friction = simulate.hair.friction
    settings.drag, settings.drag_speed = drag(simulate.hair, simulate.air.shielding)
    return settings


def settling(simulate: Simulate) -> kernels.StepSettings:
    """The settings of the first half of the settling: full drag and theta = 1. What rests, rests with both."""
    settings = step_settings(simulate)
    settings.theta = 1.0
    settings.drag, settings.drag_speed = drag(simulate.hair, 1.0)
    return settings


def drag(hair: Hair, shielding: float) -> tuple[float, float]:
    """Constant [1/s] and linear part [1/m] of the drag rate across the strand; `shielding` 1 is an isolated fibre."""
    scale = shielding * (_FITTED_WIDTH / (2 * hair.radius)) * (_FITTED_DENSITY / hair.density)
    return _DRAG * scale, _DRAG_SPEED * scale
