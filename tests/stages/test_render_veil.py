"""Leaving out what is hidden: nothing that can be seen goes missing, and most of what cannot does."""

import numpy as np

from pipeline.render.veil import HIDDEN, Veil

SPACING = 0.01


def slab(strands: float) -> np.ndarray:
    """A slab of 10 cm that holds this many strands along z, in a box of 40 cm."""
    density = np.zeros((40, 40, 40), np.float32)
    density[:, :, 15:25] = strands / 0.1
    return density


def line(z: np.ndarray) -> np.ndarray:
    return np.stack([np.full_like(z, 0.2), np.full_like(z, 0.2), z], axis=-1)[None].astype(np.float32)


def test_points_before_and_inside_the_hair_are_seen_and_those_behind_it_are_not() -> None:
    veil = Veil(slab(40), np.zeros(3), SPACING, np.array([0.2, 0.2, 2.0]))
    z = np.linspace(0.01, 0.39, 60)
    seen = veil.visible(line(z))[0]
    deepest = z[seen].min()
    print(f"{HIDDEN:.0f} strands deep is z = {0.25 - 0.1 * HIDDEN / 40:.3f} m; seen down to {deepest:.3f} m")
    assert seen[z > 0.25 - 0.1 * HIDDEN / 40].all()
    assert not seen[z < 0.25 - 0.1 * HIDDEN / 40 - 3 * SPACING].any()


def test_thin_hair_hides_nothing() -> None:
    veil = Veil(slab(HIDDEN / 2), np.zeros(3), SPACING, np.array([0.2, 0.2, 2.0]))
    assert veil.visible(line(np.linspace(-0.1, 0.5, 60))).all()
