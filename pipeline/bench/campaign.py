"""A long shake of every kind of hair on a head: what must hold at every step, and whether curls find home after it."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline import kernels

Points = NDArray[np.float64]

_RADIUS, _YOUNG, _SHEAR, _DENSITY = 40e-6, 4e9, 0.9e9, 1300.0  # of a fibre
_HEAD = 0.09  # radius [m]
_STILL, _SETTLE = 5.0, 2.0  # [s]
_KICK = 0.05  # [s] mean time between kicks
_BENT = 0.1  # [rad] joints that bend less have no dihedral to speak of
KINDS = {
    "straight": (0.0, 1.0),
    "wavy": (0.005, 0.06),
    "curly": (0.008, 0.02),
    "tight": (0.002, 0.005),
}
"""Radius and pitch of the helix [m]; "tight" has kappa dl = 2.3 at every joint."""


@dataclass(frozen=True)
class Shaken:
    """One run. Worst strain and depth [m] of all its steps; part of the strands that did not come home."""

    kind: str
    torsion: str
    precision: str
    rate: int
    finite: bool
    strain: float
    depth: float
    halvings: int
    astray: float
    flipped: int
    """Dihedrals that differ from those before the shake by more than a right angle."""
    speed: float
    """Largest at the end [m/s]."""


def campaign(
    seconds: float,
    rates: tuple[int, ...] = (240, 120, 60),
    torsions: tuple[str, ...] = ("rotor", "kirchhoff"),
    strands: int = 16,
) -> Iterator[Shaken]:
    """Yaw of +-60 degrees at 2 Hz and random kicks of the head for so many seconds, then 5 s of stillness."""
    for torsion, kind, rate, precision in product(torsions, KINDS, rates, ("float32", "float64")):
        yield _shaken(kind, torsion, precision, rate, seconds, strands)


def _shaken(kind: str, torsion: str, precision: str, rate: int, seconds: float, strands: int) -> Shaken:
    points, settings = _groom(kind, strands), kernels.StepSettings()
    settings.dt, settings.torsion = 1 / rate, torsion  # type: ignore[assignment]
    fibre = np.ones(strands)
    area, moment = np.pi * _RADIUS**2, np.pi * _RADIUS**4 / 4
    held = np.zeros(points.shape[:2], np.uint8)
    held[:, :2] = 1
    rest = kernels.rest_shape(
        points,
        _DENSITY * area * fibre,
        _YOUNG * moment * fibre,
        2 * _SHEAR * moment * fibre,
        held,
        np.full(points.shape[:2], 1e-3),
    )
    state, field = (
        kernels.at_rest(points.astype(precision), rest.directors.astype(precision)),
        _sphere(),
    )
    poses = _poses(seconds, rate)
    still = np.tile(poses[-1:], (round(_STILL * rate) + 1, 1, 1))
    reports = [_advance(state, rest, field, settings, np.tile(np.eye(4), (round(_SETTLE * rate) + 1, 1, 1)))]
    before, shape = _elastic(state, rest, settings), state.points.astype(np.float64)
    for first in range(0, len(poses) - 1, rate):
        reports.append(_advance(state, rest, field, settings, poses[first : first + rate + 1]))
    reports.append(_advance(state, rest, field, settings, still))
    after = _elastic(state, rest, settings)
    return Shaken(
        kind,
        torsion,
        precision,
        rate,
        finite=all(report.bad_strand < 0 for report in reports),
        strain=max(report.strain for report in reports),
        depth=max(report.depth for report in reports),
        halvings=sum(report.halvings for report in reports),
        astray=float((after > 1.25 * before + 0.1 * before.mean()).mean()),
        flipped=flipped(shape, state.points.astype(np.float64)),
        speed=float(np.abs(state.velocity).max()),
    )


def _advance(state: Any, rest: Any, field: Any, settings: Any, poses: Points) -> kernels.Report:
    drive = kernels.Drive(np.ascontiguousarray(poses), np.zeros((len(poses) - 1, 3)))
    return kernels.advance(state, rest, field, drive, settings)


def _elastic(state: Any, rest: Any, settings: Any) -> NDArray[np.float64]:
    return np.asarray(kernels.energies(state, rest, settings)[:, :2].sum(axis=1))


def flipped(before: Points, after: Points) -> int:
    """How many dihedrals of strands (S, P, 3) turned by more than a right angle, of those with a bend at both ends."""
    angle, bent = _dihedrals(before)
    now, still_bent = _dihedrals(after)
    return int((bent & still_bent & (np.cos(now - angle) < 0)).sum())


def _dihedrals(points: Points) -> tuple[Points, NDArray[np.bool_]]:
    """Dihedral (S, P-3) [rad] about each inner segment, and whether both its joints are bent."""
    tangent = np.diff(points, axis=1)
    tangent /= np.linalg.norm(tangent, axis=2, keepdims=True)
    binormal = np.cross(tangent[:, :-1], tangent[:, 1:])
    bent = np.linalg.norm(binormal, axis=2) > np.sin(_BENT)
    before, after = binormal[:, :-1], binormal[:, 1:]
    sine = (np.cross(before, after) * tangent[:, 1:-1]).sum(axis=2)
    return np.arctan2(sine, (before * after).sum(axis=2)), bent[:, :-1] & bent[:, 1:]


def _poses(seconds: float, rate: int) -> Points:
    """Poses of the head: the yaw, and kicks that jump aside by up to 5 mm within a twentieth of a second."""
    random = np.random.default_rng(7)
    times = np.arange(round(seconds * rate) + 1) / rate
    knots = np.arange(0, seconds + 2 * _KICK, _KICK)
    kicks = random.uniform(-5e-3, 5e-3, (len(knots), 3)) * (random.random(len(knots)) < 0.2)[:, None]
    yaw = np.radians(60) * np.sin(2 * np.pi * 2 * times)
    poses = np.tile(np.eye(4), (len(times), 1, 1))
    poses[:, 0, 0] = poses[:, 2, 2] = np.cos(yaw)
    poses[:, 0, 2], poses[:, 2, 0] = np.sin(yaw), -np.sin(yaw)
    poses[:, :3, 3] = np.stack([np.interp(times, knots, kicks[:, axis]) for axis in range(3)], axis=1)
    return poses


def _groom(kind: str, strands: int) -> Points:
    """(S, 32, 3): strands of 25 cm (13 cm where tight) that stand on the upper half of the head."""
    radius, pitch = KINDS[kind]
    per_turn = np.hypot(2 * np.pi * radius, pitch)
    along = np.linspace(0, 0.132 if kind == "tight" else 0.25, 32)
    turn = 2 * np.pi * along / per_turn
    strand = np.stack([along * pitch / per_turn, radius * (np.cos(turn) - 1), radius * np.sin(turn)], axis=1)
    index = np.arange(strands) + 0.5
    height, azimuth = 1 - 0.9 * index / strands, index * np.pi * (1 + 5**0.5)
    flat = np.sqrt(1 - height**2)
    out = np.stack([flat * np.cos(azimuth), height, flat * np.sin(azimuth)], axis=1)
    side = np.cross(out, [0.6, 0.0, 0.8])
    side /= np.linalg.norm(side, axis=1)[:, None]
    frames = np.stack([out, side, np.cross(out, side)], axis=2)
    return np.ascontiguousarray((_HEAD + 2e-3) * out[:, None] + np.einsum("sij,pj->spi", frames, strand))


def _sphere(spacing: float = 3e-3) -> kernels.DistanceField:
    axis = np.arange(-0.13, 0.13 + spacing, spacing)
    x, y, z = np.meshgrid(axis, axis, axis, indexing="ij")
    distance = np.sqrt(x**2 + y**2 + z**2) - _HEAD
    return kernels.DistanceField(distance.astype(np.float32), np.full(3, axis[0]), spacing)
