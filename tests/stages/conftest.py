"""What is slow to make and serves many tests: the mannequin, and a groom on it."""

import pytest
from shipped_configs import shipped

from pipeline.config.schema import Config
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
    return Style(shipped("default", strands=5000), mannequin).strands(0, 5000)
