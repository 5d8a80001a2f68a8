"""Options of the style operators: `[groom.style.NAME] op = "..."`, worked through from first to last.

A new operator is one table here, one file in `pipeline/groom/style/` and one line in its `stack.py`.
"""

from collections.abc import Iterator
from typing import Annotated, Any, Literal, Self, get_args

from pydantic import Discriminator, Field, Tag, ValidationError, model_validator
from pydantic_core import InitErrorDetails, PydanticCustomError

from pipeline.config.schema.base import Fraction, Position, Section, Vector
from pipeline.config.schema.varying import VaryingAngle, VaryingFraction, VaryingLength, VaryingNumber
from pipeline.config.units import Angle, Length

Jitter = Annotated[Angle, Field(ge=0)]
Positive = Annotated[Length, Field(gt=0)]


class Operator(Section):
    enabled: bool = True
    """Switch this operator off without taking it out."""
    before: str | None = None
    """Name of the operator that this one comes before; unset, it stands where it is written."""


class Direction(Operator):
    op: Literal["direction"]
    """Strands grow anew from their roots: combed away from the parting or the whorl, then down."""
    tilt: VaryingAngle = 1.0471975511965976
    """Angle between a root's direction and the skin's normal."""
    tilt_jitter: Jitter = 0.10471975511965977
    """Standard deviation of the tilt from strand to strand."""
    direction_jitter: Annotated[float, Field(ge=0)] = 0.08
    """Random part of the combing direction at the root."""
    sweep: VaryingNumber = -0.45
    """Forward (positive) or backward (negative) part of the combing near the front hairline."""
    lift: VaryingLength = 0.020
    """How high above the skin the outermost layer of hair travels."""
    lift_over: Positive = 0.10
    """Arc length over which a strand rises to its layer."""
    bend: Positive = 0.024
    """Arc length over which a strand turns towards its target direction."""
    comb: Positive = 0.060
    """Arc length after which gravity wins over combing."""
    wander: Annotated[float, Field(ge=0)] = 0.05
    """Slow random part of the target direction."""


class Lengths(Operator):
    op: Literal["length"]
    """Strands are cut to a length."""
    length: VaryingLength = 0.25
    """Arc length from the root; what is shorter stays as it is, and nothing is longer than 56 cm."""
    jitter: Fraction = 0.0
    """Random shortening of single strands, as a fraction of the length."""


class Sphere(Section):
    centre: Position = (0.0, 0.04, -0.01)
    """Its middle, on the mannequin; the default is that of the skull."""
    radius: Positive
    """What lies outside is cut off."""


class Trim(Operator):
    op: Literal["trim"]
    """Strands are cut where they leave a half space or a sphere."""
    height: Length | None = None
    """What lies below this height (y) is cut off."""
    slope: Annotated[Angle, Field(gt=-1.5, lt=1.5)] = 0.0
    """Tilt of that plane about the ears: positive is higher at the face."""
    sphere: Sphere | None = None
    """A sphere in place of the plane."""
    hanging: bool = True
    """Measure hair below the jaw as if it hung straight down, so that what lies on the shoulders is as long as what hangs beside them."""
    layers: Annotated[Length, Field(ge=0)] = 0.0
    """How much deeper the uppermost layer is cut."""
    uneven: Annotated[Length, Field(ge=0)] = 0.0
    """How much longer or shorter the hair of single clumps is: a hemline is not drawn with a ruler."""
    per: str | None = None
    """The clump operator whose clumps are uneven; unset, every strand is by itself."""
    jitter: Fraction = 0.0
    """Random shortening of single strands, as a fraction of the length."""
    shortest: Positive = 0.012
    """No strand is cut shorter than this, wherever its root lies."""

    @model_validator(mode="after")
    def _one_surface(self) -> Self:
        if (self.height is None) == (self.sphere is None):
            raise ValueError("a trim has either a height or a sphere")
        return self


class Clump(Operator):
    op: Literal["clump"]
    """Strands gather about the middle strand of their clump."""
    count: Annotated[int, Field(ge=1)] = 1000
    """Number of clumps on the head."""
    strength: VaryingFraction = 0.5
    """How far strands move towards the middle of their clump."""
    strength_jitter: Fraction = 0.15
    """How much weaker some strands are drawn than others."""
    over: Positive = 0.12
    """Arc length over which the clump closes."""
    within: str | None = None
    """A clump operator of fewer clumps, before this one: no clump of this one then reaches over two of its."""


