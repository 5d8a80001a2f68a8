"""Options of stage 2: the guides in motion."""

from itertools import pairwise
from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from pipeline.config.schema.base import Position, Section, Velocity
from pipeline.config.schema.hair_contact import HairContact
from pipeline.config.units import Acceleration, Angle, Density, Duration, Length, Pressure, Rate, Speed


class Hair(Section):
    radius: Annotated[Length, Field(gt=0)] = 40e-6
    """Radius of a fibre."""
    young_modulus: Annotated[Pressure, Field(ge=0)] = 4e9
    """Young's modulus: resistance to bending and stretching."""
    shear_modulus: Annotated[Pressure, Field(ge=0)] = 0.9e9
    """Shear modulus: resistance to torsion."""
    density: Annotated[Density, Field(gt=0)] = 1300.0
    """Mass per volume."""
    friction: Annotated[float, Field(ge=0, le=2)] = 0.3
    """Coulomb friction between hair and skin."""
    damping: Annotated[Duration, Field(ge=0)] = 3e-3
    """Internal damping time beta: loss factor over angular frequency; never changes the statics."""


class Air(Section):
    shielding: Annotated[float, Field(ge=0, le=1)] = 0.3
    """Drag as a fraction of an isolated fibre's: inside a head of hair neighbours shield each other."""
    wind: Velocity = (0.0, 0.0, 0.0)
    """Mean wind [m/s]."""
    gusts: Annotated[Speed, Field(ge=0)] = 0.0
    """Root mean square of the gusts [m/s], a smooth function of simulated time and the seed."""
    gust_period: Annotated[Duration, Field(gt=0)] = 1.0
    """Longest period of the gusts."""


class Contact(Section):
    offset: Annotated[Length, Field(ge=0)] = 1e-3
    """Distance from the skin that points groomed below it come out to."""
    layer: Annotated[Length, Field(ge=0)] = 0.02
    """Guides keep most of their groomed distance from the skin, up to this much: the hair below holds them up."""
    spacing: Annotated[Length, Field(gt=0)] = 3e-3
    """Spacing of the head's distance grid."""


class Keyframe(Section):
    time: Annotated[Duration, Field(ge=0)]
    """When."""
    position: Position = (0.0, 0.0, 0.0)
    """Translation from the rest pose [m]."""
    rotation: tuple[Angle, Angle, Angle] = (0.0, 0.0, 0.0)
    """Rotation vector: axis times angle."""


def _ascending(frames: tuple[Keyframe, ...]) -> tuple[Keyframe, ...]:
    for i, (before, after) in enumerate(pairwise(frames)):
        if after.time <= before.time:
            raise ValueError(f"keyframe {i + 2} is not later than keyframe {i + 1}; sort them by time")
    return frames


Keyframes = Annotated[tuple[Keyframe, ...], AfterValidator(_ascending)]


class Motion(Section):
    preset: Literal["none", "nod", "shake", "turn"] = "none"
    """A motion of the head about its pivot; keyframes replace it."""
    amplitude: Angle = 0.8726646259971648
    """Largest angle of a preset."""
    period: Annotated[Duration, Field(gt=0)] = 2.0
    """Duration of one swing of a preset."""
    swings: Annotated[int, Field(ge=1)] = 1
    """Number of swings of a preset; after them the head holds still."""
    pivot: Position = (0.0, -0.05, -0.015)
    """The point that the head turns about [m]."""
    keyframes: Keyframes = ()
    """Poses at times; between them a smooth spline, held before the first and after the last."""


class Simulate(Section):
    frames: Annotated[int, Field(ge=1, le=1_000_000)] = 72
    """Number of frames."""
    fps: Annotated[Rate, Field(gt=0)] = 24.0
    """Frames per second."""
    substeps: Annotated[int, Field(ge=1, le=1000)] = 10
    """Steps per frame; 10 at 24 fps is dt = 1/240 s."""
    settle: Annotated[Duration, Field(ge=0)] = 2.0
    """Simulated time before frame 1, with the head at its first pose."""
    precision: Literal["float32", "float64"] = "float64"
    """Precision of the guides: "float32" is twice as fast, but fails on short strands of many points (spacing below 1 mm)."""
    theta: Annotated[float, Field(ge=0.5, le=1)] = 0.6
    """Implicitness: 1 is the most robust, 0.55 loses the least energy; 0.5 is for steps of a quarter millisecond."""
    torsion: Literal["rotor", "frenet", "none"] = "rotor"
    """Torsion model: "rotor" (4-point, one minimum), "frenet" (the lecture's, regularised) or "none"."""
    relaxation: Literal["newton", "sweep"] = "newton"
    """Length relaxation: "newton" (tridiagonal, 2 iterations) or the lecture's "sweep" (hundreds)."""
    tolerance: Annotated[float, Field(gt=0, le=0.1)] = 1e-4
    """Worst relative length error of a segment after a step."""
    gravity: tuple[Acceleration, Acceleration, Acceleration] = (0.0, -9.81, 0.0)
    """Gravity [m/s^2]."""
    hair: Hair = Hair()
    """Material of the fibres."""
    air: Air = Air()
    """Drag and wind."""
    contact: Contact = Contact()
    """Hair on head."""
    hair_contact: HairContact = HairContact()
    """Hair on hair."""
    motion: Motion = Motion()
    """Motion of the head."""
    tips: Keyframes = ()
    """Motion of pinned tips relative to the head, as keyframes."""
