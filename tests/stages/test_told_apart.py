"""Light past single strands: how many strands may be for it, what lies between, and strands that are drawn finer."""

import numpy as np
from numpy.typing import NDArray

from pipeline.config.schema import Fibre, Light, Scene
from pipeline.render.geometry import smooth
from pipeline.render.lighting import Lighting, told_apart

_F32 = NDArray[np.float32]
EYE = np.array([0.0, 0.0, 1.0])
SUN = Scene(lights=(Light(direction=(0.3, 0.2, 1), irradiance=3.0),), environment=(0, 0, 0))


def shaded(points: _F32, told: float, cast: _F32 | None = None) -> _F32:
    """Linear RGB (S, P, 3) of strands (S, P, 3), among those that `cast` shadows: themselves."""
    lighting = Lighting(SUN, Fibre(), 32)
    cast = points if cast is None else cast
    low, high = (edge((0, 1)).astype(float) for edge in (cast.min, cast.max))
    lighting.begin(low - 0.01, high + 0.01, 2e-4, cast[..., 0].size, told)
    lighting.add(cast, np.full(cast.shape[:2], 2e-4, np.float32))
    lighting.finish(None, np.eye(4))
    key = np.arange(len(points), dtype=np.uint32)
    which = np.arange(points[..., 0].size, dtype=np.uint32)
    variation = np.full((len(points), 3), 0.5, np.float32)
    return lighting.shade(points, variation, key, EYE, which).reshape(points.shape)


def lock(count: int = 300) -> _F32:
    """Strands that hang side by side, wavy."""
    rng = np.random.default_rng(3)
    y = np.linspace(0, -0.06, 25)
    turn = 120 * y + rng.uniform(0, 1, (count, 1))
    x, z = rng.normal(0, 3e-3, (2, count, 1))
    waves = np.stack([x + 2e-3 * np.cos(turn), y + 0 * turn, z + 2e-3 * np.sin(turn)], axis=-1)
    return np.asarray(waves, np.float32)


def test_there_is_no_step_in_how_many_strands_are_told_apart() -> None:
    """All of few, none of many, and between them 1 % more strands change it for less than a tenth of them."""
    counts = 3000 * 1.01 ** np.arange(700)
    for points, length in ((16, 0.02), (16, 0.3), (200, 0.25)):
        parts = np.array([told_apart(int(n) * points, n * length, 3e-4, 3) for n in counts / points])
        all_of, none = counts[parts == 1].max(), counts[parts == 0].min()
        print(f"{points} points, {length} m: all up to {all_of:.0f} points, none from {none:.0f}")
        assert parts[0] == 1
        assert parts[-1] == 0
        assert (np.diff(parts) <= 0).all()
        assert np.abs(np.diff(parts)).max() < 0.1


def test_between_all_and_none_each_strand_is_one_of_those_that_are_told_apart_or_is_not() -> None:
    points = lock()
    none, some, every = (shaded(points, told) for told in (0.0, 0.4, 1.0))
    as_none, as_every = ((some == other).all(axis=(1, 2)) for other in (none, every))
    different = (none != every).any(axis=(1, 2))
    part = as_every[different].mean()
    print(f"{different.mean():.2f} of the strands differ; of them {part:.2f} are told apart for 0.4")
    assert different.mean() > 0.8
    assert (as_none | as_every).all()
    assert abs(part - 0.4) < 0.1


def test_a_strand_that_is_drawn_finer_does_not_shade_itself() -> None:
    """Alone it is as bright as at its own points, and as it is where nobody shades it."""
    points = lock(1)
    fine = smooth(points, 4)
    alone, apart = shaded(fine, 1.0), shaded(fine, 1.0, fine + np.float32(0.05))
    print(f"alone {alone.mean():.5f}, far from what casts shadows {apart.mean():.5f}")
    assert alone.mean(dtype=np.float64) / apart.mean(dtype=np.float64) > 0.93
    coarse = shaded(points, 1.0)
    np.testing.assert_allclose(alone[:, ::4].mean((0, 1)), coarse.mean((0, 1)), rtol=0.02)
