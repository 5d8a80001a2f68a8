"""A skin that deforms: nothing goes below it, friction holds to it, roots go with it, and a rigid one is the same head."""

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from strand_scenes import (
    FREE,
    STILL,
    drive,
    field,
    ground,
    rotation,
    settings,
    shape,
    sphere,
    turned,
)

from pipeline import kernels

Points = NDArray[np.float64]
HALF, SPACING = 0.128, 0.004


@cache
def nodes() -> Points:
    axis = np.linspace(-HALF, HALF, round(2 * HALF / SPACING) + 1)
    return np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1)


def deformation(
    before: kernels.DistanceField, after: Callable[[Points], Points], drift: Callable[[Points], Points]
) -> kernels.Deformation:
    """The second frame from formulas of its distance and of how the skin moves, (..., 3) -> (...) and (..., 3)."""
    values, moved = after(nodes()), np.moveaxis(drift(nodes()), -1, 0)
    return kernels.Deformation(before, values.astype(np.float32), np.ascontiguousarray(moved, np.float32))


def skin_drive(
    steps: int, change: kernels.Deformation, roots: Callable[[float], Points], strands: int
) -> kernels.Drive:
    """From the first frame to the second in so many steps; `roots` (3, 4) at a blend."""
    blend = np.linspace(0, 1, steps + 1)
    each = np.stack([np.broadcast_to(roots(float(w)), (strands, 3, 4)) for w in blend])
    still = np.tile(np.eye(4), (steps + 1, 1, 1))
    return kernels.Drive(still, np.zeros((steps, 3)), None, np.ascontiguousarray(each), change, blend)


def still(_: float) -> Points:
    return np.eye(4)[:3]


def ball(radius: float, centre: Points | float = 0.0) -> Callable[[Points], Points]:
    return lambda x: np.linalg.norm(x - centre, axis=-1) - radius


def lying(count: int = 12) -> Points:
    """Straight strands laid down the sides of the sphere from near its top, from where they hang on."""
    along = np.linspace(0, 0.2, 32)
    angle = 0.3 + along / 0.091
    out, up = 0.091 * np.sin(np.minimum(angle, np.pi / 2)), 0.091 * np.cos(np.minimum(angle, np.pi / 2))
    up = up - 0.091 * np.maximum(angle - np.pi / 2, 0)
    turn = 2 * np.pi * np.arange(count)[:, None] / count
    return np.stack([out * np.cos(turn), up + 0 * turn, out * np.sin(turn)], axis=-1)


def groom(count: int = 12, precision: type = np.float64) -> tuple[kernels.RestShape, kernels.State]:
    """Strands at rest on the sphere, flatter at rest than it is."""
    points = lying(count)
    state = kernels.at_rest(points.astype(precision))
    rest = shape(points)
    rest.curvature = 0.9 * rest.curvature
    return rest, state


def test_a_skin_that_does_not_change_is_a_rigid_head() -> None:
    results = []
    for deforming in (False, True):
        rest, state = groom()
        for _ in range(12):
            at_rest = deformation(sphere(), ball(0.09), np.zeros_like)
            move = skin_drive(10, at_rest, still, 12) if deforming else drive(10)
            kernels.advance(state, rest, sphere(), move, settings())
        results.append(state.points)
    print(f"differs by {np.abs(results[0] - results[1]).max():.1e} m")
    assert np.abs(results[0] - results[1]).max() < 1e-12


@pytest.mark.parametrize("precision", [np.float32, np.float64])
@pytest.mark.parametrize("steps", [1, 10])
def test_a_skin_that_swells_pushes_all_hair_out(steps: int, precision: type) -> None:
    """By 12 mm in a frame, hair that was near and hair that was far."""
    rest, state = groom(12, precision)
    step = settings(dt=1 / 24 / steps)
    kernels.advance(state, rest, sphere(), drive(round(0.5 / step.dt)), step)

    def swelling(x: Points) -> Points:
        return 0.012 * x / np.maximum(np.linalg.norm(x, axis=-1, keepdims=True), 1e-6)

    roots = lying()[:, 0]
    out = roots / np.linalg.norm(roots, axis=1, keepdims=True)
    blend = np.linspace(0, 1, steps + 1)
    maps = np.tile(np.eye(4)[:3], (steps + 1, 12, 1, 1))
    maps[..., 3] = 0.012 * blend[:, None, None] * out
    head = sphere()
    change = deformation(head, ball(0.102), swelling)
    move = kernels.Drive(
        np.tile(np.eye(4), (steps + 1, 1, 1)),
        np.zeros((steps, 3)),
        None,
        np.ascontiguousarray(maps),
        change,
        blend,
    )
    report = kernels.advance(state, rest, head, move, step)
    height = np.linalg.norm(state.points[:, 2:].astype(float), axis=2).min() - 0.102
    print(
        f"{steps} steps: depth {report.depth * 1e3:.3f} mm, lowest point {height * 1e3:.3f} mm above, {report.contacts}"
    )
    assert report.depth <= 1e-4
    assert report.strain <= 1.001e-4
    assert report.contacts > 5
    assert height > 1e-3 - 2e-4


