"""Whole frames of a few strands: what hides what, chunks, background, provenance."""

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from pipeline import cache, kernels
from pipeline.compare.metrics import measure
from pipeline.config.schema import Camera, Config, Groom, Render, Scene
from pipeline.render import chunks
from pipeline.render.finer import Finer
from pipeline.render.frame import FrameRenderer, Moment, Skin
from pipeline.render.tone import to_srgb
from pipeline.strands.expand import Binding, Expansion

EYE = (0.0, 0.0, 0.6)


def config(**render: object) -> Config:
    camera = Camera(position=EYE, look_at=(0, 0, 0), field_of_view=0.4)
    options = {"size": (96, 96), "grid": 32} | render
    scene = Scene(head="none", camera=camera, background=(0.2, 0.4, 0.1))
    return Config(name="small", scene=scene, groom=Groom(source="swatch"), render=Render(**options))


def expansion(rest: NDArray[np.float32]) -> Expansion:
    count = len(rest)
    own = np.arange(count, dtype=np.uint32)
    binding = Binding(
        parent=own,
        root=np.ascontiguousarray(rest[:, 0]),
        guide=own[:, None].copy(),
        weight=np.ones((count, 1), np.float32),
        key=own * np.uint32(2654435761),
        scale=np.ones(count, np.float32),
        phase=np.zeros(count, np.float32),
    )
    return Expansion(rest, rest, binding)


def hanging(count: int, depth: float = 0.0) -> NDArray[np.float32]:
    """Vertical strands side by side in the plane z = depth."""
    x = np.linspace(-0.05, 0.05, count) if count > 1 else np.zeros(1)
    y = np.linspace(0.05, -0.05, 16)
    points = np.zeros((count, 16, 3), np.float32)
    points[..., 0], points[..., 1], points[..., 2] = x[:, None], y, depth
    return points


def render(settings: Config, rest: NDArray[np.float32], skin: Skin | None = None) -> NDArray[np.uint8]:
    strands = expansion(rest)
    renderer = FrameRenderer(settings, strands, np.arange(len(rest), dtype=np.uint32), skin)
    picture = renderer.frame(Moment(rest, np.eye(4)))
    renderer.target.close()
    return picture


def ball(radius: float = 0.02) -> Skin:
    """A head in the shape of a ball at the origin."""
    import pyvista as pv

    sphere = pv.Sphere(radius=radius, theta_resolution=24, phi_resolution=24)
    axis = np.arange(-0.06, 0.061, 0.004)
    x, y, z = np.meshgrid(axis, axis, axis, indexing="ij")
    distance = (np.sqrt(x**2 + y**2 + z**2) - radius).astype(np.float32)
    points = np.asarray(sphere.points, np.float32)
    return Skin(
        points=points,
        triangles=np.asarray(sphere.regular_faces, np.int32),
        normals=points / np.float32(radius),
        albedo=np.full(points.shape, 0.5, np.float32),
        field=kernels.DistanceField(distance, np.full(3, axis[0]), 0.004),
    )


def test_the_background_has_the_colour_of_the_config() -> None:
    corner = render(config(), hanging(3))[0, 0].astype(int)
    wanted = np.round(255 * to_srgb(np.array([0.2, 0.4, 0.1]))).astype(int)
    print(f"background {corner}, wanted {wanted}")
    assert np.abs(corner - wanted).max() <= 3


@pytest.mark.parametrize("geometry", ["coverage", "lines", "ribbons", "tubes"])
def test_any_chunking_gives_the_same_pixels(geometry: str, monkeypatch: pytest.MonkeyPatch) -> None:
    settings = config(geometry=geometry, width=1e-3)
    whole = render(settings, hanging(40))
    monkeypatch.setattr(chunks, "CHUNK", 7)
    assert np.array_equal(render(settings, hanging(40)), whole)
    for some in (2000, 0):
        monkeypatch.setattr(chunks, "KEPT", some)
        assert np.array_equal(render(settings, hanging(40)), whole)


