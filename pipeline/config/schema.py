"""The config schema: every option with its type, unit, default and a sentence, in this one place.

`--help` texts, `configs/schema.json` and the table in the docs are generated from it.
Values are SI; see `units` for the strings that are accepted. Models are frozen and refuse unknown keys.
"""

from itertools import pairwise
from typing import Annotated, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

from pipeline.config.units import (
    Acceleration,
    Angle,
    Density,
    Duration,
    Length,
    Pressure,
    Rate,
    Speed,
)

Fraction = Annotated[float, Field(ge=0, le=1)]
Vector = tuple[float, float, float]
Position = tuple[Length, Length, Length]
Velocity = tuple[Speed, Speed, Speed]
Colour = tuple[Annotated[float, Field(ge=0)], Annotated[float, Field(ge=0)], Annotated[float, Field(ge=0)]]


class Section(BaseModel):
    """A frozen table of options that refuses unknown keys."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, use_attribute_docstrings=True)


# --- scene --------------------------------------------------------------------------------------
class Light(Section):
    direction: Vector
    """From the scene towards the light; normalised on use."""
    colour: Colour = (1.0, 1.0, 1.0)
    """Linear RGB."""
    irradiance: Annotated[float, Field(ge=0)] = 1.0
    """Irradiance on a surface that faces the light [W/m^2]; multiplies the colour."""


class Camera(Section):
    position: Position = (0.40, 0.02, 0.80)
    """Where the camera stands [m]."""
    look_at: Position = (0.0, -0.03, 0.0)
    """The point in the middle of the picture [m]."""
    up: Vector = (0.0, 1.0, 0.0)
    """The direction that is up in the picture."""
    field_of_view: Annotated[Angle, Field(gt=0, lt=3)] = 0.4886921905584123
    """Vertical field of view."""


class Scene(Section):
    head: str = "builtin"
    """"builtin" (the mannequin), "none" (strands alone) or the path of a closed mesh, relative to the config."""
    unit_scale: Annotated[float, Field(gt=0)] = 1.0
    """Metres per unit of the head's mesh file (0.01 for centimetres)."""
    up_axis: Literal["x", "y", "z"] = "y"
    """Which axis of the head's mesh file points up."""
    skin: Literal["mannequin", "fair", "tan", "deep"] = "mannequin"
    """Tone of the skin."""
    background: Colour = (0.2, 0.2, 0.2)
    """Linear RGB behind everything."""
    environment: Colour = (0.16, 0.16, 0.16)
    """Linear RGB radiance of a constant sky that lights everything."""
    lights: tuple[Light, ...] = (
        Light(direction=(0.55, 0.75, 0.80), colour=(1.0, 0.96, 0.9), irradiance=3.2),
        Light(direction=(-0.90, 0.25, 0.60), colour=(0.85, 0.92, 1.0), irradiance=0.8),
        Light(direction=(-0.45, 0.55, -0.90), irradiance=2.5),
    )
    """Directional lights: key, fill and rim by default."""
    camera: Camera = Camera()
    """The camera."""


# --- groom --------------------------------------------------------------------------------------
class Parting(Section):
    offset: Length = 0.0
    """Sideways place of the parting on the skull; positive is the head's left."""
    enabled: bool = True
    """Without a parting hair flows away from the crown's whorl."""


class Path(Section):
    tilt: Annotated[Angle, Field(ge=0, lt=1.57)] = 1.0471975511965976
    """Angle between a root's direction and the skin's normal."""
    tilt_jitter: Annotated[Angle, Field(ge=0)] = 0.10471975511965977
    """Standard deviation of the tilt from strand to strand."""
    direction_jitter: Annotated[float, Field(ge=0)] = 0.08
    """Random part of the combing direction at the root."""
    sweep: float = -0.45
    """Forward (positive) or backward (negative) part of the combing near the front hairline."""
    lift: Annotated[Length, Field(ge=0)] = 0.020
    """How high above the skin the outermost layer of hair travels."""
    lift_over: Annotated[Length, Field(gt=0)] = 0.10
    """Arc length over which a strand rises to its layer."""
    bend: Annotated[Length, Field(gt=0)] = 0.024
    """Arc length over which a strand turns towards its target direction."""
    comb: Annotated[Length, Field(gt=0)] = 0.060
    """Arc length after which gravity wins over combing."""
    wander: Annotated[float, Field(ge=0)] = 0.05
    """Slow random part of the target direction."""


