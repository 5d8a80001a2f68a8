"""Nothing pops or flickers: in a zoom from shape to shape, under a camera that moves, in hair that moves."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray
from test_render_frame import config, expansion

from pipeline.render.frame import FrameRenderer, Moment
from pipeline.render.view import View

Points = NDArray[np.float32]
STRANDS, POINTS = 160, 20
MIDDLE = np.array([0.0, -0.01, 0.0])


def lock(sway: float = 0.0) -> Points:
    """A lock of wavy strands, the lower the farther swung to the side [m at the tips]."""
    rng = np.random.default_rng(2)
    x, z, phase = (
        rng.uniform(-0.03, 0.03, STRANDS),
        rng.uniform(-0.01, 0.01, STRANDS),
        rng.uniform(0, 6, STRANDS),
    )
    t = np.linspace(0, 1, POINTS)
    waves = [0.004 * f(7 * t + phase[:, None]) for f in (np.sin, np.cos)]
    points = [x[:, None] + waves[0] + sway * t**2, 0.031 - 0.083 * t + 0 * waves[0], z[:, None] + waves[1]]
    return np.stack(points, axis=-1).astype(np.float32)


def renderer(**render: object) -> FrameRenderer:
    settings = config(**({"size": (120, 120), "grid": 48, "width": 5e-4} | render))
    keys = (np.arange(STRANDS, dtype=np.uint64) * 2654435761 % 2**32).astype(np.uint32)
    return FrameRenderer(settings, expansion(lock()), keys)


def from_distance(distance: float) -> View:
    return View(MIDDLE + np.array([0, 0, distance]), MIDDLE, (0.0, 1.0, 0.0), 0.35)


def apart(a: Points, b: Points) -> float:
    """Mean difference of pictures as they are seen, about."""
    return float(np.abs(np.sqrt(np.maximum(a, 0)) - np.sqrt(np.maximum(b, 0))).mean())


def test_nothing_pops_in_a_zoom_from_coverage_to_tubes() -> None:
    """A step of 0.1 % closer changes the picture as in a zoom of one shape, wherever `auto` stands between both."""
    moment = Moment(lock(), np.eye(4))
    step, widths = 1e-3, (2.999, 3.2, 3.5, 3.8, 3.999)
    one_px = 5e-4 * 120 / (2 * np.tan(0.175))  # distance [m] where a strand is 1 px wide
    changes: dict[str, list[float]] = {}
    pictures: dict[str, Points] = {}
    for geometry in ("auto", "coverage", "tubes"):
        drawing = renderer(geometry=geometry)
        for width in widths:
            near, far = (from_distance(one_px / width * part) for part in (1 - step, 1 + step))
            pair = [drawing.linear(moment, view) for view in (near, far)]
            changes.setdefault(geometry, []).append(apart(*pair))
            pictures[geometry] = pair[0]
        drawing.target.close()
    usual = max(changes["coverage"] + changes["tubes"])
    pop = apart(pictures["coverage"], pictures["tubes"])
    print(f"auto {np.round(changes['auto'], 4)}, one shape {usual:.4f} at most, a switch would be {pop:.4f}")
    assert max(changes["auto"]) < 1.25 * usual
    assert pop > 2 * usual, "the test would see a switch"


def flicker(pictures: list[Points], truths: list[Points]) -> float:
    """Part of the contrast that flickers: what varies over time of the differences from the truth."""
    wrong = np.stack(pictures) - np.stack(truths)
    varying = wrong - wrong.mean(axis=0)
    return float(varying.std() / np.stack(truths).std())


def reduced(picture: Points, times: int) -> Points:
    """Means over times x times pixels."""
    height, width, _ = picture.shape
    return picture.reshape(height // times, times, width // times, times, 3).mean(axis=(1, 3))


def sequence(views: list[View], sways: list[float], scale: int = 1, unstable: bool = False) -> list[Points]:
    """Linear pictures of the swaying lock; with an unstable hash, every frame has other random keys."""
    drawing = renderer(size=(120 * scale, 120 * scale), width=2e-4, samples=1)
    pictures = []
    for number, (view, sway) in enumerate(zip(views, sways, strict=True)):
        if unstable:
            drawing.key = drawing.key * np.uint32(2654435761) + np.uint32(number)
        pictures.append(reduced(drawing.linear(Moment(lock(sway), np.eye(4)), view), scale))
    drawing.target.close()
    return pictures


@pytest.mark.parametrize("told", [0.0, 1.0])
@pytest.mark.parametrize("moving", ["camera", "hair"])
def test_no_flicker_but_that_of_the_truth_at_four_times_the_resolution(
    moving: str, told: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A pixel is 0.6 mm: the camera moves by a third of one a frame, hair tips by half of one.

    Where light goes past single strands, and where, as in hair of many strands, chance tells which of them it meets.
    """
    monkeypatch.setattr("pipeline.render.frame.told_apart", lambda *_: told)
    frames, pixel = 6, 0.2 * 2 * np.tan(0.175) / 120
    still = from_distance(0.2)
    shifts = [
        i * pixel * np.array([0.3, 0.11, 0]) if moving == "camera" else np.zeros(3) for i in range(frames)
    ]
    views = [replace(still, position=still.position + by, look_at=still.look_at + by) for by in shifts]
    sways = [0.5 * pixel * i if moving == "hair" else 0.0 for i in range(frames)]
    truth = sequence(views, sways, scale=4)
    found = flicker(sequence(views, sways), truth)
    unstable = flicker(sequence(views, sways, unstable=True), truth)
    print(
        f"moving {moving}, {told:.0%} of the strands told apart: {100 * found:.2f} % of the contrast flickers, "
        f"{100 * unstable:.1f} % with an unstable hash"
    )
    assert found < 0.025
    assert unstable < 0.05 if told else unstable > 2.5 * found


