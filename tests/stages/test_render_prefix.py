"""Level of detail: the first strands of a groom, drawn wider, stand for all of them."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from pipeline.bench.interpolate import round_groom, whole
from pipeline.config.schema import Camera, Config, Groom, Interpolate, Render, Scene
from pipeline.render.frame import FrameRenderer, Moment
from pipeline.render.geometry import drawn_width
from pipeline.strands.expand import Binding, Expansion

STRANDS, POINTS, GUIDES = 12_000, 24, 60
GROOM, REST = round_groom(STRANDS, POINTS, GUIDES)
BINDING = whole(GROOM, Interpolate(), seed=2)
DARK, BRIGHT = 0.0, 0.7  # backgrounds


def picture(background: float, strands: int | None, binding: Binding = BINDING) -> NDArray[np.float64]:
    camera = Camera(position=(0, 0, 1.6), look_at=(0, -0.05, 0), field_of_view=0.4)
    scene = Scene(head="none", camera=camera, background=(background,) * 3)
    render = Render(size=(128, 128), grid=32, width=120e-6, strands=strands)
    config = Config(name="far", scene=scene, groom=Groom(source="swatch"), render=render)
    guides = REST[GROOM.guides.strand]
    renderer = FrameRenderer(config, Expansion(REST, guides, binding), binding.key)
    pixels = renderer.frame(Moment(guides, np.eye(4)))
    renderer.target.close()
    return pixels.astype(np.float64)


def coverage(strands: int | None) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """How much of the background each pixel hides (H, W), and the colour over a dark one (H, W, 3)."""
    dark, bright = picture(DARK, strands), picture(BRIGHT, strands)
    return 1 - (bright - dark).mean(axis=2) / (bright - dark).max(), dark


@pytest.mark.parametrize("part", [2, 4])
def test_a_prefix_covers_what_all_strands_cover(part: int) -> None:
    """Within 2 % of the mean coverage and of the mean colour of all; measured 0.5 and 0.1 %."""
    alpha, colour = coverage(None)
    few, few_colour = coverage(STRANDS // part)
    off, off_colour = few.mean() / alpha.mean() - 1, few_colour.mean() / colour.mean() - 1
    print(f"1/{part} of the strands: coverage {100 * off:+.1f} %, colour {100 * off_colour:+.1f} %")
    assert alpha.mean() > 0.05
    assert abs(off) < 0.02
    assert abs(off_colour) < 0.02


def test_a_prefix_that_is_not_widened_covers_less() -> None:
    fields = ("parent", "root", "guide", "weight", "key", "scale", "phase")
    first = replace(BINDING, **{name: getattr(BINDING, name)[: STRANDS // 4] for name in fields})
    dark, bright = picture(DARK, None, first), picture(BRIGHT, None, first)
    thin = 1 - (bright - dark).mean(axis=2) / (bright - dark).max()
    ratio = thin.mean() / coverage(None)[0].mean()
    print(
        f"a quarter of the strands, as wide as in the whole, covers {100 * ratio:.0f} % of what the whole covers"
    )
    assert ratio < 0.8


def test_the_widths_of_a_prefix_sum_up_to_those_of_the_whole() -> None:
    for render in (Render(), Render(width=1e-4)):
        for count in (50_000, 1_000_000):
            whole_width, part_width = drawn_width(render, count), drawn_width(render, count // 5, count)
            assert part_width * (count // 5) == pytest.approx(whole_width * count)
