"""Strands pressed between two held ends: they bow out, keep their lengths and come to rest."""

import numpy as np
import pytest
from numpy.typing import NDArray
from strand_scenes import drive, roots, settings, shape

from pipeline import kernels

Points = NDArray[np.float64]
DOWN = np.array([0.0, -1.0, 0.0])


@pytest.mark.parametrize("torsion", ["rotor", "kirchhoff", "frenet", "none"])
@pytest.mark.parametrize("axis", [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0)])
@pytest.mark.parametrize("precision", [np.float32, np.float64])
def test_an_exactly_straight_strand_pressed_at_its_ends_bows_out(
    torsion: str, axis: tuple[float, float, float], precision: type
) -> None:
    """12 cm are pressed to 7 cm in 0.125 s, level and upright."""
    P, press, count = 32, 0.05, 30
    points = np.linspace(0, 0.12, P)[:, None] * np.array(axis) + np.zeros((2, P, 3))
    held = roots(2, P)
    held[:, -2:] = 2
    rest, state = shape(points, held), kernels.at_rest(points.astype(precision))

    def hand(k: int) -> Points:
        pose = np.eye(4)
        pose[:3, 3] = -press * min(k / count, 1) * np.array(axis)
        return pose

    report = kernels.advance(state, rest, None, drive(240, hand=hand), settings(torsion=torsion))
    middle = state.points[0].astype(float) - points[0]
    out = np.linalg.norm(middle - (middle @ axis)[:, None] * np.array(axis), axis=1).max()
    print(
        f"{torsion} {precision.__name__}: strain {report.strain:.1e}, {report.halvings} halvings, bows out {out * 1e3:.1f} mm"
    )
    assert report.strain <= 1.001e-4
    assert report.halvings <= 6
    assert out > 0.03
    assert np.abs(state.velocity).max() < 1e-4
    assert np.abs(state.tension).max() < 1e-3
    if axis[0]:
        assert ((middle @ DOWN) >= -1e-6).all()  # gravity chooses the side
