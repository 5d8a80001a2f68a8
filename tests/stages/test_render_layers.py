"""Layers beside the colours: coverage, depth, tangents and strand numbers of what the picture shows."""

from pathlib import Path

import numpy as np
import pytest
from test_render_frame import EYE, ball, config, expansion, hanging

from pipeline import cache
from pipeline.render import coverage as coverage_module
from pipeline.render.frame import FrameRenderer, Moment, Skin
from pipeline.render.layers import Layers
from pipeline.render.view import View


def rendered(
    rest: np.ndarray, skin: Skin | None = None, **render: object
) -> tuple[np.ndarray, Layers, FrameRenderer]:
    keys = np.arange(len(rest), dtype=np.uint32) * np.uint32(77)
    renderer = FrameRenderer(config(**render), expansion(rest), keys, skin)
    moment = Moment(rest, np.eye(4))
    linear = renderer.linear(moment, renderer.camera)
    layers = renderer.layers(moment, renderer.camera)
    renderer.target.close()
    return linear, layers, renderer


@pytest.mark.parametrize("geometry", ["coverage", "tubes", "ribbons"])
def test_colours_over_their_background_are_the_picture(geometry: str) -> None:
    linear, layers, renderer = rendered(hanging(24), ball(), geometry=geometry, width=1.5e-3, samples=4)
    channels = layers.channels(linear, renderer.background)
    colour = np.stack([channels[name] for name in "RGB"], axis=-1).astype(np.float32)
    again = colour + (1 - channels["A"].astype(np.float32))[..., None] * renderer.background
    bare = channels["A"] == 0
    print(
        f"{geometry}: off by {np.abs(again - linear).max():.1e}; light left where nothing is {np.abs(colour[bare]).max():.1e}"
    )
    assert np.abs(again - linear).max() < 4e-3
    assert np.abs(colour[bare]).max() < 2e-3
    assert channels["coverage"].max() > 0.5


def test_coverage_is_the_part_of_a_pixel_that_hair_fills() -> None:
    _, layers, _ = rendered(hanging(1), width=0.004, taper=0)
    wide = 0.004 / (2 * 0.6 * np.tan(0.2)) * 96
    row = layers.planes[48, :, 1]
    print(f"a strand {wide:.3f} px wide covers {row.sum():.3f} px of a row")
    assert row.sum() == pytest.approx(wide, rel=5e-3)
    assert np.array_equal(layers.planes[..., 0], layers.planes[..., 1]), "no head, all that is solid is hair"


def test_depth_is_the_distance_along_the_line_of_sight() -> None:
    for depth in (-0.03, 0.05):
        linear, layers, renderer = rendered(hanging(3, depth), width=0.004)
        z = layers.channels(linear, renderer.background)["Z"]
        seen = np.isfinite(z)
        error = np.abs(z[seen] - (EYE[2] - depth)).max()
        print(f"strands at {EYE[2] - depth:.2f} m: off by {error:.1e} m; nothing in {(~seen).sum()} pixels")
        assert error < 1e-5
        assert (~seen).sum() > 1000
    linear, layers, renderer = rendered(hanging(1, -0.04), ball(0.02))
    nearest = layers.channels(linear, renderer.background)["Z"][46:50, 46:50].min()
    print(f"the ball begins at {nearest:.4f} m, expected 0.58")
    assert nearest == pytest.approx(0.58, abs=2e-3)


def test_tangents_go_from_root_to_tip_and_the_head_has_none() -> None:
    linear, layers, renderer = rendered(hanging(5, 0.04), ball(), width=0.004)
    channels = layers.channels(linear, renderer.background)
    way = np.stack([channels[f"tangent.{axis}"] for axis in "XYZ"], axis=-1).astype(np.float32)
    covered = layers.planes[..., 1] > 0.5
    assert np.abs(way[covered] - [0, -1, 0]).max() < 1e-3
    assert np.abs(way[layers.planes[..., 1] == 0]).max() == 0
    assert (layers.planes[..., 0] > layers.planes[..., 1] + 0.5).any(), "the head is solid, and no hair"


def test_a_pixel_names_the_strand_that_covers_most_of_it() -> None:
    """Strands side by side, each in front of a wider picture of the others behind."""
    near, far = hanging(5, 0.0), hanging(5, -0.02)
    _, layers, _ = rendered(np.concatenate([far, near]), width=0.008, taper=0)
    row, hair = layers.strand[48], layers.planes[48, :, 1]
    x = (np.arange(96) + 0.5 - 48) * 2 * 0.6 * np.tan(0.2) / 96
    expected = 6 + np.abs(x[:, None] - np.linspace(-0.05, 0.05, 5)).argmin(axis=1)
    middle = np.abs(x[:, None] - np.linspace(-0.05, 0.05, 5)).min(axis=1) < 0.003
    assert np.array_equal(row[middle], expected[middle])
    assert np.array_equal(row > 0, hair > 0)


def test_layers_do_not_depend_on_the_guess_of_what_is_hidden(monkeypatch: pytest.MonkeyPatch) -> None:
    """With one layer of hair taken for all that is seen, most pixels are drawn again."""
    rest = np.concatenate([hanging(60, z) for z in np.linspace(-0.03, 0.03, 40)])
    found = []
    for guess in (1.0, 1e6):
        monkeypatch.setattr(coverage_module, "_LAYERS", guess)
        _, layers, _ = rendered(rest, width=4e-4)
        found.append(layers)
    assert np.array_equal(found[0].strand, found[1].strand)
    assert np.abs(found[0].planes - found[1].planes).max() < 1e-5


def test_layers_are_those_of_the_moment_that_was_rendered_last() -> None:
    rest = hanging(3)
    renderer = FrameRenderer(config(), expansion(rest), np.zeros(3, np.uint32))
    with pytest.raises(ValueError, match="rendered last"):
        renderer.layers(Moment(rest, np.eye(4)), renderer.camera)
    renderer.target.close()


def test_layers_of_views_add_up_as_their_pictures_do(tmp_path: Path) -> None:
    """The mean of two views, written and read."""
    exr = pytest.importorskip("OpenEXR")
    rest = hanging(3)
    renderer = FrameRenderer(config(width=0.004), expansion(rest), np.zeros(3, np.uint32))
    eye = renderer.camera
    moment = Moment(rest, np.eye(4))
    views = [eye, View(eye.position + np.array([0.05, 0, 0]), eye.look_at, eye.up, eye.field_of_view)]
    pairs = [(renderer.linear(moment, view), renderer.layers(moment, view)) for view in views]
    renderer.target.close()
    both = Layers(sum(layers.planes for _, layers in pairs) / 2, pairs[0][1].strand)
    linear = sum(picture for picture, _ in pairs) / 2
    cache.write_layers(tmp_path / "a.exr", both.channels(linear, renderer.background), "key", {})
    with exr.File(str(tmp_path / "a.exr"), separate_channels=True) as file:
        read = {name: channel.pixels for name, channel in file.channels().items()}
    wanted = {"R", "G", "B", "A", "Z", "coverage", "tangent.X", "tangent.Y", "tangent.Z", "id"}
    assert read.keys() == wanted
    alone = [layers.channels(picture, renderer.background) for picture, layers in pairs]
    for name in ("R", "A", "coverage"):
        error = np.abs(read[name].astype(float) - (alone[0][name].astype(float) + alone[1][name]) / 2).max()
        assert error < 2e-3, name