class Curl(Operator):
    op: Literal["curl"]
    """Strands wind about themselves in a helix."""
    radius: VaryingLength = 0.008
    """Radius of the helix."""
    radius_jitter: Fraction = 0.25
    """Relative spread of the radius from clump to clump."""
    pitch: VaryingLength = 0.04
    """Length of one turn along the strand."""
    pitch_jitter: Fraction = 0.12
    """Relative spread of the pitch from clump to clump."""
    flatness: Fraction = 1.0
    """Second axis of the helix as a fraction of the first: 1 is a round curl."""
    onset: VaryingLength = 0.03
    """Arc length at which the curl begins."""
    ramp: Positive = 0.08
    """Arc length over which it reaches its full radius."""
    phase_spread: Fraction = 1.0
    """How much the phase differs from clump to clump: 0 is one curl over the whole head, 1 is random."""
    phase_jitter: Jitter = 0.15
    """Standard deviation of the phase inside a clump."""
    strand_jitter: Fraction = 0.15
    """How much the radius of single strands differs from their clump's; their pitch differs by a quarter of it."""
    per: str | None = None
    """The clump operator whose clumps share phase, pitch and handedness; unset, every strand is by itself."""


class Wave(Operator):
    op: Literal["wave"]
    """Strands swing from side to side, crests at one height all around the head."""
    amplitude: VaryingLength = 0.006
    """Largest distance from the strand's middle line."""
    amplitude_jitter: Fraction = 0.25
    """Relative spread of the amplitude from clump to clump."""
    wavelength: VaryingLength = 0.07
    """Length of one wave along the strand."""
    wavelength_jitter: Fraction = 0.1
    """Relative spread of the wavelength from clump to clump."""
    sideways: Fraction = 0.5
    """Direction of the swing: 0 towards the head and away from it, 1 along it."""
    onset: VaryingLength = 0.03
    """Arc length at which the wave begins."""
    ramp: Positive = 0.08
    """Arc length over which it reaches its full amplitude."""
    phase_spread: Fraction = 0.2
    """How much the phase differs from clump to clump: 0 is in step all around the head, 1 is random."""
    phase_jitter: Jitter = 0.15
    """Standard deviation of the phase inside a clump."""
    per: str | None = None
    """The clump operator whose clumps swing together; unset, every strand is by itself."""


class Frizz(Operator):
    op: Literal["frizz"]
    """Single strands wriggle."""
    amplitude: VaryingLength = 0.0005
    """Root mean square of the displacement."""
    over: Positive = 0.05
    """Arc length over which it grows."""


class Flyaway(Operator):
    op: Literal["flyaway"]
    """A few strands leave their lock."""
    fraction: VaryingFraction = 0.01
    """How many do."""
    rise: Annotated[Length, Field(ge=0)] = 0.006
    """How far they rise above the others, at most."""
    wander: Annotated[Length, Field(ge=0)] = 0.004
    """Amplitude of their slow bends."""
    over: Positive = 0.08
    """Arc length over which they part from the others."""


class Bend(Operator):
    op: Literal["bend"]
    """Strands turn over a range of their length and stay turned beyond it."""
    angle: VaryingAngle = 0.8
    """By how much they turn; negative is away from `towards`."""
    jitter: Fraction = 0.2
    """Relative spread of the angle from strand to strand."""
    measured_from: Literal["root", "tip"] = "tip"
    """The end of the strand from which the range is measured; a tied strand's root is where it is tied."""
    start: Annotated[Length, Field(ge=0)] = 0.0
    """Arc length from that end to the range."""
    over: Positive = 0.05
    """Length of the range."""
    towards: Literal["head"] | Vector = "head"
    """What strands turn towards: the head beside them, or a direction."""


class Gather(Operator):
    op: Literal["gather"]
    """Strands are combed over the scalp to a ring, pulled through it and held there by the head; a tail falls from it."""
    tie: Position = (0.0, 0.075, -0.095)
    """Where the ring sits, on the mannequin: above the point of the skin nearest to this one."""
    radius: Positive = 0.011
    """Radius of the ring: all strands pass within it."""
    height: Annotated[Length, Field(ge=0)] = 0.012
    """How high above the skin the ring sits."""
    axis: Vector | None = None
    """Direction in which the tail leaves; unset, straight away from the skin."""
    fraction: VaryingFraction = 1.0
    """Which strands are gathered; a formula of 0 and 1 takes a part of the scalp, for half of the hair or for two tails."""
    rise: Annotated[float, Field(ge=1)] = 2.0
    """How much strands go up before they go on to the ring; 1 is the straight way."""
    fall: Positive = 0.06
    """Arc length after which gravity bends the tail down."""
    spread: Annotated[Angle, Field(ge=0, lt=1.5)] = 0.3
    """Angle at which the tail's outermost strands leave it."""


