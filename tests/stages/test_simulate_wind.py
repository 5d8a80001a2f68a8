"""Wind: gusts of the right strength, smooth, and a function of time and seed alone."""

import numpy as np
import pytest

from pipeline.config.schema import Air
from pipeline.simulate.wind import wind

GUSTY = Air(wind=(2.0, 0.0, -1.0), gusts=1.5, gust_period=1.0)


def test_gusts_have_the_asked_mean_and_strength() -> None:
    at = wind(GUSTY, seed=3)
    values = np.array([at(time) for time in np.arange(0, 400, 0.05)])
    mean, gusts = values.mean(axis=0), values - GUSTY.wind
    strength = float(np.sqrt((gusts**2).sum(axis=1).mean()))
    print(f"mean wind {mean.round(3)} m/s, gusts {strength:.4f} m/s rms")
    assert np.abs(mean - GUSTY.wind).max() < 0.01
    assert strength == pytest.approx(GUSTY.gusts, rel=0.01)


def test_gusts_do_not_depend_on_the_order_of_asking() -> None:
    times = np.linspace(-2, 5, 50)
    forwards = [wind(GUSTY, 3)(t) for t in times]
    at = wind(GUSTY, 3)
    backwards = [at(t) for t in times[::-1]][::-1]
    assert np.array_equal(forwards, backwards)


def test_gusts_are_smooth_and_differ_by_seed() -> None:
    at = wind(GUSTY, 3)
    steps = np.diff([at(t) for t in np.arange(0, 10, 1 / 240)], axis=0) * 240
    print(f"fastest change {np.abs(steps).max():.1f} m/s^2")
    assert np.abs(steps).max() < 2 * np.pi * 16 * GUSTY.gusts
    assert np.abs(at(1.0) - wind(GUSTY, 4)(1.0)).max() > 0.01


def test_without_gusts_the_wind_is_its_mean() -> None:
    assert np.array_equal(wind(Air(wind=(1.0, 2.0, 3.0)), 1)(0.7), (1.0, 2.0, 3.0))
