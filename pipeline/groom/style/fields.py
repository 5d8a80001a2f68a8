"""Values that vary over the scalp: formulas of scalp variables, and painted maps."""

import ast
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pipeline.config.formula import parse
from pipeline.config.schema import Varied
from pipeline.errors import InputError
from pipeline.groom.head.distance import smoothstep
from pipeline.groom.image import brightness, sampled
from pipeline.strands.random import hashed, uniform

if TYPE_CHECKING:
    from pipeline.groom.heads import Head
    from pipeline.groom.style.ground import Terrain

Values = NDArray[np.float64]
Points = NDArray[np.floating[Any]]

_NAPE, _TOP = -0.067, 0.131  # [m] heights of the scalp's lowest and highest roots
_BACK, _FOREHEAD = -0.0876, 0.107  # [m]
_EAR = 0.079  # [m] half a head's breadth
_RANDOM, _NOISE = 3, 5  # salts


@dataclass(frozen=True)
class Scalp:
    """Where some strands (N,) grow: what formulas and maps are asked about."""

    seed: int
    index: NDArray[np.int64]
    root: Values
    """(N, 3) fitted [m]"""
    head: "Head"
    terrain: "Terrain"

    def variable(self, name: str) -> Values:
        """A variable of formulas (N,), by its name in `config.formula.VARIABLES`."""
        return _VARIABLES[name](self)


def varied(option: Varied, at: Scalp) -> Values:
    """Values (N,) of an option that varies. Raises InputError for what has no value on this head."""
    if option.formula is not None:
        with np.errstate(all="ignore"):
            value = np.broadcast_to(_evaluated(parse(option.formula), at), len(at.index)).astype(float)
    elif option.map is not None:
        value = sampled(brightness(option.map), at.head.uv(at.root))
    else:
        value = at.head.array(option.array or "", at.root)
    if not np.isfinite(value).all():
        raise InputError(f"groom.style: {option.told} has no value at {np.sum(~np.isfinite(value))} roots")
    if option.ends is not None:
        low, high = option.ends
        value = low + (high - low) * value
    return np.clip(value, option.least, option.most) if (option.least, option.most) != (None, None) else value


def _evaluated(node: ast.expr, at: Scalp) -> Any:
    """The value of a checked formula; numbers are floats, so that no power grows beyond memory."""
    match node:
        case ast.Constant(value=value):
            return np.float64(str(value))
        case ast.Name(id=name):
            return at.variable(name)
        case ast.UnaryOp(op=op, operand=inner):
            value = _evaluated(inner, at)
            return -value if isinstance(op, ast.USub) else value
        case ast.BinOp(left=left, op=operator, right=right):
            return _OPERATIONS[type(operator)](_evaluated(left, at), _evaluated(right, at))
        case ast.Call(func=ast.Name(id="noise"), args=[scale]):
            return noise(at.root, _evaluated(scale, at), at.seed)
        case ast.Call(func=ast.Name(id=name), args=arguments):
            return _FUNCTIONS[name](*(_evaluated(argument, at) for argument in arguments))
    raise AssertionError(ast.unparse(node))  # parse lets nothing else through


def noise(points: Values, scale: Values | float, seed: int) -> Values:
    """Smooth noise (N,) in -1 to 1 at points (N, 3) [m]: values hashed at the corners of cubes of `scale` [m], blended."""
    place = points / np.maximum(np.broadcast_to(scale, len(points)), 1e-6)[:, None]
    cell = np.floor(place)
    part = smoothstep(place - cell)
    total = np.zeros(len(points))
    for corner in np.ndindex(2, 2, 2):
        at = (cell + corner).astype(np.int64)
        mixed = hashed(
            seed, hashed(seed, hashed(seed, at[:, 0], _NOISE) ^ at[:, 1], _NOISE) ^ at[:, 2], _NOISE
        )
        weight = np.prod(np.where(corner, part, 1 - part), axis=1)
        total += weight * (mixed / 2.0**31 - 1)
    return total


def _smoothstep(a: Values, b: Values, x: Values) -> Values:
    return np.asarray(smoothstep(np.asarray((x - a) / (b - a))), np.float64)


def _crown(at: Scalp) -> Values:
    return np.asarray(np.linalg.norm(at.root - at.head.on_skin(np.zeros((1, 2))), axis=1))


_VARIABLES: dict[str, Callable[[Scalp], Values]] = {
    "x": lambda at: at.root[:, 0],
    "y": lambda at: at.root[:, 1],
    "z": lambda at: at.root[:, 2],
    "u": lambda at: np.asarray(at.head.uv(at.root)[:, 0], np.float64),
    "v": lambda at: np.asarray(at.head.uv(at.root)[:, 1], np.float64),
    "height": lambda at: (at.root[:, 1] - _NAPE) / (_TOP - _NAPE),
    "front": lambda at: (at.root[:, 2] - _BACK) / (_FOREHEAD - _BACK),
    "side": lambda at: at.root[:, 0] / _EAR,
    "crown": _crown,
    "parting": lambda at: at.terrain.combing.distance(at.root),
    "random": lambda at: uniform(at.seed, at.index, _RANDOM),
}
_FUNCTIONS: dict[str, Callable[..., Any]] = {
    "smoothstep": _smoothstep,
    "mix": lambda a, b, part: a + (b - a) * part,
    "min": np.minimum,
    "max": np.maximum,
    "abs": np.abs,
    "sqrt": np.sqrt,
    "exp": np.exp,
    "sin": np.sin,
    "cos": np.cos,
}
_OPERATIONS: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: np.add,
    ast.Sub: np.subtract,
    ast.Mult: np.multiply,
    ast.Div: np.divide,
    ast.Pow: np.power,
}
