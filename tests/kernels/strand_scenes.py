"""What the kernel tests share: grooms of named strands, heads as distance fields, and how to step them."""

from collections.abc import Callable
from typing import Any

import numpy as np
from named_strands import helix
from numpy.typing import NDArray

from pipeline import kernels

Points = NDArray[np.float64]
Report = kernels.Report
RADIUS, DENSITY, YOUNG, SHEAR = 40e-6, 1300.0, 4e9, 0.9e9
BENDING = YOUNG * np.pi * RADIUS**4 / 4
TWISTING = SHEAR * np.pi * RADIUS**4 / 2
MASS_PER_LENGTH = DENSITY * np.pi * RADIUS**2


def rotation(axis: tuple[float, float, float], angle: float) -> Points:
    """Rotation matrix about an axis (Rodrigues)."""
    x, y, z = np.asarray(axis) / np.linalg.norm(axis)
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


def roots(strands: int, points: int, count: int = 2) -> NDArray[np.uint8]:
    """The first `count` points of every strand held by the head."""
    held = np.zeros((strands, points), np.uint8)
    held[:, :count] = 1
    return held


def shape(
    points: Points,
    held: NDArray[np.uint8] | None = None,
    bending: float = BENDING,
    twisting: float = TWISTING,
    offset: float = 1e-3,
) -> kernels.RestShape:
    """The rest shape of (S, P, 3) points of a 40 um fibre."""
    S, P = points.shape[:2]
    each = np.ones(S)
    return kernels.rest_shape(
        np.ascontiguousarray(points),
        MASS_PER_LENGTH * each,
        bending * each,
        twisting * each,
        roots(S, P) if held is None else held,
        np.full((S, P), offset),
    )


def settings(**values: Any) -> kernels.StepSettings:
    """Settings with these values."""
    result = kernels.StepSettings()
    for name, value in values.items():
        setattr(result, name, value)
    return result


STILL: dict[str, Any] = {"drag": 0.0, "drag_speed": 0.0}
"""No air."""
FREE: dict[str, Any] = {**STILL, "damping": 0.0, "gravity": (0.0, 0.0, 0.0)}
"""No air, damping or gravity."""


def drive(
    steps: int, pose: Callable[[int], Points] | None = None, hand: Callable[[int], Points] | None = None
) -> kernels.Drive:
    """Poses of head and hand by step number, no wind."""

    def poses(of: Callable[[int], Points]) -> Points:
        return np.ascontiguousarray([of(k) for k in range(steps + 1)])

    rest = poses(pose or (lambda _: np.eye(4)))
    return kernels.Drive(rest, np.zeros((steps, 3)), poses(hand) if hand else None)


def turned(axis: tuple[float, float, float], angle: float) -> Points:
    """Pose of a rotation about the origin."""
    pose = np.eye(4)
    pose[:3, :3] = rotation(axis, angle)
    return pose


def shake(dt: float, first: int = 0, duration: float = 1.0) -> Callable[[int], Points]:
    """Yaw of +-60 degrees at 2 Hz for a second, then a hard stop."""

    def pose(k: int) -> Points:
        t = (first + k) * dt
        return turned((0, 1, 0), np.pi / 3 * np.sin(4 * np.pi * t) if t <= duration else 0.0)

    return pose


def field(
    distance: Callable[[Points], Points], half: float = 0.128, spacing: float = 0.004
) -> kernels.DistanceField:
    """A distance field from a formula on (n, 3) points."""
    n = round(2 * half / spacing) + 1
    axis = np.linspace(-half, half, n)
    nodes = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1).reshape(-1, 3)
    values = distance(nodes).reshape(n, n, n).astype(np.float32)
    return kernels.DistanceField(values, np.full(3, -half), spacing)


def sphere(radius: float = 0.09) -> kernels.DistanceField:
    """A head that is a sphere."""
    return field(lambda x: np.linalg.norm(x, axis=1) - radius)


def ground() -> kernels.DistanceField:
    """A head that is the half space y < 0."""
    return field(lambda x: x[:, 1])


def hairy_sphere(strand: Points, count: int, radius: float = 0.09, offset: float = 1e-3) -> Points:
    """The strand (along x) `count` times on the upper half of a sphere, turned about its root by the golden angle."""
    i = np.arange(count) + 0.5
    y, azimuth = 1 - i / count, np.pi * (1 + 5**0.5) * i
    r = np.sqrt(1 - y * y)
    normals = np.stack([r * np.cos(azimuth), y, r * np.sin(azimuth)], -1)
    strands = []
    for k, n in enumerate(normals):
        axis = np.cross([1.0, 0, 0], n)
        lift = rotation(tuple(axis), np.arctan2(np.linalg.norm(axis), n[0]))
        strands.append((radius + offset) * n + (strand - strand[0]) @ (lift @ rotation((1, 0, 0), 2.4 * k)).T)
    return np.array(strands)


def curly_head(count: int, precision: type = np.float32) -> tuple[kernels.RestShape, kernels.State]:
    """Curls of 8 mm radius and 25 cm length on a sphere, at rest."""
    points = hairy_sphere(helix(0.008, 0.02, 0.25, 32), count)
    return shape(points), kernels.at_rest(points.astype(precision))


ARRAYS = ("points", "velocity", "tension", "contact", "directors", "twist")
"""What a state consists of."""


def copy(state: kernels.State) -> kernels.State:
    """The state, in arrays of its own."""
    return kernels.State(*(getattr(state, name).copy() for name in ARRAYS))


def same(a: kernels.State, b: kernels.State) -> bool:
    """Whether two states are equal to the last bit."""
    return all(getattr(a, name).tobytes() == getattr(b, name).tobytes() for name in ARRAYS)


def bundle(strand: Points, precision: type = np.float64) -> tuple[kernels.RestShape, kernels.State]:
    """37 strands that hang from roots 7 mm apart on a hexagon, each turned about its axis, at their rest shape."""
    places = [(x + y / 2, y * 0.75**0.5) for y in range(-3, 4) for x in range(-3, 4) if abs(x + y) <= 3]
    hanging = strand @ np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    strands = [
        hanging @ rotation((0, 1, 0), 2.4 * k).T + [7e-3 * x, 0, 7e-3 * z] for k, (x, z) in enumerate(places)
    ]
    points = np.array(strands)
    return shape(points), kernels.at_rest(points.astype(precision))


def width(state: kernels.State) -> float:
    """Width [m] of a hanging bundle: twice the root mean square distance of the lower half from its middle, x sqrt 2."""
    lower = state.points[:, state.points.shape[1] // 2 :, [0, 2]].astype(float)
    return float(2 * np.sqrt(2) * np.sqrt(((lower - lower.mean((0, 1))) ** 2).sum(-1).mean()))
