"""How near our pictures are to path-traced ones of the same strands, camera, lights and fibres."""

from pipeline.validation.pictures.measures import Likeness, compare
from pipeline.validation.pictures.ours import render
from pipeline.validation.pictures.reference import Reference, load, names

__all__ = ["Likeness", "Reference", "compare", "load", "names", "render"]