def test_hair_that_moves_as_a_whole_with_the_camera_keeps_its_light() -> None:
    """The truth is the first picture: neither voxels nor random numbers may swim over the strands."""
    still, pictures = from_distance(0.2), []
    drawing = renderer(width=2e-4, samples=1)
    moves = [i * np.array([3.7e-3, -2.1e-3, 1.3e-3]) for i in range(8)]
    for by in moves:
        view = replace(still, position=still.position + by, look_at=still.look_at + by)
        pose = np.eye(4)
        pose[:3, 3] = by
        pictures.append(drawing.linear(Moment((lock() + by).astype(np.float32), pose), view))
    drawing.target.close()
    found = flicker(pictures, [pictures[0]] * len(pictures))
    changes = [apart(a, b) for a, b in pairwise(pictures)]
    print(f"{100 * found:.2f} % of the contrast flickers; from frame to frame {np.round(changes, 4)}")
    assert found < 0.03


def test_light_does_not_jump_where_its_grids_are_laid_anew() -> None:
    """Hair that grows out of the bounds of the grids gets wider ones, in whole steps of 2 cm: no more is seen of that than
    of tips that move by half a pixel.
    """
    sways = np.linspace(0, 0.05, 2001)
    sides = [np.ceil((lock(sway)[..., 0].max() - lock(sway)[:, 0, 0].mean()) / 0.02) for sway in sways]
    first = next(i for i in range(2000) if sides[i + 1] != sides[i])
    pixel = 0.2 * 2 * np.tan(0.175) / 120
    moved = [sways[first - 1], sways[first], sways[first + 1], sways[first + 1] + pixel / 2]
    drawing, still = renderer(width=2e-4, samples=1), from_distance(0.2)
    pictures = [drawing.linear(Moment(lock(sway), np.eye(4)), still) for sway in moved]
    drawing.target.close()
    plain, anew, half = (apart(a, b) for a, b in pairwise(pictures))
    light = float(pictures[2].mean() / pictures[1].mean()) - 1
    print(
        f"25 um: {plain:.5f}, 25 um and anew: {anew:.5f}, half a pixel: {half:.5f}; light {100 * light:+.3f} %"
    )
    assert anew < half
    assert abs(light) < 2e-3
