"""The config schema: every option with its type, unit, default and a sentence, in one room a stage.

`--help` texts, `configs/schema.json` and the table in the docs are generated from it.
"""

import math
from typing import Annotated

from pydantic import Field, model_validator

from pipeline.config.schema.base import Section
from pipeline.config.schema.camera import Camera, CameraKeyframe, open_states
from pipeline.config.schema.groom import Groom, Swatch
from pipeline.config.schema.hair_contact import HairContact
from pipeline.config.schema.interpolate import Interpolate, Variation
from pipeline.config.schema.lights import PRESETS, Light
from pipeline.config.schema.partings import Parting
from pipeline.config.schema.render import Dye, Fibre, Render, Stop
from pipeline.config.schema.scalp import Plane, Scalp
from pipeline.config.schema.scene import Scene
from pipeline.config.schema.simulate import Air, Contact, Hair, Keyframe, Keyframes, Motion, SagFree, Simulate
from pipeline.config.schema.style import (
    AnyOperator,
    Bend,
    Clump,
    Curl,
    Direction,
    Flyaway,
    Fringe,
    Frizz,
    Gather,
    Lengths,
    Operator,
    Sphere,
    Trim,
    Wave,
)
from pipeline.config.schema.sweep import Sweep
from pipeline.config.schema.varying import Varied, VariedAngle, VariedFraction, VariedLength

__all__ = [
    "PRESETS",
    "Air",
    "AnyOperator",
    "Bend",
    "Camera",
    "CameraKeyframe",
    "Clump",
    "Config",
    "Contact",
    "Curl",
    "Direction",
    "Dye",
    "Fibre",
    "Flyaway",
    "Fringe",
    "Frizz",
    "Gather",
    "Groom",
    "Hair",
    "HairContact",
    "Interpolate",
    "Keyframe",
    "Keyframes",
    "Lengths",
    "Light",
    "Motion",
    "Operator",
    "Parting",
    "Plane",
    "Render",
    "SagFree",
    "Scalp",
    "Scene",
    "Section",
    "Simulate",
    "Sphere",
    "Stop",
    "Swatch",
    "Sweep",
    "Trim",
    "Variation",
    "Varied",
    "VariedAngle",
    "VariedFraction",
    "VariedLength",
    "Wave",
    "open_states",
]


class Config(Section):
    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9._@=,+-]{0,99}$")]
    """Name of the experiment and of its folder in outputs/."""
    seed: Annotated[int, Field(ge=0, lt=2**32)] = 1
    """Seed of everything random."""
    scene: Scene = Scene()
    """Head, lights and camera."""
    groom: Groom = Groom()
    """Stage 1: the strands."""
    simulate: Simulate = Simulate()
    """Stage 2: the guides in motion."""
    interpolate: Interpolate = Interpolate()
    """Stage 3: which guides move which strand."""
    render: Render = Render()
    """Stage 4: the frames."""
    sweep: Sweep | None = None
    """Options with lists of values, one experiment for each combination: `ringlet sweep`."""

    @model_validator(mode="after")
    def _shutter_sees_motion(self) -> "Config":
        shutter, simulate = self.scene.camera.shutter, self.simulate
        if not shutter or open_states(shutter, simulate.states) > 1:
            return self
        enough = (n for n in range(2, 1001) if simulate.substeps % n == 0 and open_states(shutter, n) > 1)
        remedy = next(
            (f"set simulate.states = {n}" for n in enough), "set simulate.substeps and simulate.states higher"
        )
        raise ValueError(
            f"scene.camera.shutter is open for {math.degrees(shutter):g} degrees of 360, but the simulation keeps "
            f"simulate.states = {simulate.states} a frame, and motion blur needs two or more of them meanwhile; {remedy}"
        )

    @model_validator(mode="after")
    def _source_fits_head(self) -> "Config":
        if self.groom.source == "procedural" and self.scene.head == "none":
            raise ValueError(
                'groom.source = "procedural" needs a head; with scene.head = "none" use "swatch" or a groom file'
            )
        return self
