"""Named tiny strands: every one is (P, 3) float64 [m], root first, at equal spacing; and what every test leaves as it was."""

from collections.abc import Iterator

import numpy as np
import pytest
from numpy.typing import NDArray

from pipeline import kernels

Points = NDArray[np.float64]


def helix(radius: float, pitch: float, length: float, points: int) -> Points:
    """A helix about x with exactly equal chords; curvature and torsion are those of its smooth curve."""
    rise = pitch / (2 * np.pi)
    angle = np.linspace(0, length, points) / np.hypot(radius, rise)
    return np.stack([rise * angle, radius * np.cos(angle) - radius, radius * np.sin(angle)], axis=-1)


@pytest.fixture(autouse=True)
def _threads() -> Iterator[None]:
    """Every test leaves the number of threads as it found it."""
    count = kernels.threads()
    yield
    kernels.set_threads(count)


@pytest.fixture
def straight() -> Points:
    """25 cm along x."""
    return np.linspace([0.0, 0, 0], [0.25, 0, 0], 32)


@pytest.fixture
def circle() -> Points:
    """Three quarters of a circle of 4 cm radius."""
    angle = np.linspace(0, 1.5 * np.pi, 32)
    return 0.04 * np.stack([np.sin(angle), 1 - np.cos(angle), 0 * angle], axis=-1)


@pytest.fixture
def curl() -> Points:
    """A helix of 1 cm radius and 2 cm pitch."""
    return helix(0.01, 0.02, 0.25, 32)


@pytest.fixture
def kinked(curl: Points) -> Points:
    """The curl, shaken by a tenth of its spacing: no symmetry left, spacing no longer equal."""
    spacing = float(np.linalg.norm(curl[1] - curl[0]))
    return curl + np.random.default_rng(7).normal(size=curl.shape) * spacing / 10


@pytest.fixture
def short() -> Points:
    """5 points on 5 mm: the shortest strand with one interior point for the 5-point torsion."""
    return helix(0.002, 0.004, 0.005, 5)
