"""The config: its schema, strict loading with file:line in every message, and the key of each stage."""

from pipeline.config.keys import NEEDS, STAGES, explain, provenance, stage_inputs, stage_keys
from pipeline.config.load import Loaded, load
from pipeline.config.schema import Config

__all__ = [
    "NEEDS",
    "STAGES",
    "Config",
    "Loaded",
    "explain",
    "load",
    "provenance",
    "stage_inputs",
    "stage_keys",
]
