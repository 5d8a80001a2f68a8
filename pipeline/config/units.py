"""Quantities with units: config values are SI numbers or strings such as "12 cm", "40 um" or "24 fps".

Each alias below is an annotated float that pydantic validates and that the JSON schema describes.
"""

import math
import re
from decimal import Decimal
from typing import Annotated, Any

from pydantic import BeforeValidator, WithJsonSchema

_QUANTITY = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*([^\s\d].*?)?\s*")

_METRES = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "µm": 1e-6, "in": 0.0254}
_SECONDS = {"s": 1.0, "ms": 1e-3}
_RADIANS = {"rad": 1.0, "deg": math.pi / 180, "turn": 2 * math.pi}
_PASCALS = {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9}
_DENSITIES = {"kg/m^3": 1.0, "g/cm^3": 1e3}
_PER_SECOND = {"1/s": 1.0, "Hz": 1.0, "fps": 1.0}
_SPEEDS = {"m/s": 1.0, "cm/s": 1e-2}
_ACCELERATIONS = {"m/s^2": 1.0}
_FORCES = {"N": 1.0, "mN": 1e-3, "uN": 1e-6, "µN": 1e-6}


def parse_quantity(value: Any, units: dict[str, float]) -> float:
    """Turn a number [SI] or a "number unit" string into a float [SI].

    Raises ValueError, naming the accepted units, for anything else: a bare number in quotes, an
    unknown unit, a boolean, an infinity or NaN.

    >>> parse_quantity("40 um", {"m": 1.0, "um": 1e-6})
    4e-05
    >>> parse_quantity("40 furlongs", {"m": 1.0, "um": 1e-6})
    Traceback (most recent call last):
    ValueError: unknown unit 'furlongs'; use one of m, um
    """
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise ValueError(f"expected a number or a string with a unit ({', '.join(units)})")
    if isinstance(value, str):
        match = _QUANTITY.fullmatch(value)
        if match is None or match[2] is None:
            raise ValueError(f'expected a number with a unit, such as "1 {next(iter(units))}"')
        if match[2] not in units:
            raise ValueError(f"unknown unit {match[2]!r}; use one of {', '.join(units)}")
        # Decimal, so that "40 um" is 4e-5 to the last bit: equal values give equal keys.
        value = float(Decimal(match[1]) * Decimal(repr(units[match[2]])))
    if not math.isfinite(value):
        raise ValueError("expected a finite number")
    return float(value)


def _unit_validator(units: dict[str, float]) -> BeforeValidator:
    return BeforeValidator(lambda value: parse_quantity(value, units))


def _unit_schema(units: dict[str, float]) -> WithJsonSchema:
    names = "|".join(re.escape(unit) for unit in units)
    pattern = rf"^\s*[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?\s*({names})\s*$"
    return WithJsonSchema(
        {
            "anyOf": [{"type": "number"}, {"type": "string", "pattern": pattern}],
            "description": f"SI number, or a string with one of the units {', '.join(units)}",
        }
    )


Length = Annotated[float, _unit_validator(_METRES), _unit_schema(_METRES)]
Duration = Annotated[float, _unit_validator(_SECONDS), _unit_schema(_SECONDS)]
Angle = Annotated[float, _unit_validator(_RADIANS), _unit_schema(_RADIANS)]
Pressure = Annotated[float, _unit_validator(_PASCALS), _unit_schema(_PASCALS)]
Density = Annotated[float, _unit_validator(_DENSITIES), _unit_schema(_DENSITIES)]
Rate = Annotated[float, _unit_validator(_PER_SECOND), _unit_schema(_PER_SECOND)]
Speed = Annotated[float, _unit_validator(_SPEEDS), _unit_schema(_SPEEDS)]
Acceleration = Annotated[float, _unit_validator(_ACCELERATIONS), _unit_schema(_ACCELERATIONS)]
Force = Annotated[float, _unit_validator(_FORCES), _unit_schema(_FORCES)]
