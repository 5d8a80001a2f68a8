"""Options of the scene: head, lights and what is around them."""

from typing import Annotated, Literal

from pydantic import Field, model_validator

from pipeline.config.schema.base import Colour, FaceAxis, Section
from pipeline.config.schema.camera import Camera
from pipeline.config.schema.lights import Light, Lighting, preset_of


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
    lighting: Lighting = "studio"
    """Preset of lights and environment, where these are not set: "studio" (key, fill and rim), "soft" (large windows), "butterfly" (high in front), "rim" (both edges), "back" (through the hair), "sun", "overcast" or "dusk"."""
    environment: Colour = Field(default_factory=lambda scene: preset_of(scene).environment)
    """Linear RGB radiance of a constant sky that lights everything; unset, the preset's."""
    lights: tuple[Light, ...] = Field(default_factory=lambda scene: preset_of(scene).lights)
    """Directional lights; unset, the preset's."""
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
