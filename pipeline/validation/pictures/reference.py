"""Path-traced pictures with all that is needed to make them again: a folder with `scenes.json`, strands and EXR files.

A scene names its strands (an npz of positions (S, P, 3) [m]), radius, fibre, camera, directional lights, constant sky
and bodies; a picture is linear, premultiplied, without background.
"""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.config.schema import Camera, Fibre, Light

_F32 = NDArray[np.float32]


@dataclass(frozen=True)
class Body:
    """A surface that is no hair."""

    points: _F32
    """(V, 3) [m]"""
    triangles: NDArray[np.int32]
    """(T, 3), wound outwards."""
    albedo: float


@dataclass(frozen=True)
class Reference:
    """A scene and its pictures (H, W, 4): linear RGB, premultiplied, and coverage."""

    name: str
    strands: _F32
    """(S, P, 3) [m]"""
    width: float
    """[m] diameter."""
    fibre: Fibre
    camera: Camera
    lights: tuple[Light, ...]
    environment: tuple[float, float, float]
    bodies: tuple[Body, ...]
    smooth: _F32
    """Denoised."""
    noisy: _F32
    """As sampled: fibre for fibre, and noise."""


def names(folder: Path) -> list[str]:
    """The scenes of a folder."""
    return [scene["name"] for scene in _scenes(folder)]


def load(folder: Path, name: str) -> Reference:
    """A scene of a folder. Raises KeyError for one that is not there, ImportError without OpenEXR."""
    found = [scene for scene in _scenes(folder) if scene["name"] == name]
    if not found:
        raise KeyError(name)
    scene = found[0]
    camera, images = scene["camera"], scene["images"]
    with np.load(folder / scene["strands_file"]) as file:
        strands = np.ascontiguousarray(file["positions"], np.float32)
    return Reference(
        name=name,
        strands=strands,
        width=2 * scene["radius_m"],
        fibre=_fibre(scene["material"]),
        camera=Camera(
            position=tuple(camera["eye"]),
            look_at=tuple(camera["target"]),
            up=tuple(camera["up"]),
            field_of_view=np.radians(camera["vfov_deg"]),
        ),
        lights=tuple(
            Light(
                direction=tuple(each["to_light"]), colour=tuple(each["color"]), irradiance=each["irradiance"]
            )
            for each in scene["lights"]
        ),
        environment=tuple(scene["environment_radiance"]),
        bodies=tuple(_body(folder, body) for body in scene["bodies"]),
        smooth=read_exr(folder / images["exr"]),
        noisy=read_exr(folder / images["noisy_exr"]),
    )


def read_exr(path: Path) -> _F32:
    """The first layer of an EXR file, (H, W, channels) or (H, W)."""
    import OpenEXR

    channels = OpenEXR.File(str(path)).channels()
    return np.asarray(next(iter(channels.values())).pixels, np.float32)


def _scenes(folder: Path) -> list[dict[str, Any]]:
    scenes: list[dict[str, Any]] = json.loads((folder / "scenes.json").read_text("utf-8"))["scenes"]
    return scenes


def _fibre(material: dict[str, Any]) -> Fibre:
    return Fibre(
        melanin=material["melanin"],
        redness=material["melanin_redness"],
        melanin_jitter=0,
        roughness=material["roughness"],
        azimuthal_roughness=material["radial_roughness"],
        tilt=np.radians(material["offset_deg"]),
    )


def _body(folder: Path, body: dict[str, Any]) -> Body:
    if body["type"] == "cylinder":
        return _cylinder(body["radius"], body["length"], body["albedo"])
    words = [line.split() for line in (folder / body["file"]).read_text("utf-8").splitlines()]
    points = np.array([w[1:4] for w in words if w[:1] == ["v"]], np.float32)
    faces = [[int(corner.split("/")[0]) - 1 for corner in w[1:]] for w in words if w[:1] == ["f"]]
    fans = [[face[0], *face[k : k + 2]] for face in faces for k in range(1, len(face) - 1)]
    return Body(points, np.array(fans, np.int32), body["albedo"])


def _cylinder(radius: float, length: float, albedo: float, sides: int = 256) -> Body:
    """A cylinder about x, with lids: what is open in the reference no hair looks into."""
    turn = np.arange(sides) * 2 * np.pi / sides
    ring = radius * np.stack([0 * turn, np.cos(turn), np.sin(turn)], axis=-1)
    ends = [ring + np.array([x, 0, 0]) for x in (-length / 2, length / 2)]
    middles = np.array([[-length / 2, 0, 0], [length / 2, 0, 0]])
    i = np.arange(sides)
    j, left, right = (i + 1) % sides, 2 * sides + 0 * i, 2 * sides + 1 + 0 * i
    parts = [(i, j, i + sides), (j, j + sides, i + sides), (left, j, i), (right, i + sides, j + sides)]
    triangles = np.concatenate([np.stack(part, axis=-1) for part in parts])
    return Body(np.concatenate([*ends, middles]).astype(np.float32), triangles.astype(np.int32), albedo)
