"""Colour of hair: dye, gradients from root to tip, strands that differ."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from test_render_frame import config, hanging, render

from pipeline.config.schema import Dye, Fibre, Light, Scene, Stop
from pipeline.render import pigment
from pipeline.render.fibre import Scattering
from pipeline.render.lighting import Lighting

_F32 = NDArray[np.float32]

SUN = Scene(lights=(Light(direction=(0, 0.3, 1), irradiance=2.0),), environment=(0.2, 0.2, 0.2))
WHITE: dict[str, Any] = {"melanin": 0.0, "melanin_jitter": 0.0, "glints": False}
EYE = np.array([0.0, 0.0, 0.6])
GREEN = Dye(colour=(0.2, 0.7, 0.25))


def shaded(points: _F32, scene: Scene = SUN, **hair: Any) -> _F32:
    """Linear RGB (S, P, 3) of strands (S, P, 3) with these options."""
    fibre = Fibre.model_validate(hair)
    lighting = Lighting(scene, fibre, 32)
    lighting.begin(points.min((0, 1)).astype(float), points.max((0, 1)).astype(float), 2e-4)
    lighting.add(points, np.full(points.shape[:2], 2e-4, np.float32))
    lighting.finish(None, np.eye(4))
    key = np.arange(len(points), dtype=np.uint32)
    which = np.arange(points[..., 0].size, dtype=np.uint32)
    return lighting.shade(points, pigment.variation(fibre, 1, key), key, EYE, which).reshape(points.shape)


def curtain() -> _F32:
    """Three hundred strands in a layer 2 cm thick."""
    points = np.concatenate([hanging(50, depth) for depth in np.linspace(-0.02, 0, 6)])
    points[:, 1:-1, 0] += 2e-3 * np.random.default_rng(3).normal(size=(len(points), 1)).astype(np.float32)
    return points


@pytest.mark.parametrize("geometry", ["coverage", "ribbons"])
def test_a_dye_of_no_amount_changes_no_byte(geometry: str) -> None:
    plain, none, some = (
        render(config(geometry=geometry, width=1e-3, hair=Fibre(dye=dye)), hanging(20))
        for dye in (None, GREEN.model_copy(update={"amount": 0.0}), GREEN)
    )
    assert np.array_equal(plain, none)
    assert not np.array_equal(plain, some)


@pytest.mark.parametrize("geometry", ["coverage", "lines", "ribbons", "tubes"])
def test_a_gradient_reaches_every_geometry_with_its_two_colours(geometry: str) -> None:
    """Roots, above in the picture, are green, tips are red."""
    hair = Fibre(
        **WHITE | {"redness": 1.0},
        dye=GREEN,
        along=(Stop(at=0.4, dye=1, melanin=0), Stop(at=0.6, dye=0, melanin=0.8)),
    )
    settings = config(geometry=geometry, width=1e-3, hair=hair)
    black = settings.scene.model_copy(update={"background": (0, 0, 0)})
    picture = render(settings.model_copy(update={"scene": black}), hanging(120)).astype(float)
    root, tip = picture[25:35, 30:66].mean((0, 1)), picture[61:71, 30:66].mean((0, 1))
    print(f"{geometry}: root {root.round()}, tip {tip.round()}")
    assert root[1] > 1.15 * max(root[0], root[2])
    assert tip[0] > 1.15 * max(tip[1], tip[2])


def test_root_and_tip_of_a_gradient_are_as_hair_of_one_colour() -> None:
    hair: dict[str, Any] = {"melanin_jitter": 0.0, "glints": False, "dye": GREEN}
    dark, light = {"melanin": 0.8, "roughness": 0.3}, {"melanin": 0.1, "roughness": 0.4}
    along = (Stop(at=0.2, **dark, dye=0), Stop(at=0.8, **light, dye=1))
    points, night = curtain(), SUN.model_copy(update={"environment": (0, 0, 0)})
    both = shaded(points, night, along=along, **hair)
    roots = shaded(points, night, **dark, **hair | {"dye": None})[:, :3]
    # The same fibre, which sets what roughness is relative to
    tips = shaded(points, night, **dark | {"melanin": 0.1}, along=(Stop(at=0, roughness=0.4),), **hair)[
        :, -3:
    ]
    for found, alone in ((both[:, :3], roots), (both[:, -3:], tips)):
        assert np.abs(found - alone).max() < 1e-5 * alone.max()
    middle = both[:, 7:9].mean((0, 1)) / (roots.mean((0, 1)) + tips.mean((0, 1)))
    print("root", roots.mean((0, 1)), "tip", tips.mean((0, 1)), "middle by their sum", middle)
    assert ((middle > 0) & (middle < 1)).all()


def test_stops_that_say_the_same_change_nothing() -> None:
    points = curtain()
    same = tuple(Stop(at=at, melanin=0.5, redness=0.3, roughness=0.3) for at in (0, 0.5, 1))
    plain = shaded(points, melanin=0.5, redness=0.3)
    assert np.array_equal(plain, shaded(points, melanin=0.5, redness=0.3, along=same, along_jitter=0.3))


@pytest.mark.parametrize("colour", [(0.8, 0.3, 0.5), (0.2, 0.35, 0.8), (0.15, 0.6, 0.3), (0.9, 0.8, 0.6)])
def test_much_white_hair_shows_the_colour_of_its_dye(colour: tuple[float, float, float]) -> None:
    """Two-flux reflectance of a half space, and the picture's hue: the share of each channel."""
    sigma = pigment.dye_absorption(colour, 0.3)
    sums = Scattering(0.3, 0.3, 0.0)
    a_f, a_b = (np.interp(np.sqrt(sigma), np.sqrt(sums.levels), sums.sums[:, 0, i]) for i in range(2))
    b = 1 + a_b**2 - a_f**2
    half_space = (b - np.sqrt(b**2 - 4 * a_b**2)) / (2 * a_b)
    linear = np.array([((c + 0.055) / 1.055) ** 2.4 for c in colour])
    seen = shaded(curtain(), **WHITE, dye=Dye(colour=colour)).mean((0, 1))
    print(f"dye {linear.round(3)}: half space {half_space.round(3)}, seen {seen.round(3)}")
    assert np.argsort(seen).tolist() == np.argsort(linear).tolist()
    assert np.abs(half_space - linear).max() < 0.13
    assert np.argsort(half_space).tolist() == np.argsort(linear).tolist()