def test_a_skin_that_is_carried_moves_hair_as_a_head_that_is_carried() -> None:
    """2 mm a frame: the blend of two spheres is a sphere to 6 um."""
    way, steps, results = np.array([0.002, 0.0005, 0.0]), 10, []
    head = sphere()
    for rigid in (True, False):
        rest, state = groom()
        kernels.advance(state, rest, head, drive(120), settings())
        if rigid:

            def pose(k: int) -> Points:
                moved = np.eye(4)
                moved[:3, 3] = k / steps * way
                return moved

            report = kernels.advance(state, rest, head, drive(steps, pose), settings())
        else:
            change = deformation(head, ball(0.09, way), lambda x: np.broadcast_to(way, x.shape))
            moving = skin_drive(steps, change, lambda w: np.column_stack([np.eye(3), w * way]), 12)
            report = kernels.advance(state, rest, head, moving, settings())
        results.append((state.points, state.velocity, report.contacts))
    apart = np.linalg.norm(results[0][0] - results[1][0], axis=2)
    print(
        f"positions differ by {np.median(apart) * 1e3:.4f} mm (median), contacts {results[0][2]}, {results[1][2]}"
    )
    assert results[1][2] > 5
    assert np.median(apart) < 5e-5  # cells of 4 mm cut 22 um off a sphere, elsewhere when it is elsewhere
    assert np.quantile(apart, 0.9) < 3e-4


def test_stuck_hair_goes_with_the_skin_under_it() -> None:
    """Ground that turns in itself by half a radian a second: its distance does not change, the skin does."""
    points = np.zeros((1, 16, 3))
    points[0, :, 0], points[0, :, 1] = np.linspace(0.0, 0.05, 16), 1e-3
    rest, state, steps = shape(points, held=np.zeros((1, 16), np.uint8)), kernels.at_rest(points), 10
    flat = ground()
    about = rotation((0, 1, 0), 0.5 * steps / 240) - np.eye(3)
    frames = 12
    for _ in range(frames):
        change = deformation(flat, lambda x: x[..., 1], lambda x: x @ about.T)
        move = skin_drive(steps, change, still, 1)
        kernels.advance(state, rest, flat, move, settings(**STILL, friction=1.0))
    expected = points[0] @ rotation((0, 1, 0), 0.5 * steps / 240 * frames).T
    slipped, moved = np.abs(state.points[0] - expected).max(), np.abs(expected - points[0]).max()
    print(f"slipped {slipped * 1e3:.4f} mm of {moved * 1e3:.1f} mm")
    assert moved > 0.01
    assert slipped < 3e-4


@pytest.mark.parametrize("torsion", ["rotor", "kirchhoff"])
def test_roots_and_their_directors_turn_with_their_own_patch_of_skin(torsion: str) -> None:
    """Without a head to touch: turning all roots is turning the head."""
    steps, axis, angle = 40, (0.3, 1.0, 0.2), 0.5
    results = []
    for own in (False, True):
        rest, state = groom(5)
        step: Any = settings(torsion=torsion, **FREE)
        if own:
            maps = np.stack([turned(axis, angle * k / steps)[:3] for k in range(steps + 1)])
            roots = np.ascontiguousarray(np.broadcast_to(maps[:, None], (steps + 1, 5, 3, 4)))
            still = np.tile(np.eye(4), (steps + 1, 1, 1))
            move = kernels.Drive(still, np.zeros((steps, 3)), None, roots)
        else:
            move = drive(steps, lambda k: turned(axis, angle * k / steps))
        kernels.advance(state, rest, None, move, step)
        results.append((state.points, state.directors))
    apart = [np.abs(a - b).max() for a, b in zip(*results, strict=True)]
    print(f"{torsion}: points differ by {apart[0]:.1e} m, directors by {apart[1]:.1e}")
    assert apart[0] < 1e-9
    assert apart[1] < 1e-6


def test_what_does_not_fit_is_refused() -> None:
    head, steps = sphere(), 3
    change = deformation(head, ball(0.09), np.zeros_like)
    still, wind = np.tile(np.eye(4), (steps + 1, 1, 1)), np.zeros((steps, 3))
    with pytest.raises(ValueError, match="needs blend"):
        kernels.Drive(still, wind, None, None, change)
    with pytest.raises(ValueError, match="roots"):
        kernels.Drive(still, wind, None, np.zeros((2, 5, 3, 4)))
    rest, state = groom(4)
    with pytest.raises(ValueError, match="another number of strands"):
        kernels.advance(state, rest, head, skin_drive(steps, change, lambda _: np.eye(4)[:3], 5), settings())
    with pytest.raises(ValueError, match="the field that it begins with"):
        kernels.advance(state, rest, None, skin_drive(steps, change, lambda _: np.eye(4)[:3], 4), settings())
    small = field(lambda x: np.linalg.norm(x, axis=1) - 0.09, half=0.1)
    with pytest.raises(ValueError, match="on the nodes of before"):
        kernels.Deformation(
            small, np.zeros(nodes().shape[:3], np.float32), np.zeros((3, 65, 65, 65), np.float32)
        )