class Cut(Section):
    height: Length | None = -0.150
    """Strands end at this height (y); unset, they have `length`."""
    length: Annotated[Length, Field(gt=0)] = 0.25
    """Arc length where no cut height is set, and the longest that a strand gets with one: 0.42 m at most."""
    layers: Annotated[Length, Field(ge=0)] = 0.05
    """How much higher the uppermost layer is cut."""
    uneven: Annotated[Length, Field(ge=0)] = 0.012
    """How much longer or shorter the hair of single big clumps is: the hemline is not drawn with a ruler."""
    jitter: Fraction = 0.05
    """Random shortening of single strands, as a fraction of the length."""


class Clump(Section):
    count: Annotated[int, Field(ge=0)] = 0
    """Number of clumps on the head; 0 switches this level off."""
    strength: Fraction = 0.5
    """How far strands move towards the middle of their clump."""
    over: Annotated[Length, Field(gt=0)] = 0.12
    """Arc length over which the clump closes."""


class Curl(Section):
    radius: Annotated[Length, Field(ge=0)] = 0.0075
    """Radius of the helix; 0 for straight hair."""
    radius_jitter: Fraction = 0.25
    """Relative spread of the radius from clump to clump."""
    pitch: Annotated[Length, Field(gt=0)] = 0.065
    """Length of one turn along the strand."""
    pitch_jitter: Fraction = 0.12
    """Relative spread of the pitch from clump to clump."""
    flatness: Fraction = 0.45
    """Second axis of the helix as a fraction of the first: 0 is a flat wave, 1 a round curl."""
    onset: Annotated[Length, Field(ge=0)] = 0.03
    """Arc length at which the curl begins."""
    ramp: Annotated[Length, Field(gt=0)] = 0.08
    """Arc length over which it reaches its full radius."""
    phase_spread: Fraction = 0.5
    """How much the phase differs from clump to clump: 0 is one wave over the whole head, 1 is random."""
    phase_jitter: Annotated[Angle, Field(ge=0)] = 0.15
    """Standard deviation of the phase inside a clump."""
    shared_by: Literal["big", "small"] = "big"
    """Which level of clumps shares phase, pitch and handedness."""


class Frizz(Section):
    amplitude: Annotated[Length, Field(ge=0)] = 0.0004
    """Amplitude of the smooth noise on a strand."""
    flyaways: Fraction = 0.01
    """Fraction of strands that leave their layer, with three times the frizz."""


class Swatch(Section):
    """A flat patch of strands without a head: `source = "swatch"`."""

    direction: Vector = (0.0, -1.0, 0.0)
    """Direction of the strands."""
    size: Annotated[Length, Field(ge=0)] = 0.04
    """Side of the square of roots; 0 puts a single strand at the origin."""
    length: Annotated[Length, Field(gt=0)] = 0.20
    """Length of every strand."""
    pin_tips: bool = False
    """Hold the last two points too, to drive them by `[simulate.tips]`."""


class Groom(Section):
    source: str = "procedural"
    """"procedural", "swatch" (strands on a patch, no head) or the path of a .tfx, .hair or .data file, relative to the config."""
    unit_scale: Annotated[float, Field(gt=0)] = 1.0
    """Metres per unit of the groom file."""
    up_axis: Literal["x", "y", "z"] = "y"
    """Which axis of the groom file points up."""
    strands: Annotated[int, Field(ge=1, le=10_000_000)] = 60_000
    """Number of strands; of a file, the first so many of its strands in progressive order."""
    guides: Annotated[int, Field(ge=1, le=100_000)] = 1_000
    """Number of strands that are simulated."""
    points: Annotated[int, Field(ge=8, le=256)] = 32
    """Points on every strand and guide, at equal spacing."""
    parting: Parting = Parting()
    """Where the hair parts."""
    path: Path = Path()
    """How strands leave the skin and where they go."""
    cut: Cut = Cut()
    """How long they are."""
    big_clumps: Clump = Clump(count=250, strength=0.75, over=0.16)
    """Large locks."""
    small_clumps: Clump = Clump(count=3000, strength=0.6, over=0.07)
    """Small locks inside them."""
    curl: Curl = Curl()
    """Waves and curls."""
    frizz: Frizz = Frizz()
    """Noise of single strands."""
    swatch: Swatch = Swatch()
    """The patch of `source = "swatch"`."""


