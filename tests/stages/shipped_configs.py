"""Configs that are shipped, made smaller."""

from pathlib import Path
from typing import Any

from pipeline.config import load
from pipeline.config.schema import Config

ROOT = Path(__file__).parents[2]


def shipped(name: str, **groom: Any) -> Config:
    """The groom of a shipped config, with other values."""
    config = load(ROOT / f"configs/{name}.toml").config
    return config.model_copy(update={"groom": config.groom.model_copy(update=groom)})
