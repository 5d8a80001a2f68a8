"""What is slow to make and serves many tests: the mannequin, and a groom on it."""

import numpy as np
import pytest
from numpy.typing import NDArray

from pipeline.config.schema import Config, Groom
from pipeline.groom.heads import Head, make_head
from pipeline.groom.procedural import Style
from pipeline.strands.strands import Strands


@pytest.fixture(scope="session")
def mannequin() -> Head:
    """The built-in head."""
    head = make_head(Config(name="mannequin"))
    assert head is not None
    return head


@pytest.fixture(scope="session")
def wavy(mannequin: Head) -> Strands:
    """The first 5,000 strands of the default style."""
    return Style(Config(name="wavy", groom=Groom(strands=5000)), mannequin).strands(0, 5000)


@pytest.fixture(scope="session")
def octahedron() -> tuple[NDArray[np.float32], NDArray[np.int32]]:
    """The smallest smooth-looking closed mesh with every point on the unit sphere: points (6, 3), triangles (8, 3)."""
    points = np.concatenate([np.eye(3), -np.eye(3)]).astype(np.float32)
    upper = np.array([[0, 1, 2], [1, 3, 2], [3, 4, 2], [4, 0, 2]], np.int32)
    lower = np.array([[1, 0, 5], [3, 1, 5], [4, 3, 5], [0, 4, 5]], np.int32)
    return points, np.concatenate([upper, lower])
