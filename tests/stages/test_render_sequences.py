"""Frames of a sequence: motion blur is the mean of real states, and no frame depends on which others are made."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from pipeline import cache
from pipeline.config.schema import (
    Camera,
    Config,
    Groom,
    HairContact,
    Interpolate,
    Motion,
    Render,
    Scene,
    Simulate,
    Swatch,
)
from pipeline.groom import stage as groom_stage
from pipeline.interpolate import stage as interpolate_stage
from pipeline.render import stage as render_stage
from pipeline.render.passes import mean, passes
from pipeline.render.tone import develop
from pipeline.simulate import stage as simulate_stage

CAMERA = Camera(position=(0.0, -0.08, 0.5), look_at=(0.0, -0.08, 0.0), shutter=np.pi, turntable=0.3)


@pytest.fixture(scope="module")
def swinging(tmp_path_factory: pytest.TempPathFactory) -> tuple[Config, cache.Experiment]:
    """A swatch that is turned to and fro, with five states a frame."""
    config = Config(
        name="swinging",
        scene=Scene(head="none", camera=CAMERA),
        groom=Groom(source="swatch", strands=60, guides=20, points=12, swatch=Swatch()),
        simulate=Simulate(
            frames=3,
            settle=0.05,
            states=5,
            hair_contact=HairContact(method="none"),
            motion=Motion(preset="shake", period=0.25),
        ),
        interpolate=Interpolate(guides_per_strand=2),
        render=Render(size=(64, 64), grid=32, passes=10),
    )
    experiment = cache.Experiment(tmp_path_factory.mktemp("swinging"))
    for stage in (groom_stage, simulate_stage, interpolate_stage, render_stage):
        stage.execute(config, experiment, "key")
    return config, experiment


def pixels(path: Path) -> np.ndarray:
    with Image.open(path) as image:
        return np.asarray(image.convert("RGB")).astype(int)


def test_frames_do_not_depend_on_which_are_made_together(
    swinging: tuple[Config, cache.Experiment], tmp_path: Path
) -> None:
    config, made = swinging
    for name in ("groom", "guides", "strands"):
        (tmp_path / f"{name}.h5").symlink_to(getattr(made, name))
    apart = cache.Experiment(tmp_path)
    render_stage.execute(config, apart, "key", (2,))
    with render_stage.open_frames(config, apart, "key") as frames:
        frames.render((3,))
        frames.render((1,))
    for number in (1, 2, 3):
        name = f"{number:04d}.png"
        assert (made.frames / name).read_bytes() == (apart.frames / name).read_bytes()


def test_a_blurred_frame_is_the_mean_of_its_states(swinging: tuple[Config, cache.Experiment]) -> None:
    config, made = swinging
    with render_stage.open_frames(config, made, "key") as frames:
        shots = list(passes(config, frames.path, 3))
        moments = {back: frames.source.read(3, back) for back in {shot.back for shot in shots}}
        apart = [frames.renderer.linear(moments[shot.back], shot.view).copy() for shot in shots]
    blurred = develop(mean(iter(picture.copy() for picture in apart)), config.render.exposure)
    assert sorted({shot.back for shot in shots}) == [0, 1, 2]
    assert np.array_equal(blurred, pixels(made.frames / "0003.png"))
    sharp = np.abs(apart[0] - apart[-1]).max() / np.ptp(apart[0])
    print(f"between the first and the last state a pixel changes by up to {100 * sharp:.0f} % of the range")
    assert sharp > 0.1
