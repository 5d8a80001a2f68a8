"""What a config will cost, from formulas that are linear in the counts.

The coefficients were fitted on two cores with AVX-512. Memory and disk are right within a fifth from 10,000 to a million
strands (tests/cli/test_plan.py checks a small one); times tell minutes from hours, not seconds apart.
"""

import os
from dataclasses import asdict, dataclass
from typing import Any

from pipeline.config import Config

_GB = 1e9
_FITTED_THREADS = 2
_START_S = 0.8  # interpreter, libraries
_START_GB = 0.1
_VTK_GB = 0.29
_GROOM_GB = 0.23  # head and scalp
_GROOM_CHUNK_GB = 0.1  # strands in flight while they grow
_GROOM_CHUNK = 50_000
_DEFLATED = 0.93  # float32 positions after shuffle and deflate
_GROOM_DEFLATED = 0.8  # and those of a groom, whose strands run side by side
_BOUND_DEFLATED = 0.65  # guides, weights, roots and keys
_GROOM_ROW = 16  # [bytes] of a strand beside its points: normal and key
_HEAD_STORED_GB = 0.0036  # its meshes
_HEAD_M3 = 0.02  # box around a head that holds its distance grid

_GROOM_S_PER_POINT = 0.45e-6
_GROOM_B_PER_STRAND = 500  # roots, and what is looked for between them
_READ_B_PER_STRAND = 320  # of a groom that a later stage reads
_HEAD_S_PER_VOXEL = 4.5e-6
_STEP_S_PER_POINT = {"float32": 40e-9, "float64": 80e-9}
_GUIDE_B_PER_POINT = 1300
_BIND_S_PER_STRAND = 4e-6
_BIND_B_PER_STRAND = 40  # roots and their neighbours; the binding itself is written chunk by chunk
_RENDER_S_PER_POINT = 0.15e-6
_RENDER_S_PER_SAMPLE = 0.05e-6
_RENDER_B_PER_POINT = 30  # of the strands in flight
_RENDER_B_PER_SAMPLE = 60
_RENDER_B_PER_SEGMENT = 14  # of strands that may be seen, sorted into tiles
# Of a light's shadow map, which has three nodes a voxel; of two moments, and while it is made
_LIGHT_B_PER_NODE = 200
_LIGHT_B_PER_VOXEL = 40  # of density and sky
_NODES = 9  # of a map over the square of the voxels along the longest side
_LIGHT_B_PER_PIECE = 200  # of few strands, which light goes past one by one
_LENGTH = 0.25  # [m] of a strand
_BOUND_B = 70  # of a strand's binding in memory, and its order
_PNG_B_PER_PIXEL = 0.5


@dataclass(frozen=True)
class Cost:
    """Peak memory [GB], disk [GB] and wall time [s] of one stage."""

    peak_rss_gb: float
    disk_gb: float
    seconds: float


def estimate(config: Config) -> dict[str, Any]:
    """Estimate {"peak_rss_gb", "disk_gb", "seconds"} in all and, under "stages", for each stage."""
    stages = {
        "groom": _groom(config),
        "simulate": _simulate(config),
        "interpolate": _interpolate(config),
        "render": _render(config),
    }
    return {
        "peak_rss_gb": max(cost.peak_rss_gb for cost in stages.values()),
        "disk_gb": sum(cost.disk_gb for cost in stages.values()),
        "seconds": sum(cost.seconds for cost in stages.values()),
        "stages": {name: asdict(cost) for name, cost in stages.items()},
    }


def _groom(config: Config) -> Cost:
    points = config.groom.strands * config.groom.points
    voxels = 0.0 if config.scene.head == "none" else _HEAD_M3 / config.simulate.contact.spacing**3
    seconds = _START_S + (_GROOM_S_PER_POINT * points + _HEAD_S_PER_VOXEL * voxels) * _slower()
    strands = config.groom.strands
    stored = (12 * points + _GROOM_ROW * strands) * _GROOM_DEFLATED + 4 * voxels * _DEFLATED
    head = _HEAD_STORED_GB if voxels else 0.0
    chunk = _GROOM_CHUNK_GB * min(1.0, strands / _GROOM_CHUNK)
    memory = _START_GB + _GROOM_GB + chunk + _GROOM_B_PER_STRAND * strands / _GB
    return Cost(memory, head + stored / _GB, seconds)


def _simulate(config: Config) -> Cost:
    simulate = config.simulate
    points = config.groom.guides * config.groom.points
    steps = (simulate.frames + simulate.settle * simulate.fps) * simulate.substeps
    seconds = _START_S + _STEP_S_PER_POINT[simulate.precision] * points * steps * _slower()
    return Cost(
        _START_GB + (_GUIDE_B_PER_POINT * points + _READ_B_PER_STRAND * config.groom.strands) / _GB,
        simulate.frames * simulate.states * 12 * points * _DEFLATED / _GB,
        seconds,
    )


def _interpolate(config: Config) -> Cost:
    strands = _strands(config)
    row = 28 + 8 * config.interpolate.guides_per_strand
    read = _READ_B_PER_STRAND * config.groom.strands
    return Cost(
        _START_GB + 0.012 + (_BIND_B_PER_STRAND * strands + read) / _GB,
        row * strands * _BOUND_DEFLATED / _GB,
        _START_S + _BIND_S_PER_STRAND * strands,
    )


def _render(config: Config) -> Cost:
    from pipeline.render.chunks import CHUNK, KEPT

    render, frames = config.render, config.simulate.frames
    strands = min(render.strands or _strands(config), _strands(config))
    points = strands * config.groom.points * render.subdivide
    pixels = render.size[0] * render.size[1]
    samples = pixels * render.samples**2
    frame = _RENDER_S_PER_POINT * points * _slower() + _RENDER_S_PER_SAMPLE * samples * _slower()
    camera = config.scene.camera
    if camera.shutter or camera.f_stop is not None:
        frame *= render.passes
    all_points = 12 * strands * config.groom.points
    kept = min(all_points, KEPT)
    in_flight = points * min(1.0, CHUNK / strands)
    own = min(config.groom.strands, _strands(config))
    shapes = 12 * own * config.groom.points + _BOUND_B * _strands(config)
    memory = kept + shapes + _RENDER_B_PER_POINT * in_flight + _RENDER_B_PER_SAMPLE * samples
    memory += _RENDER_B_PER_SEGMENT * points + _light(config)
    return Cost(
        _START_GB + _VTK_GB + memory / _GB,
        frames * pixels * _PNG_B_PER_PIXEL / _GB,
        _START_S + frames * frame,
    )


def _light(config: Config) -> float:
    """Bytes of shadow maps and grids."""
    from pipeline.render.geometry import drawn_width, one_fibre_each
    from pipeline.render.lighting import pieces, told_apart
    from pipeline.render.lights import as_directions

    render = config.render
    count = min(render.strands or _strands(config), _strands(config))
    points = count * ((config.groom.points - 1) * render.subdivide + 1)
    strands = points, count * _LENGTH, drawn_width(render, count, _strands(config))
    directions, _ = as_directions(config.scene.lights)
    apart = one_fibre_each(render, count, _strands(config)) and told_apart(*strands, len(directions))
    each = _LIGHT_B_PER_PIECE * pieces(*strands) if apart else 0.0
    each += _NODES * _LIGHT_B_PER_NODE * render.grid**2
    return len(directions) * each + _LIGHT_B_PER_VOXEL * render.grid**3


def _strands(config: Config) -> int:
    return config.interpolate.strands or config.groom.strands


def _slower() -> float:
    return _FITTED_THREADS / len(os.sched_getaffinity(0))
