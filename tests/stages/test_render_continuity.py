"""Nothing pops or flickers: in a zoom from shape to shape, under a camera that moves, in hair that moves."""

import numpy as np
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
    points = [x[:, None] + waves[0] + sway * t**2, 0.03 - 0.08 * t + 0 * waves[0], z[:, None] + waves[1]]
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
