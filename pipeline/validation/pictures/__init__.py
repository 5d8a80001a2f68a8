"""How near our pictures are to path-traced ones of the same strands, camera, lights and fibres."""

from pipeline.validation.pictures.measures import Likeness, compare
from pipeline.validation.pictures.reference import Reference, load, names
from pipeline.validation.pictures.ours import render

__all__ = ["Likeness", "Reference", "compare", "load", "names", "render"]
