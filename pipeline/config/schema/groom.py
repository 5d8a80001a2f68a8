"""Options of stage 1: the strands."""

from typing import Annotated, Literal

from pydantic import Field

from pipeline.config.schema.base import Fraction, Section, Vector
from pipeline.config.units import Angle, Length


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
    """"procedural", "swatch" (strands on a patch, no head) or the path of a groom file, relative to the config: .tfx, .hair, .data, .usd (.usda, .usdc, .usdz), .vtp, .vtkhdf or .abc."""
    unit_scale: Annotated[float, Field(gt=0)] | None = None
    """Metres per unit of the groom file; unset, what the file says (only USD does), else 1."""
    up_axis: Literal["x", "y", "z"] | None = None
    """Which axis of the groom file points up; unset, what the file says (only USD does), else y."""
    pins: str | None = None
    """A file of held points, relative to the config: a row a strand of .csv or .npy, either two numbers (held at root and tip; 1 is a hinge, 2 a clamp) or one a point (0 free, 1 by the head, 2 by the hand)."""
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
