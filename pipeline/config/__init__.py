"""The config: its schema, strict loading with file:line in every message, and the key of each stage."""

from pipeline.config.keys import STAGES, explain, provenance, stage_inputs, stage_keys
from pipeline.config.load import Loaded, load
from pipeline.config.schema import Config

__all__ = ["STAGES", "Config", "Loaded", "explain", "load", "provenance", "stage_inputs", "stage_keys"]
