"""What is slow to make and serves many tests: the mannequin, and a groom on it."""

from pathlib import Path
from typing import Any

import pytest

from pipeline.config import load
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


ROOT = Path(__file__).parents[2]


def shipped(name: str, **groom: Any) -> Config:
    """The groom of a shipped config, with other values."""
    config = load(ROOT / f"configs/{name}.toml").config
    return config.model_copy(update={"groom": config.groom.model_copy(update=groom)})


@pytest.fixture(scope="session")
def wavy(mannequin: Head) -> Strands:
    """The first 5,000 strands of the default style."""
    return Style(shipped("default", strands=5000), mannequin).strands(0, 5000)
