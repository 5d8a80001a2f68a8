"""Options of stage 2: the guides in motion."""

from itertools import pairwise
from typing import Annotated, Literal

from pydantic import AfterValidator, Field, ValidationInfo, field_validator, model_validator

from pipeline.config.schema.base import Position, Section, Velocity
from pipeline.config.schema.hair_contact import HairContact
from pipeline.config.units import Acceleration, Angle, Density, Duration, Force, Length, Pressure, Rate, Speed


class Hair(Section):
    radius: Annotated[Length, Field(gt=0)] = 40e-6
    """Radius of a fibre; of the circle of the same area where the section is an ellipse."""
    ellipticity: Annotated[float, Field(ge=1, le=10)] = 1.0
    """Largest over smallest diameter of the section (Asian 1.29, Caucasian 1.41, African 1.66); for torsion "kirchhoff"."""
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


_CANNOT_HOLD = {
    "none": "without torsion nothing holds a curl sideways",
    "frenet": "its torsion does not keep a curl from turning about its root",
}

Keyframes = Annotated[tuple[Keyframe, ...], AfterValidator(_ascending)]


class Motion(Section):
    preset: Literal["none", "nod", "shake", "turn"] = "none"
    """A motion of the head about its pivot; keyframes or a file replace it."""
    amplitude: Angle = 0.8726646259971648
    """Largest angle of a preset."""
    period: Annotated[Duration, Field(gt=0)] = 2.0
    """Duration of one swing of a preset."""
    swings: Annotated[int, Field(ge=1)] = 1
    """Number of swings of a preset; after them the head holds still."""
    pivot: Position | None = None
    """The point that the head turns about [m]; unset, (0, -0.05, -0.015) of the built-in head, and likewise of any other."""
    keyframes: Keyframes = ()
    """Poses at times; between them a smooth spline, held before the first and after the last."""
    file: str | None = None
    """A file of transforms, relative to the config: a row-major 4x4 matrix [m] a frame, as .csv (after a column "frame" or "time", or without) or .h5 (dataset "transforms")."""
    unit_scale: Annotated[float, Field(gt=0)] = 1.0
    """Metres per unit of the file's translations (0.01 for centimetres)."""
    teleport: tuple[Annotated[int, Field(ge=2)], ...] = ()
    """Frames at which the head jumps: hair is carried there as it is, with its velocity turned, and does not whip."""
    teleport_beyond: Annotated[Length, Field(gt=0)] | None = None
    """A pivot that moves further than this from one sample of the file to the next has jumped."""

    @model_validator(mode="after")
    def _one_motion(self) -> "Motion":
        if self.file is not None and self.keyframes:
            raise ValueError("a motion comes from keyframes or from a file; remove one of them")
        if self.teleport and self.file is None and not self.keyframes:
            raise ValueError("only keyframes and files jump; remove teleport")
        return self


class SagFree(Section):
    margin: Annotated[float, Field(ge=1)] = 1.5
    """How much stiffer than the least that is stable a guide is made, where its material is not."""
    max_factor: Annotated[float, Field(ge=1)] = 50.0
    """No guide is made stiffer than its material by more than this; those that would have to be are reported, and sag."""
    lean_above: Annotated[float, Field(ge=1)] = 4.0
    """Guides that would have to be stiffened by more than this lean on the head, where that helps; leaning hair slides."""


class Simulate(Section):
    frames: Annotated[int, Field(ge=1, le=1_000_000)] = 72
    """Number of frames."""
    fps: Annotated[Rate, Field(gt=0)] = 24.0
    """Frames per second."""
    substeps: Annotated[int, Field(ge=1, le=1000)] = 10
    """Steps per frame; 10 at 24 fps is dt = 1/240 s."""
    states: Annotated[int, Field(ge=1, le=1000)] = 1
    """States that are kept of a frame, for motion blur; the frame's is the last, the others are as many equal parts of a frame before it. Divides substeps."""
    settle: Annotated[Duration, Field(ge=0)] = 2.0
    """Simulated time before frame 1, with the head at its first pose."""
    precision: Literal["float32", "float64"] = "float64"
    """Precision of the guides: "float32" is twice as fast, but fails on short strands of many points (spacing below 1 mm)."""
    theta: Annotated[float, Field(ge=0.5, le=1)] = 0.6
    """Implicitness: 1 is the most robust, 0.55 loses the least energy; 0.5 is for steps of a quarter millisecond. Strands of too fine a spacing take up to 1 on their own."""
    look_ahead: bool = False
    """Linearise where hair is expected in the middle of a step: a tenth of the error, for steps of 1/120 s and shorter."""
    torsion: Literal["kirchhoff", "rotor", "frenet", "none"] = "kirchhoff"
    """Torsion model: "kirchhoff" (material frames), "rotor" (4-point), "frenet" (the lecture's, regularised) or "none"."""
    rest: Literal["auto", "groom", "sag_free"] = "auto"
    """Rest shape: the "groom" itself, which then sags under gravity; "sag_free", one that holds the groom (torsion "kirchhoff", or "rotor" for curls); or "auto", sag-free for "kirchhoff" where that can be."""
    sag_free: SagFree = SagFree()
    """How stable a sag-free groom is made."""
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
    tips_file: str | None = None
    """Motion of pinned tips relative to the head, as a file of transforms [m] (see motion.file)."""
    tip_load: tuple[Force, Force, Force] = (0.0, 0.0, 0.0)
    """Constant force on the tip of every guide [N], in the world: a bead, a pull; a hair of 25 cm weighs 16 uN. A sag-free groom bears its weight, not this."""

    @model_validator(mode="after")
    def _one_motion_of_tips(self) -> "Simulate":
        if self.tips and self.tips_file is not None:
            raise ValueError("the motion of tips comes from tips or from tips_file; remove one of them")
        return self

    @model_validator(mode="after")
    def _states_are_steps(self) -> "Simulate":
        if self.substeps % self.states:
            near = max(n for n in range(1, self.states + 1) if self.substeps % n == 0)
            raise ValueError(
                f"states = {self.states} does not divide substeps = {self.substeps}; set states = {near}, or substeps "
                f"to a multiple of {self.states}"
            )
        return self

    @model_validator(mode="after")
    def _sections_are_seen(self) -> "Simulate":
        if self.hair.ellipticity > 1 and self.torsion != "kirchhoff":
            raise ValueError(
                f'only simulate.torsion = "kirchhoff" knows elliptic sections, not "{self.torsion}"; '
                "set it, or hair.ellipticity = 1"
            )
        return self

    @field_validator("rest")
    @classmethod
    def _torsion_holds_it(cls, rest: str, info: ValidationInfo) -> str:
        torsion = info.data.get("torsion", "kirchhoff")
        if rest == "sag_free" and torsion in _CANNOT_HOLD:
            raise ValueError(
                f'"sag_free" needs simulate.torsion = "kirchhoff": {_CANNOT_HOLD[torsion]}; or take "auto"'
            )
        return rest