class Fringe(Operator):
    op: Literal["fringe"]
    """Strands rooted behind the front hairline fall forward over the forehead, and are cut at a height."""
    width: Positive = 0.09
    """Breadth of the region at the hairline; it narrows to a point towards the crown."""
    depth: Positive = 0.045
    """How far the region reaches back from the hairline."""
    height: Length = 0.042
    """No strand of the region reaches below this height (y)."""
    uneven: Annotated[Length, Field(ge=0)] = 0.003
    """How much higher single strands end."""
    fan: float = 0.5
    """How much strands spread to both sides, the more the farther out their roots are; 0 is straight ahead."""
    sideways: float = 0.0
    """Sideways part of their direction; positive is to the head's left."""
    lift: Annotated[Length, Field(ge=0)] = 0.008
    """How high above the skin the outermost layer lies."""
    bend: Positive = 0.012
    """Arc length over which strands turn down."""


def _op(value: Any) -> str:
    op = value.get("op", "") if isinstance(value, dict) else getattr(value, "op", "")
    return f"({op})"


AnyOperator = Annotated[
    Annotated[Direction, Tag("(direction)")]
    | Annotated[Lengths, Tag("(length)")]
    | Annotated[Trim, Tag("(trim)")]
    | Annotated[Clump, Tag("(clump)")]
    | Annotated[Curl, Tag("(curl)")]
    | Annotated[Wave, Tag("(wave)")]
    | Annotated[Frizz, Tag("(frizz)")]
    | Annotated[Flyaway, Tag("(flyaway)")]
    | Annotated[Bend, Tag("(bend)")]
    | Annotated[Gather, Tag("(gather)")]
    | Annotated[Fringe, Tag("(fringe)")],
    Discriminator(_op),
]
StyleName = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_-]*$")]

OPERATORS: dict[str, type[Operator]] = {
    get_args(get_args(model)[0].model_fields["op"].annotation)[0]: get_args(model)[0]
    for model in get_args(get_args(AnyOperator)[0])
}


def in_order(style: dict[str, AnyOperator]) -> dict[str, AnyOperator]:
    """The operators in the order that they work in: each that is `before` another one is moved there.

    Raises ValidationError for names of operators that do not exist or do not fit.
    """
    order = list(style)
    _raise_for(_misplaced(style))
    for name, op in style.items():
        if op.before is not None:
            order.remove(name)
            order.insert(order.index(op.before), name)
    ordered = {name: style[name] for name in order}
    _raise_for(_misnamed(ordered))
    return ordered


def _misplaced(style: dict[str, AnyOperator]) -> Iterator[InitErrorDetails]:
    for name, op in style.items():
        others = [other for other in style if other != name]
        if op.before is not None and op.before not in others:
            yield _unknown(name, "before", op.before, "operator", others)


def _misnamed(style: dict[str, AnyOperator]) -> Iterator[InitErrorDetails]:
    """What is wrong with the clump operators that others name."""
    clumps = {name: op for name, op in style.items() if isinstance(op, Clump)}
    earlier: dict[str, Clump] = {}
    for name, op in style.items():
        per = getattr(op, "per", None)
        if per is not None and per not in clumps:
            yield _unknown(name, "per", per, "clump operator", list(clumps))
        if isinstance(op, Clump):
            if op.within is not None and op.within not in earlier:
                yield _unknown(name, "within", op.within, "clump operator before this one", list(earlier))
            elif op.within is not None and earlier[op.within].count > op.count:
                most = f"within {op.within!r} there are at least its {earlier[op.within].count} clumps"
                yield _told((name, "count"), op.count, most)
            earlier[name] = op


def _unknown(name: str, key: str, value: str, what: str, known: list[str]) -> InitErrorDetails:
    there = f"; there are {', '.join(known)}" if known else ""
    return _told((name, key), value, f"there is no {what} of this name{there}")


def _raise_for(wrong: Iterator[InitErrorDetails]) -> None:
    if found := list(wrong):
        raise ValidationError.from_exception_data("style", found)


def _told(loc: tuple[str, ...], value: object, message: str) -> InitErrorDetails:
    return InitErrorDetails(
        type=PydanticCustomError("style", "{message}", {"message": message}), loc=loc, input=value
    )
