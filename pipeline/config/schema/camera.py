"""Options of the camera: where it stands, what it looks at, its lens, and how they change over time."""

import math
from itertools import pairwise
from typing import Annotated

from pydantic import AfterValidator, Field, model_validator

from pipeline.config.schema.base import Position, Section, Vector
from pipeline.config.units import Angle, Duration, Length

_OPTICS = Annotated[Length, Field(gt=0)]


def open_states(shutter: float, states: int) -> int:
    """How many of a frame's states an open shutter [rad of a full turn] sees; 1 where it is instantaneous."""
    return max(1, math.floor(states * shutter / (2 * math.pi) + 0.5))


class CameraKeyframe(Section):
    time: Annotated[Duration, Field(ge=0)]
    """When; frame 1 is at time 0."""
    position: Position | None = None
    """Where the camera stands [m]; unset, as without keyframes."""
    look_at: Position | None = None
    """The point in the middle of the picture [m]; unset, as without keyframes."""
    focal_length: _OPTICS | None = None
    """A zoom: between keyframes it changes by equal factors in equal times; unset, as without keyframes."""
    focus: Position | None = None
    """The point that is sharp [m]; unset, as without keyframes."""


def _ascending(frames: tuple[CameraKeyframe, ...]) -> tuple[CameraKeyframe, ...]:
    for i, (before, after) in enumerate(pairwise(frames)):
        if after.time <= before.time:
            raise ValueError(f"keyframe {i + 2} is not later than keyframe {i + 1}; sort them by time")
    return frames


class Camera(Section):
    position: Position | None = None
    """Where the camera stands [m]; unset, at (0.40, 0.02, 0.80) from the built-in head, and likewise from any other."""
    look_at: Position | None = None
    """The point in the middle of the picture [m]; unset, (0, -0.03, 0) of the built-in head, and likewise of any other."""
    up: Vector = (0.0, 1.0, 0.0)
    """The direction that is up in the picture."""
    field_of_view: Annotated[Angle, Field(gt=0, lt=3)] = 0.4886921905584123
    """Vertical field of view."""
    focal_length: _OPTICS | None = None
    """Focal length of the lens, instead of field_of_view, which then says nothing: 48 mm before a sensor of 24 mm see the default's 28 degrees."""
    sensor: _OPTICS = 0.024
    """Height of the sensor or film behind the lens; 24 mm is that of a full frame."""
    f_stop: Annotated[float, Field(gt=0)] | None = None
    """Depth of field: the lens is as wide as its focal length divided by this; unset, everything is sharp. See render.passes."""
    focus: Position | None = None
    """The point that is sharp [m], with everything as far away as it along the line of sight; unset, look_at."""
    shutter: Annotated[Angle, Field(ge=0, le=6.283185307179587)] = 0.0
    """Motion blur: the part of a frame's time, of a full turn, that the shutter is open before it closes at the frame; needs simulate.states, see render.passes."""
    turntable: Angle = 0.0
    """The camera goes round look_at about `up` by this angle in all frames, evenly: a full turn ends one frame before it begins again."""
    keyframes: Annotated[tuple[CameraKeyframe, ...], AfterValidator(_ascending)] = ()
    """Where the camera is at times; between them a smooth curve that rests at both ends, held before the first and after the last."""

    @model_validator(mode="after")
    def _up_is_across(self) -> "Camera":
        if not any(self.up):
            raise ValueError("up = (0, 0, 0) is no direction")
        return self
