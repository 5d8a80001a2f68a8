"""How fast guides are stepped: a full head of hair that lies on a round head which shakes."""

import time
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from pipeline import kernels
from pipeline.config.schema import Motion, Simulate
from pipeline.simulate.stepper import Guides, Simulation

_HEAD = 0.1  # radius [m]
_LENGTH = 0.25
_OFFSET = 1e-3
_FRAMES = 20
_REPEATS = 7


def bench(
    guides: int = 1024,
    points: int = 32,
    precision: Literal["float32", "float64"] = "float32",
    threads: int = 2,
) -> dict[str, float]:
    """Step wavy hair of 25 cm that has settled on a shaking head, at dt = 1/240 s, with the stage's own stepper.

    Returns ns_per_point_step and frames_per_second (10 steps a frame), medians over repeats, and threads.
    """
    kernels.set_threads(threads)
    motion = Motion(preset="shake", period=1.0, swings=1000, amplitude=0.3, pivot=(0.0, 0.0, 0.0))
    simulate = Simulate(precision=precision, motion=motion)
    simulation = Simulation(simulate, seed=1, guides=round_head(guides, points))
    simulation.settle()
    seconds = [_timed(simulation) for _ in range(1 + _REPEATS)][1:]
    frame = float(np.median(seconds)) / _FRAMES
    return {
        "ns_per_point_step": round(frame / (simulate.substeps * guides * points) * 1e9, 3),
        "frames_per_second": round(1 / frame, 3),
        "threads": threads,
    }


def round_head(guides: int, points: int) -> Guides:
    """Wavy strands that grow from the upper half of a sphere."""
    roots = _upper_half(guides)
    along = np.linspace(0, _LENGTH, points)
    wave = 0.006 * (1 - np.cos(2 * np.pi * along / 0.06))
    side = np.cross(roots, [0.0, 0.0, 1.0])
    strands = roots[:, None] * (_HEAD + _OFFSET + along)[:, None] + side[:, None] * wave[:, None]
    return Guides(
        points=strands.astype(np.float32),
        pins=np.tile(np.array([2, 0], np.uint8), (guides, 1)),
        offset=np.full((guides, points), _OFFSET, np.float32),
        field=_sphere(),
    )


def _timed(simulation: Simulation) -> float:
    start = time.perf_counter()
    for _ in range(_FRAMES):
        simulation.next_frame()
    return time.perf_counter() - start


def _upper_half(count: int) -> NDArray[np.float64]:
    index = np.arange(count) + 0.5
    height, turn = 1 - index / count, np.pi * (1 + 5**0.5) * index  # a Fibonacci lattice
    radius = np.sqrt(1 - height**2)
    return np.stack([radius * np.cos(turn), height, radius * np.sin(turn)], axis=-1)


def _sphere(spacing: float = 3e-3) -> kernels.DistanceField:
    axis = np.arange(-0.15, 0.15 + spacing, spacing)
    x, y, z = np.meshgrid(axis, axis, axis, indexing="ij")
    distance = np.sqrt(x**2 + y**2 + z**2) - _HEAD
    return kernels.DistanceField(distance.astype(np.float32), np.full(3, axis[0]), spacing)
