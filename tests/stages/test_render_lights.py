"""Lights: presets, and soft ones as sums of directions."""

from pathlib import Path

import numpy as np
import pytest

from pipeline.config import load
from pipeline.config.schema import PRESETS, Light
from pipeline.errors import InputError
from pipeline.render.lights import as_directions, count

CONFIG = '[scene]\nhead = "none"\n{}[groom]\nsource = "swatch"\n'


def scene(folder: Path, text: str = "", *settings: str) -> tuple:
    path = folder / "x.toml"
    path.write_text(CONFIG.format(text))
    loaded = load(path, settings).config.scene
    return loaded.lights, loaded.environment


@pytest.mark.parametrize("name", PRESETS)
def test_a_preset_is_what_is_not_set(tmp_path: Path, name: str) -> None:
    chosen = f'lighting = "{name}"\n'
    assert scene(tmp_path, chosen) == (PRESETS[name].lights, PRESETS[name].environment)
    lights, sky = scene(tmp_path, chosen + "environment = [1, 2, 3]\n")
    assert (lights, sky) == (PRESETS[name].lights, (1, 2, 3))
    lights, sky = scene(tmp_path, chosen + "lights = [{ direction = [1, 0, 0] }]\n")
    assert (lights, sky) == ((Light(direction=(1, 0, 0)),), PRESETS[name].environment)


def test_one_light_of_a_preset_can_be_changed_on_the_command_line(tmp_path: Path) -> None:
    lights, _ = scene(tmp_path, 'lighting = "rim"\n', "scene.lights[1].irradiance=2")
    expected = list(PRESETS["rim"].lights)
    expected[1] = expected[1].model_copy(update={"irradiance": 2.0})
    assert lights == tuple(expected)


def test_a_preset_that_there_is_not_is_one_clear_error(tmp_path: Path) -> None:
    with pytest.raises(InputError) as error:
        scene(tmp_path, 'lighting = "disco"\n')
    print(error.value)
    assert str(error.value).count("\n") == 0
    assert "x.toml:3: scene.lighting" in str(error.value)


@pytest.mark.parametrize("degrees", [0.0, 0.5, 5.0, 40.0, 120.0, 180.0])
def test_a_soft_light_lights_a_facing_surface_as_a_sharp_one(degrees: float) -> None:
    light = Light(direction=(1, -2, 0.5), colour=(1, 0.5, 0.25), irradiance=3, softness=np.radians(degrees))
    directions, irradiance = as_directions([light])
    middle = np.array(light.direction) / np.linalg.norm(light.direction)
    facing = np.maximum(directions @ middle, 0)
    total = facing @ irradiance
    cone = np.degrees(np.arccos(np.clip(directions @ middle, -1, 1))).max()
    print(f"{degrees} degrees: {len(directions)} directions up to {cone:.1f} from the middle, {total}")
    assert len(directions) == count(light.softness)
    assert np.allclose(np.linalg.norm(directions, axis=1), 1, atol=1e-6)
    assert cone <= degrees / 2 + 0.03
    assert cone >= 0.75 * degrees / 2 or len(directions) == 1
    assert np.allclose(total, [3, 1.5, 0.75], rtol=0.02)


def test_the_shadow_of_an_edge_is_as_wide_as_the_light() -> None:
    """Directions past an edge: the part of the light that is seen rises over its whole angle, evenly to 1/8."""
    directions, irradiance = as_directions([Light(direction=(0, 0, 1), softness=np.radians(60))])
    slope = np.degrees(np.arctan2(directions[:, 0], directions[:, 2]))
    edges = np.linspace(-35, 35, 141)
    seen = np.array([irradiance[slope > edge, 0].sum() for edge in edges]) / irradiance[:, 0].sum()
    x = np.clip(np.sin(np.radians(edges)) / np.sin(np.radians(30)), -1, 1)
    disc = np.arccos(x) / np.pi - x * np.sqrt(1 - x**2) / np.pi  # part of a disc beyond a chord
    error = np.abs(seen - disc).max()
    print(f"largest difference from a disc behind an edge {error:.3f}")
    assert error < 0.125
    assert seen[0] == pytest.approx(1)
    assert seen[-1] == pytest.approx(0)


def test_no_lights_are_no_directions() -> None:
    directions, irradiance = as_directions([])
    assert directions.shape == irradiance.shape == (0, 3)
    assert directions.dtype == irradiance.dtype == np.float32