def test_white_dye_takes_nothing_and_every_other_only_takes() -> None:
    points = curtain()
    plain = shaded(points, **WHITE)
    assert np.array_equal(plain, shaded(points, **WHITE, dye=Dye(colour=(1, 1, 1))))
    dyed = shaded(points, **WHITE, dye=GREEN)
    print(f"dyed by plain, at most {(dyed / plain).max():.4f}")
    assert (dyed <= plain * (1 + 1e-5)).all()


def test_white_hair_that_differs_in_roughness_disappears_in_a_white_sky() -> None:
    sky = Scene(lights=(), environment=(1, 1, 1))
    rough = (Stop(at=0, roughness=0.2), Stop(at=1, roughness=0.6))
    furnace = shaded(curtain(), sky, **WHITE, along=rough, roughness_jitter=0.1)
    print(f"furnace: {np.abs(furnace - 1).max():.1e}")
    assert np.abs(furnace - 1).max() < 1e-4


def test_strands_differ_by_their_key_alone() -> None:
    hair = Fibre(melanin_jitter=0.1, roughness_jitter=0.05, along_jitter=0.1)
    key = np.arange(20_000, dtype=np.uint32)
    all_of = pigment.variation(hair, 1, key)
    assert np.array_equal(pigment.variation(hair, 1, key[500:600]), all_of[500:600])
    print(f"means {all_of.mean(0)}, deviations {all_of.std(0)}")
    assert all_of[:, 0].mean() == pytest.approx(0.5, abs=0.01)
    assert all_of[:, 2].std() == pytest.approx(0.1, rel=0.15)
    assert np.abs(np.corrcoef(all_of.T) - np.eye(3)).max() < 0.02


def test_roughness_that_differs_spreads_highlights() -> None:
    points = hanging(2000)
    same = shaded(points, roughness=0.3, melanin=0.9, melanin_jitter=0, glints=False)[:, 8, 1]
    differ = shaded(
        points, roughness=0.3, roughness_jitter=0.05, melanin=0.9, melanin_jitter=0, glints=False
    )[:, 8, 1]
    more = np.sqrt(differ.var() - same.var()) / same.mean()
    print(f"highlights differ by {more:.3f} of their mean")
    assert more > 0.04


@pytest.mark.parametrize(
    "wrong",
    [
        {"along": [{"at": 0.5, "melanin": 0.2}, {"at": 0.5, "melanin": 0.3}]},
        {"along": [{"at": 0.5, "dye": 1}]},
        {"dye": {"amount": 1}},
        {"dye": {"colour": [1.5, 0, 0]}},
    ],
)
def test_wrong_colours_are_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match=r"each `at` is greater|dye\.colour|required|less than or equal"):
        Fibre.model_validate(wrong)
