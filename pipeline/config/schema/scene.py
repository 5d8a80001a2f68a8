"""Options of the scene: head, lights and what is around them."""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from pipeline.config.schema.base import Colour, FaceAxis, Section, Vector
from pipeline.config.schema.camera import Camera


class Light(Section):
    direction: Vector
    """From the scene towards the light; normalised on use."""
    colour: Colour = (1.0, 1.0, 1.0)
    """Linear RGB."""
    irradiance: Annotated[float, Field(ge=0)] = 1.0
    """Irradiance on a surface that faces the light [W/m^2]; multiplies the colour."""


class Scene(Section):
    head: str = "builtin"
    """"builtin" (the mannequin), "none" (strands alone) or the path of a closed mesh, relative to the config."""
    body: str | None = None
    """The head in motion: a mesh a frame with the points and faces of `head`, as a pattern ("body.%04d.obj", "body.####.ply") or a folder of numbered files, relative to the config; the first is frame 1, the last is held."""
    unit_scale: Annotated[float, Field(gt=0)] = 1.0
    """Metres per unit of the head's mesh file (0.01 for centimetres)."""
    up_axis: Literal["x", "y", "z"] = "y"
    """Which axis of the head's mesh file points up."""
    face_axis: FaceAxis | None = None
    """Which axis of that file the face looks along; unset, z, or -y where z is up."""
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

    @model_validator(mode="after")
    def _faces_ahead(self) -> "Scene":
        if self.face_axis is not None and self.face_axis[-1] == self.up_axis:
            raise ValueError(f'a face that looks along "{self.face_axis}" cannot have "{self.up_axis}" up')
        return self

    @model_validator(mode="after")
    def _body_fits_head(self) -> "Scene":
        if self.body is not None and self.head in ("builtin", "none"):
            raise ValueError(
                "body needs a head in its rest pose with the same points; set scene.head to its mesh"
            )
        return self
