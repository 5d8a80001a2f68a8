"""The camera over time: from its options to the view at any time, a function of time alone.

Time 0 is frame 1. Keyframes lie on smooth curves that rest at both ends (keyed.py), zooms on one of the logarithm of the
focal length. The turntable turns at an even rate about the point that is looked at, before frame 1 and after the last
as well, so that a full turn has neither beginning nor end.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.body.keyed import keyed
from pipeline.body.placement import Placement
from pipeline.config.schema import Camera
from pipeline.errors import InputError
from pipeline.render.view import Place, View

# [m] from the built-in head, unless they are told
_POSITION, _LOOK_AT = (0.40, 0.02, 0.80), (0.0, -0.03, 0.0)
_Curve = Callable[[float], NDArray[np.float64]]


@dataclass(frozen=True)
class CameraPath:
    """Where the camera is at any time [s]."""

    camera: Camera
    position: _Curve
    look_at: _Curve
    focal_length: _Curve
    """(1,) [m]"""
    focus: _Curve | None
    turn: float
    """[rad/s]"""

    @classmethod
    def of(cls, camera: Camera, head: Placement, frames: int = 1, fps: float = 24.0) -> "CameraPath":
        """The path of a camera; what its options leave open follows from where the head stands."""
        told = zip((camera.position, camera.look_at), (_POSITION, _LOOK_AT), strict=True)
        position, look_at = (head.world(usual) if place is None else np.array(place) for place, usual in told)
        length = camera.focal_length or camera.sensor / 2 / np.tan(camera.field_of_view / 2)
        zoom = _curve(camera, "focal_length", np.array([length]), np.log)
        focused = camera.focus is not None or any(key.focus is not None for key in camera.keyframes)
        focus = _curve(camera, "focus", np.array(camera.focus or look_at)) if focused else None
        return cls(
            camera,
            _curve(camera, "position", position),
            _curve(camera, "look_at", look_at),
            lambda time: np.exp(zoom(time)),
            focus,
            camera.turntable * fps / frames,
        )

    def at(self, time: float) -> View:
        """The view at a time [s]. Raises InputError where nothing can be seen or be sharp."""
        look_at = self.look_at(time)
        position = look_at + _turned(self.position(time) - look_at, self.camera.up, self.turn * time)
        way = look_at - position
        distance = float(np.linalg.norm(way))
        across = np.linalg.norm(np.cross(way, np.array(self.camera.up))) / np.linalg.norm(self.camera.up)
        if across <= 1e-9 * max(distance, 1.0):
            where = f"at {time:g} s" if self.camera.keyframes else "as it stands"
            raise InputError(
                f"scene.camera: {where} it has no line of sight across `up`; move position away from look_at, or change up"
            )
        length = float(self.focal_length(time)[0])
        focus = distance if self.focus is None else float((self.focus(time) - position) @ way / distance)
        if focus <= 0:
            raise InputError(
                "scene.camera.focus: this point is behind the camera; set one that is in the picture"
            )
        aperture = 0.0 if self.camera.f_stop is None else length / self.camera.f_stop
        field_of_view = 2 * float(np.arctan(self.camera.sensor / 2 / length))
        return View(position, look_at, self.camera.up, field_of_view, aperture, focus)


def _curve(
    camera: Camera,
    name: str,
    usual: Place,
    scale: Callable[[NDArray[np.float64]], NDArray[np.float64]] = lambda x: x,
) -> _Curve:
    """One value of the keyframes over time; `usual` where none of them sets it, or one leaves it open."""
    told = [getattr(key, name) for key in camera.keyframes]
    if not told or all(value is None for value in told):
        return lambda _: scale(usual)
    values = [usual if value is None else np.atleast_1d(np.array(value, np.float64)) for value in told]
    return keyed(np.array([key.time for key in camera.keyframes]), scale(np.array(values)))


def _turned(way: Place, up: tuple[float, float, float], angle: float) -> Place:
    """A vector turned about an axis by an angle [rad] (Rodrigues, 1840)."""
    axis = np.array(up) / np.linalg.norm(up)
    along = (way @ axis) * axis
    return np.asarray(along + np.cos(angle) * (way - along) + np.sin(angle) * np.cross(axis, way))
