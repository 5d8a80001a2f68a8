"""Groom files: .tfx 3 and 4 (TressFX), .hair (Cem Yuksel) and .data (USC-HairSalon)."""

from pipeline.strands.formats.files import FORMATS, read_groom
from pipeline.strands.formats.ragged import Ragged

__all__ = ["FORMATS", "Ragged", "read_groom"]
