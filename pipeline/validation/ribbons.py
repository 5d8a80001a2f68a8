"""Where bending and twisting lose their balance together: ribbons, twisted rods and twisted rings.

The ribbon is stepped. Twisted rods are judged by the least eigenvalue of their energy's second derivative, by central
differences of the kernels' forces, among the displacements that keep all lengths.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh, null_space
from scipy.optimize import brentq

from pipeline import kernels
from pipeline.validation.buckling import first_fallen
from pipeline.validation.case import Law, Model, Outcome, Reading
from pipeline.validation.rod import BENDING, GRAVITY, WEIGHT, Array, Rod, clamped, leaning, straight, undamped

PRANDTL = 12.854  # critical w L^3 over sqrt(B2 C) of a thin cantilever under its own weight
GREENHILL_TWIST = 8.98682  # critical turn [rad] over B/C of a straight rod, clamped at both ends
MICHELL = 2 * np.pi * np.sqrt(3)  # critical turn [rad] over B/C of a closed ring
_PROBE = 1e-6  # of the spacing, for central differences


def lateral(model: Model, quick: bool) -> Outcome:
    """Critical weight of a ribbon that is clamped horizontally, on edge."""
    readings = []
    for points in (64,) if quick else (32, 64, 128):
        critical = first_fallen(*_ribbons(model, points))
        readings.append(Reading(f"{points} points, w L^3/sqrt(B2 C)", critical, PRANDTL, 0.015))
    return Outcome(tuple(readings))


def _ribbons(model: Model, points: int) -> tuple[Array, NDArray[np.bool_]]:
    """Critical figures of 21 ribbons, and which of them fall to the side."""
    figures = PRANDTL * (1 + np.linspace(-0.03, 0.03, 21))
    soft, thick = BENDING, 1000 * BENDING
    wring = 0.7 * soft
    lengths = (figures * np.sqrt(soft * wring) / WEIGHT) ** (1 / 3)
    strands = np.concatenate([straight(length, points) for length in lengths])
    settings = undamped(model, dt=4e-3, theta=1.0)
    settings.gravity = (0.0, -GRAVITY, 0.0)
    aside = 1e-6
    start = leaning(strands, 2, aside)
    rod = Rod(strands, clamped(points), settings, bending=thick, twisting=wring, start=start)
    rod.rest.bending_2 = np.full(len(figures), soft)
    upright = np.tile([0.0, 1.0, 0.0], (len(figures), points - 1, 1))
    rod.rest.directors = upright
    along = np.diff(start, axis=1)
    along /= np.linalg.norm(along, axis=2, keepdims=True)
    rod.state.directors[:] = upright - (upright * along).sum(axis=2, keepdims=True) * along
    rod.advance(3000)
    return figures, np.abs(rod.state.points[:, -1, 2]) > 30 * aside


def twisted_rod(_model: Model, quick: bool) -> Outcome:
    """Critical turn of one end of a straight rod against the other."""
    readings = []
    for joints, tolerance in ((32, 0.02),) if quick else ((16, 0.05), (32, 0.02), (64, 0.01)):
        line = straight(1.0, joints + 2)
        turn = _critical_turn(line, GREENHILL_TWIST, zero_modes=0)
        readings.append(Reading(f"{joints} joints, turn C/B [rad]", turn, GREENHILL_TWIST, tolerance))
    return Outcome(tuple(readings))


def ring(_model: Model, quick: bool) -> Outcome:
    """Critical turn of one end of a closed ring against the other."""
    readings = []
    for joints, tolerance in ((32, 0.05),) if quick else ((16, 0.15), (32, 0.05), (64, 0.015)):
        angle = 2 * np.pi / joints * np.arange(joints + 2)
        circle = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1)[None]
        turn = _critical_turn(circle, MICHELL, zero_modes=1)
        readings.append(Reading(f"{joints} joints, turn C/B [rad]", turn, MICHELL, tolerance))
    return Outcome(tuple(readings))


def _critical_turn(shape: Array, guess: float, zero_modes: int) -> float:
    """The turn [rad] over B/C at which an evenly twisted rod (1, P, 3), straight by nature, ceases to be stable.

    B = C = 1 for the rod as it is; zero modes are those that cost nothing at any turn (a ring that rolls).
    """

    def stiffness(turn: float) -> float:
        values = _eigenvalues(shape, turn)
        values = values[np.argsort(np.abs(values))[zero_modes:]] if zero_modes else values
        return float(values.min())

    turns = guess * np.linspace(0.85, 1.3, 10)
    signs = [stiffness(turn) for turn in turns]
    after = int(np.argmax(np.array(signs) < 0))
    if after == 0:
        return float("nan")
    return float(brentq(stiffness, turns[after - 1], turns[after], xtol=1e-5))


def _eigenvalues(shape: Array, turn: float) -> Array:
    """Least eigenvalues of the elastic energy among displacements of the free points that keep all lengths."""
    points = shape.shape[1]
    spacing = float(np.linalg.norm(shape[0, 1] - shape[0, 0]))
    probes = 3 * (points - 4) + points - 3  # free points, then turns of the free segments
    line = straight(spacing * (points - 1.5), points)
    ones = np.ones(2 * probes)
    rest = kernels.rest_shape(
        np.repeat(line, 2 * probes, axis=0), ones, ones, ones,
        np.tile(np.array(clamped(points), np.uint8), (2 * probes, 1)), np.zeros((2 * probes, points)),
    )  # fmt: skip
    tangent = np.diff(shape[0], axis=0) / spacing
    frame = kernels.untwisted_directors(shape)[0]
    directors = _turned(frame, tangent, turn * np.arange(points - 1) / (points - 2))
    moved, framed = np.repeat(shape, 2 * probes, axis=0), np.repeat(directors[None], 2 * probes, axis=0)
    step = _PROBE * spacing
    for probe in range(probes):
        for row, sign in ((2 * probe, step), (2 * probe + 1, -step)):
            if probe < 3 * (points - 4):
                moved[row, 2 + probe // 3, probe % 3] += sign
                new = np.diff(moved[row], axis=0)
                new /= np.linalg.norm(new, axis=1, keepdims=True)
                framed[row] = _transported(directors, tangent, new)
            else:
                angle = np.zeros(points - 1)
                angle[1 + probe - 3 * (points - 4)] = sign / spacing
                framed[row] = _turned(directors, tangent, angle)
    twist = np.full((2 * probes, points - 2), turn / (points - 2))
    _, force, turning = kernels.kirchhoff(moved, framed, rest, twist)
    gradient = np.concatenate([-force[:, 2:-2].reshape(2 * probes, -1), turning[:, 1:-1] / spacing], axis=1)
    second = (gradient[::2] - gradient[1::2]) / (2 * step)
    return _constrained(second, tangent, spacing, gradient.mean(axis=0))


def _constrained(second: Array, tangent: Array, spacing: float, gradient: Array) -> Array:
    """Eigenvalues of second derivatives (free points, then turns), with the tension of the lengths, where lengths stay."""
    free, segments = len(tangent) - 3, len(tangent)
    lengths = np.zeros((segments, len(second)))
    for edge in range(segments):
        for point, sign in ((edge, -1), (edge + 1, 1)):
            if 2 <= point < 2 + free:
                lengths[edge, 3 * (point - 2) : 3 * (point - 1)] = sign * tangent[edge]
    tension = np.linalg.lstsq(lengths.T, -gradient, rcond=None)[0]
    for edge in range(segments):
        across = tension[edge] / spacing * (np.eye(3) - np.outer(tangent[edge], tangent[edge]))
        for a, first in ((edge, -1), (edge + 1, 1)):
            for b, other in ((edge, -1), (edge + 1, 1)):
                if 2 <= a < 2 + free and 2 <= b < 2 + free:
                    second[3 * (a - 2) : 3 * (a - 1), 3 * (b - 2) : 3 * (b - 1)] += first * other * across
    keeping = null_space(lengths)
    return np.asarray(eigh(keeping.T @ ((second + second.T) / 2) @ keeping, eigvals_only=True))


def _turned(directors: Array, tangent: Array, angle: Array) -> Array:
    cos, sin = np.cos(angle)[:, None], np.sin(angle)[:, None]
    return np.asarray(cos * directors + sin * np.cross(tangent, directors))


def _transported(directors: Array, old: Array, new: Array) -> Array:
    along = (directors * new).sum(axis=1, keepdims=True) / (1 + (old * new).sum(axis=1, keepdims=True))
    return np.asarray(directors - along * (old + new))


def laws() -> list[Law]:
    """The laws of this file."""
    return [
        Law(
            "lateral buckling",
            "A ribbon (B1/B2 = 1000, C/B2 = 0.7) is clamped horizontally, on edge; from w L^3 = 12.854 sqrt(B2 C) on "
            "it falls to the side. Reference: Prandtl, *Kipperscheinungen* (1899), for the weight as load. "
            "The kappa-tau models have no sections, and the law has no meaning for them.",
            lateral,
            ("kirchhoff",),
        ),
        Law(
            "twisted rod",
            "One end of a straight rod, clamped at both ends and free to slide, is turned: stable up to 8.98682 B/C. "
            "Reference: Greenhill (1883). Frenet torsion is not twist: a straight strand of the other models has none.",
            twisted_rod,
            ("kirchhoff",),
        ),
        Law(
            "twisted ring",
            "A straight rod is closed to a ring with a turn of one end against the other: stable up to "
            "2 pi sqrt(3) B/C. Reference: Michell, *On the stability of a bent and twisted wire* (1889). "
            "Rolling about its own line costs a ring nothing and is left out.",
            ring,
            ("kirchhoff",),
        ),
    ]