# --- simulate -----------------------------------------------------------------------------------
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
    motion: Motion = Motion()
    """Motion of the head."""
    tips: Keyframes = ()
    """Motion of pinned tips relative to the head, as keyframes."""


# --- interpolate --------------------------------------------------------------------------------
class Variation(Section):
    """What makes a strand differ from the groom strand that it is copied from."""

    length: Fraction = 0.05
    """Random shortening."""
    phase: Annotated[Angle, Field(ge=0)] = 0.5
    """Standard deviation of the curl's phase."""
    clump: Fraction = 0.25
    """How far a copy closes in on its groom strand towards the tip."""
    frizz: Annotated[float, Field(ge=0)] = 0.03
    """Amplitude of smooth noise on the directions of segments [rad]."""


class Interpolate(Section):
    strands: Annotated[int, Field(ge=1, le=10_000_000)] | None = None
    """Full count; unset, the groom's own. Beyond the groom's count strands are varied copies of its strands, with roots between theirs."""
    guides_per_strand: Annotated[int, Field(ge=1, le=8)] = 3
    """Guides whose motion a strand follows."""
    variation: Variation = Variation()
    """Variation of the copies."""
    skin: Annotated[Length, Field(ge=0)] = 0.5e-3
    """Strands keep this distance from the skin."""


# --- render -------------------------------------------------------------------------------------
class Fibre(Section):
    melanin: Fraction = 0.6
    """0 is white, 0.2 blonde, 0.6 brown, 0.95 black."""
    redness: Fraction = 0.5
    """Share of pheomelanin: 0 is ashen, 1 is red."""
    melanin_jitter: Fraction = 0.05
    """Spread of the melanin from strand to strand."""
    roughness: Annotated[float, Field(ge=0.1, le=1)] = 0.3
    """Longitudinal roughness."""
    azimuthal_roughness: Annotated[float, Field(ge=0.1, le=1)] = 0.3
    """Roughness around the fibre."""
    tilt: Angle = 0.03490658503988659
    """Tilt of the cuticle scales."""
    glints: bool = True
    """Sample visibility per strand instead of averaging it: single exposed strands sparkle."""


class Render(Section):
    size: tuple[Annotated[int, Field(ge=16, le=16384)], Annotated[int, Field(ge=16, le=16384)]] = (1280, 720)
    """Width and height of a frame [px]."""
    samples: Annotated[int, Field(ge=1, le=8)] = 2
    """N for N x N supersampling."""
    geometry: Literal["auto", "tubes", "ribbons", "lines"] = "auto"
    """How strands are drawn; "auto" decides by projected width and prints its choice."""
    width: Annotated[Length, Field(gt=0)] | None = None
    """Drawn width (diameter) of a strand; unset, a fibre's, widened to keep the coverage of 100,000 strands when there are fewer."""
    taper: Fraction = 0.15
    """Fraction of a strand's length over which its tip thins out."""
    subdivide: Annotated[int, Field(ge=1, le=8)] = 1
    """Drawn segments per segment, along a smooth curve through the points."""
    tube_sides: Annotated[int, Field(ge=3, le=32)] = 4
    """Sides of a tube."""
    grid: Annotated[int, Field(ge=16, le=512)] = 128
    """Voxels along the longest side of the density grid that gives hair its shadows."""
    exposure: Annotated[float, Field(gt=0)] = 1.25
    """Factor on linear colours before the sRGB curve."""
    hair: Fibre = Fibre()
    """Colour and gloss of the fibres."""


# --- the whole ----------------------------------------------------------------------------------
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

    @model_validator(mode="after")
    def _source_fits_head(self) -> "Config":
        if self.groom.source == "procedural" and self.scene.head == "none":
            raise ValueError(
                'groom.source = "procedural" needs a head; with scene.head = "none" use "swatch" or a groom file'
            )
        return self
