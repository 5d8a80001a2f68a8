"""Options of a light, and the presets of `scene.lighting`: lights and a sky that go together."""

from dataclasses import dataclass
from typing import Annotated, Any, Literal

from pydantic import Field

from pipeline.config.schema.base import Colour, Section, Vector
from pipeline.config.units import Angle


class Light(Section):
    direction: Vector
    """From the scene towards the light; normalised on use."""
    colour: Colour = (1.0, 1.0, 1.0)
    """Linear RGB."""
    irradiance: Annotated[float, Field(ge=0)] = 1.0
    """Irradiance on a surface that faces the light [W/m^2]; multiplies the colour."""
    softness: Annotated[Angle, Field(ge=0, le=3.141592653589793)] = 0.0
    """Angle that the light fills, as seen from the scene: 0.5 deg for the sun, 40 deg for a near softbox. Soft lights are sums of 4 to 16 sharp ones, each of which costs what a light costs."""


Lighting = Literal["studio", "soft", "butterfly", "rim", "back", "sun", "overcast", "dusk"]


@dataclass(frozen=True)
class Preset:
    """What a preset stands for where the config sets nothing else."""

    lights: tuple[Light, ...]
    environment: Colour


_WARM, _COOL = (1.0, 0.96, 0.9), (0.85, 0.92, 1.0)

PRESETS: dict[str, Preset] = {
    "studio": Preset(  # key, fill and rim, all sharp
        (
            Light(direction=(0.55, 0.75, 0.80), colour=_WARM, irradiance=3.2),
            Light(direction=(-0.90, 0.25, 0.60), colour=_COOL, irradiance=0.8),
            Light(direction=(-0.50, 0.58, -0.85), irradiance=1.4),
        ),
        (0.16, 0.16, 0.16),
    ),
    "soft": Preset(  # the same from a large window and reflectors
        (
            Light(direction=(0.60, 0.60, 0.75), colour=_WARM, irradiance=2.6, softness=0.75),
            Light(direction=(-0.90, 0.15, 0.60), colour=_COOL, irradiance=0.7, softness=0.9),
            Light(direction=(-0.40, 0.60, -0.90), irradiance=1.6, softness=0.4),
        ),
        (0.22, 0.22, 0.23),
    ),
    "butterfly": Preset(  # high in front of the face, a reflector below
        (
            Light(direction=(0.05, 0.85, 0.95), colour=_WARM, irradiance=3.2, softness=0.35),
            Light(direction=(0.0, -0.60, 0.90), irradiance=0.5, softness=0.8),
            Light(direction=(0.0, 0.45, -0.90), irradiance=0.9, softness=0.2),
        ),
        (0.12, 0.12, 0.13),
    ),
    "rim": Preset(  # an outline on both sides of a dim face
        (
            Light(direction=(0.95, 0.40, -0.60), colour=_WARM, irradiance=2.4),
            Light(direction=(-0.95, 0.40, -0.60), colour=_COOL, irradiance=2.4),
            Light(direction=(0.30, 0.40, 0.95), irradiance=0.8, softness=0.6),
        ),
        (0.05, 0.05, 0.06),
    ),
    "back": Preset(  # through the hair, towards the camera
        (
            Light(direction=(-0.15, 0.45, -0.95), colour=(1.0, 0.92, 0.8), irradiance=6.0, softness=0.1),
            Light(direction=(0.40, 0.30, 0.90), irradiance=0.5, softness=0.8),
        ),
        (0.12, 0.12, 0.13),
    ),
    "sun": Preset(  # noon: a sharp warm sun, a blue sky
        (Light(direction=(0.45, 0.85, 0.35), colour=(1.0, 0.95, 0.86), irradiance=4.2, softness=0.0093),),
        (0.22, 0.28, 0.38),
    ),
    "overcast": Preset(  # light from everywhere, a little more from above
        (Light(direction=(0.0, 1.0, 0.1), irradiance=0.8, softness=2.2),),
        (0.55, 0.57, 0.60),
    ),
    "dusk": Preset(  # a low red sun, a dark blue sky
        (Light(direction=(-0.90, 0.18, 0.30), colour=(1.0, 0.55, 0.28), irradiance=3.0, softness=0.0093),),
        (0.09, 0.12, 0.20),
    ),
}


def preset_of(scene: dict[str, Any]) -> Preset:
    """The preset that the options of a scene name; the usual one where they name none that there is."""
    return PRESETS[scene.get("lighting", "studio")]