@pytest.mark.parametrize("geometry", ["coverage", "ribbons", "tubes"])
def test_a_strand_is_as_wide_as_it_should_be(geometry: str) -> None:
    settings = config(geometry=geometry, width=0.01, taper=0, samples=4)
    picture = render(settings, hanging(1)).astype(int)
    row = np.abs(picture[48] - picture[0, 0]).max(axis=1)
    covered = int((row > 30).sum())
    wanted = 0.01 / (2 * 0.6 * np.tan(0.2)) * 96
    print(f"{geometry}: {covered} px, wanted {wanted:.2f}")
    assert abs(covered - wanted) <= 1.5


def test_the_head_hides_what_is_behind_it() -> None:
    settings = config(geometry="ribbons", width=2e-3)
    empty, behind, before = (
        render(settings, hanging(1, depth), ball()).astype(int) for depth in (5.0, -0.04, 0.04)
    )
    middle = (slice(46, 50), slice(44, 52))
    assert np.abs(behind[middle] - empty[middle]).max() <= 12
    assert np.abs(before[middle] - empty[middle]).max() > 30


def test_of_a_closed_head_nothing_is_missed_that_faces_away(monkeypatch: pytest.MonkeyPatch) -> None:
    rest, skin = hanging(40), ball()
    faces = Finer(skin.triangles, len(skin.points))
    eye = np.array([0.0, 0.0, 0.6])
    points, triangles = faces.facing(skin.points, skin.normals, eye)
    print(f"{len(triangles)} of {4 * len(skin.triangles)} triangles, {len(points)} points are drawn")
    assert faces.closed
    assert 0.3 < len(triangles) / (4 * len(skin.triangles)) < 0.5
    front = render(config(), rest, skin)
    facing = Finer.facing

    def everything(self: Finer, *arguments: Any) -> Any:
        self.closed = False
        return facing(self, *arguments)

    monkeypatch.setattr(Finer, "facing", everything)
    assert np.array_equal(render(config(), rest, skin), front)


def test_a_frame_of_the_same_moment_has_the_same_bytes() -> None:
    settings = config()
    assert np.array_equal(render(settings, hanging(30)), render(settings, hanging(30)))


def test_pictures_carry_their_key_and_broken_ones_are_noticed(tmp_path: Path) -> None:
    path = tmp_path / "0001.png"
    cache.write_picture(path, render(config(), hanging(3)), "key", {"seed": 1}, fingerprint="here")
    assert cache.picture_record(path) == ("key", {"seed": 1})
    with Image.open(path) as image:
        assert image.info["ringlet.fingerprint"] == "here"
    path.write_bytes(path.read_bytes()[:-40])
    with pytest.raises(cache.Damaged):
        cache.picture_record(path)


def test_a_machine_without_opengl_gets_one_clear_message() -> None:
    program = "from pipeline.render.target import Target; Target(8, 8, (0, 0, 0))"
    blind = os.environ | {"__EGL_VENDOR_LIBRARY_DIRS": "/nonexistent"}
    result = subprocess.run([sys.executable, "-c", program], env=blind, capture_output=True, text=True)
    assert "InputError: render: no off-screen OpenGL" in result.stderr
    assert "apt-get install -y libegl1 libgl1-mesa-dri" in result.stderr
    assert "vtk" not in result.stderr.replace("pipeline", "").lower().split("inputerror")[1]


def test_coverage_looks_as_lines_of_8_x_8_samples() -> None:
    """Strands an eighth of a pixel wide, which is one sample; several cover one another."""
    wide = 2 * 0.6 * np.tan(0.2) / 96 / 8
    random = np.random.default_rng(4)
    rest = hanging(4000)
    rest[..., 0] += np.cumsum(random.normal(0, 4e-4, rest.shape[:2]), axis=1).astype(np.float32)
    rest[..., 2] = random.uniform(-0.01, 0.01, (len(rest), 1))
    pictures = [
        render(config(geometry=geometry, width=wide, taper=0, samples=8), rest)
        for geometry in ("coverage", "lines")
    ]
    found = measure(pictures[1], pictures[0])
    covered = (np.abs(pictures[0].astype(int) - pictures[0][0, 0]).max(axis=2) > 8).mean()
    print(f"FLIP {found.flip:.4f}, hair in {covered:.0%} of the picture")
    assert covered > 0.15
    assert found.flip < 0.03
