"""How fast guides are stepped: waves that lie on a round head which shakes, or curls that fall onto it."""

import time
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from pipeline import kernels
from pipeline.bench.flops import flops_per_point_step, part_of_peak
from pipeline.config.schema import HairContact, Motion, Simulate
from pipeline.simulate.hair_contact import Cost
from pipeline.simulate.stepper import Guides, Simulation
from pipeline.strands.held import held_ends

_HEAD = 0.1  # radius [m]
_LENGTH = 0.25
_STRANDS = 60  # strands that a guide stands for
_OFFSET, _LIFT = 1e-3, 15e-3  # distance that the lowest and the uppermost layer keep from the head [m]
_FRAMES = 20
_REPEATS = 7
_CURL, _PITCH = 8e-3, 20e-3  # radius and pitch of the curls that fall [m]


def bench(
    guides: int = 1024,
    points: int = 32,
    precision: Literal["float32", "float64"] = "float32",
    threads: int = 2,
    hair: Literal["none", "grid", "capsule"] = "none",
    falling: bool = False,
    torsion: Literal["none", "frenet", "rotor", "kirchhoff"] = "rotor",
    still: bool = False,
    repeats: int = _REPEATS,
) -> dict[str, float]:
    """Step hair of 25 cm at dt = 1/240 s with the stage's own stepper.

    Waves that have settled on a shaking head, or `still` on one at rest, medians over repeats; or, `falling`, a second of curls that stand on a
    head and fall onto one another. `hair` is the method of hair-hair contact. Returns ns_per_point_step,
    frames_per_second (10 steps a frame), threads, and hair_ms_per_step, the part of hair-hair contact. For "rotor" also
    the operations of a step and what part of the machine's peak they make.
    """
    kernels.set_threads(threads)
    if falling:
        simulate = Simulate(
            precision=precision,
            torsion=torsion,
            rest="groom",
            settle=0,
            frames=24,
            hair_contact=HairContact(method=hair),
        )
        simulation = Simulation(simulate, seed=1, guides=curly_head(guides, points))
        return _figures(simulation, _timed(simulation, simulate.frames) / simulate.frames, threads)
    preset: Literal["none", "shake"] = "none" if still else "shake"
    motion = Motion(preset=preset, period=1.0, swings=1000, amplitude=0.3, pivot=(0.0, 0.0, 0.0))
    simulate = Simulate(
        precision=precision,
        motion=motion,
        hair_contact=HairContact(method=hair),
        torsion=torsion,
        rest="groom",
    )
    simulation = Simulation(simulate, seed=1, guides=round_head(guides, points))
    simulation.settle()
    simulation.cost = Cost()
    seconds = [_timed(simulation, _FRAMES) for _ in range(1 + repeats)][1:]
    return _figures(simulation, float(np.median(seconds)) / _FRAMES, threads)


def _figures(simulation: Simulation, frame: float, threads: int) -> dict[str, float]:
    guides, points = simulation.state.points.shape[:2]
    cost, simulate = simulation.cost, simulation.simulate
    ns = frame / (simulate.substeps * guides * points) * 1e9
    figures = {
        "ns_per_point_step": round(ns, 3),
        "frames_per_second": round(1 / frame, 3),
        "threads": threads,
        "hair_ms_per_step": round(cost.neighbours / cost.steps * 1e3, 3),
    }
    if simulate.torsion == "rotor":
        flops = flops_per_point_step(cost.solves / cost.steps, cost.rounds / cost.steps)
        figures |= part_of_peak(flops, ns, simulate.precision, kernels.threads())
    return figures


def round_head(guides: int, points: int) -> Guides:
    """Wavy strands, combed down from the top of a sphere: half of them lies on it, the other half hangs."""
    height, turn = _upper_half(guides)
    along = np.linspace(0, _LENGTH, points)
    angle = np.arccos(height) + along / _HEAD
    hanging = np.maximum(angle - np.pi / 2, 0) * _HEAD
    angle = np.minimum(angle, np.pi / 2)
    radius = _HEAD + _OFFSET + _LIFT * (1 - np.exp(-along / 0.05))
    wave = 0.004 * (1 - np.cos(2 * np.pi * along / 0.06))
    outwards, down = radius * np.sin(angle), hanging - radius * np.cos(angle)
    x = outwards * np.cos(turn) - wave * np.sin(turn)
    z = outwards * np.sin(turn) + wave * np.cos(turn)
    strands = np.stack([x, -down, z], axis=-1)
    distance = np.linalg.norm(strands, axis=-1) - _HEAD
    return Guides(
        points=strands.astype(np.float32),
        held=held_ends(np.tile([2, 0], (guides, 1)), points),
        offset=np.clip(distance, _OFFSET, _LIFT).astype(np.float32),
        field=_sphere(),
        strands=_STRANDS * guides,
    )


def curly_head(guides: int, points: int) -> Guides:
    """Curls that stand on the upper half of a sphere like quills."""
    height, turn = _upper_half(guides)
    across = np.sqrt(1 - height**2)
    normal = np.stack([across * np.cos(turn), height, across * np.sin(turn)], axis=-1)
    east = np.stack([-np.sin(turn), np.zeros_like(turn), np.cos(turn)], axis=-1)
    rise = _PITCH / (2 * np.pi)
    angle = np.linspace(0, _LENGTH, points) / np.hypot(_CURL, rise)
    up, side, ahead = rise * angle, _CURL * (np.cos(angle) - 1), _CURL * np.sin(angle)
    strands = (
        (_HEAD + _OFFSET + up)[:, None] * normal
        + side[:, None] * east
        + ahead[:, None] * np.cross(normal, east)
    )
    return Guides(
        points=strands.astype(np.float32),
        held=held_ends(np.tile([2, 0], (guides, 1)), points),
        offset=np.full(strands.shape[:2], _OFFSET, np.float32),
        field=_sphere(),
        strands=_STRANDS * guides,
    )


def _timed(simulation: Simulation, frames: int) -> float:
    start = time.perf_counter()
    for _ in range(frames):
        simulation.next_frame()
    return time.perf_counter() - start


def _upper_half(count: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Height over radius and angle about the axis, (G, 1) each, of a Fibonacci lattice on half a sphere."""
    index = np.arange(count, dtype=np.float64)[:, None] + 0.5
    return np.asarray(1 - index / count), np.asarray(index * np.pi * (1 + 5**0.5))


def _sphere(spacing: float = 3e-3) -> kernels.DistanceField:
    axis = np.arange(-0.15, 0.15 + spacing, spacing)
    x, y, z = np.meshgrid(axis, axis, axis, indexing="ij")
    distance = np.sqrt(x**2 + y**2 + z**2) - _HEAD
    return kernels.DistanceField(distance.astype(np.float32), np.full(3, axis[0]), spacing)
