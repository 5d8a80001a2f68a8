"""How fast strands are expanded from guides: a full head of wavy hair in a swing, kept out of a round head."""

import resource
import time

import numpy as np
from numpy.typing import NDArray

from pipeline import kernels
from pipeline.config.schema import Interpolate
from pipeline.interpolate.bind import Groom, bind
from pipeline.interpolate.copies import Roots
from pipeline.strands.chart import Chart
from pipeline.strands.expand import Binding, Expansion, Style
from pipeline.strands.follow import GuideSet, shape_of
from pipeline.strands.partings import Neighbours, Partings
from pipeline.strands.random import uniform

Points = NDArray[np.float32]

HEAD = 0.1  # radius [m]
_LENGTH = 0.25
_LAYER = 0.01  # height [m] at which hair lies on the head
_ABOVE = Chart.from_above()
_PARTED = np.array([[0.0, -1.0], [0.0, 1.0]])  # in that chart
_GROOM = 20_000
_GUIDES = 1_000
_CHUNK = 16_384
_REPEATS = 5


def bench(strands: int = 1_000_000, points: int = 32, threads: int | None = None) -> dict[str, float]:
    """Expand all strands of a frame in chunks, as render does: guides' rotations, variation, distance to the head.

    Returns seconds_per_frame (median over repeats, every frame another pose of the guides), peak_rss_gb of the
    process, seconds_to_bind (once for a run) and threads.
    """
    kernels.set_threads(threads or 0)
    groom, rest = round_groom(min(_GROOM, strands), points, min(_GUIDES, strands))
    start = time.perf_counter()
    binding = whole(groom, Interpolate(strands=strands), seed=1)
    bound = time.perf_counter() - start
    guides = rest[groom.guides.strand]
    expansion = Expansion(rest, guides, binding, groom.roots.field, Style(clump=0.25, frizz=0.03))
    buffer = np.empty((_CHUNK, points, 3), np.float32)
    seconds = [_frame(expansion, swung(guides, 0.6 + 0.05 * i), buffer) for i in range(1 + _REPEATS)][1:]
    return {
        "seconds_per_frame": round(float(np.median(seconds)), 4),
        "peak_rss_gb": round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20, 3),
        "seconds_to_bind": round(bound, 3),
        "threads": kernels.threads(),
    }


def whole(groom: Groom, interpolate: Interpolate, seed: int) -> Binding:
    """The binding of all strands in one piece."""
    chunks = list(bind(groom, interpolate, seed))
    names = ("parent", "root", "guide", "weight", "key", "scale", "phase")
    return Binding(**{name: np.concatenate([getattr(chunk, name) for chunk in chunks]) for name in names})


def round_groom(strands: int, points: int, guides: int) -> tuple[Groom, Points]:
    """Wavy strands (S, P, 3) that grow from the upper half of a sphere, lie on it and hang, parted at x = 0."""
    root = HEAD * _upper_half(strands)
    rest = _combed(root, points, 2 * np.pi * uniform(1, np.arange(strands), 0))
    root = rest[:, 0].astype(np.float64)  # as a groom.h5 has it
    strand = np.arange(guides, dtype=np.uint32)
    partings = Partings(_ABOVE, (_PARTED,))
    chosen = GuideSet(Neighbours(root[strand], partings), shape_of(rest[strand]), strand)
    key = np.arange(strands, dtype=np.uint32)
    return Groom(lambda a, b: rest[a:b], Roots(root, partings, sphere()), key, chosen), rest


def _combed(root: NDArray[np.float64], points: int, phase: NDArray[np.float64]) -> Points:
    """Step by step down, along the head's surface where it is near, with a wave to the side."""
    spacing = _LENGTH / (points - 1)
    outwards = root / HEAD
    across = np.cross(outwards, [0.0, 1.0, 0.0])
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    rest = [root]
    for j in range(points - 1):
        normal = rest[-1] / np.linalg.norm(rest[-1], axis=1, keepdims=True)
        height = np.linalg.norm(rest[-1], axis=1) - HEAD - _LAYER
        steer = (
            np.array([0.0, -1.0, 0.0]) + across * np.sin(2 * np.pi * j * spacing / 0.05 + phase)[:, None] / 4
        )
        inwards = np.minimum((steer * normal).sum(axis=1), 0) * np.exp(-np.maximum(height, 0) / _LAYER)
        steer -= (inwards + np.minimum(height, 0) / _LAYER)[:, None] * normal
        rest.append(rest[-1] + spacing * steer / np.linalg.norm(steer, axis=1, keepdims=True))
    return np.stack(rest, axis=1).astype(np.float32)


def swung(guides: Points, angle: float) -> Points:
    """Guides whose segments have turned about z, by `angle` [rad] at the tip and not at all at the root."""
    edge = np.diff(guides.astype(np.float64), axis=1)
    turn = angle * np.linspace(0, 1, edge.shape[1])
    c, s = np.cos(turn), np.sin(turn)
    x, y, z = np.moveaxis(edge, 2, 0)
    points = np.empty(guides.shape, np.float32)
    points[:, 0] = guides[:, 0]
    points[:, 1:] = guides[:, :1] + np.cumsum(np.stack([c * x - s * y, s * x + c * y, z], axis=2), axis=1)
    return points


def sphere(spacing: float = 3e-3) -> kernels.DistanceField:
    """Distance to the round head."""
    axis = np.arange(-0.15, 0.15 + spacing, spacing)
    x, y, z = np.meshgrid(axis, axis, axis, indexing="ij")
    distance = np.sqrt(x**2 + y**2 + z**2) - HEAD
    return kernels.DistanceField(distance.astype(np.float32), np.full(3, axis[0]), spacing)


def _frame(expansion: Expansion, guides: Points, buffer: Points) -> float:
    start = time.perf_counter()
    expansion.frame(guides, np.eye(4))
    for a in range(0, expansion.count, len(buffer)):
        b = min(a + len(buffer), expansion.count)
        expansion.chunk(a, b, buffer[: b - a])
    return time.perf_counter() - start


def _upper_half(count: int) -> NDArray[np.float64]:
    """Points of a sphere's upper half (n, 3); any prefix is evenly spread (a sequence of low discrepancy)."""
    index = np.arange(count) + 0.5
    height, turn = index * 0.7548776662466927 % 1, 2 * np.pi * (index * 0.5698402909980532 % 1)
    radius = np.sqrt(1 - height**2)
    return np.stack([radius * np.cos(turn), height, radius * np.sin(turn)], axis=-1)
