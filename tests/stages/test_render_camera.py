"""The camera: lens and path as the formulas say; depth of field and motion blur as means of sharp pictures."""

import numpy as np
import pytest
from numpy.typing import NDArray
from test_render_frame import config, expansion, hanging

from pipeline.body.placement import Placement
from pipeline.config.schema import Camera, CameraKeyframe, Config, Simulate
from pipeline.errors import InputError
from pipeline.render.camera import CameraPath
from pipeline.render.frame import FrameRenderer, Moment
from pipeline.render.passes import mean, passes, radical_inverse
from pipeline.render.target import Target
from pipeline.render.view import View

EYE, CENTRE = (0.0, 0.0, 0.6), (0.0, 0.0, 0.0)


def path(camera: Camera, frames: int = 24, fps: float = 24.0) -> CameraPath:
    return CameraPath.of(camera, Placement(), frames, fps)


def with_camera(settings: Config, camera: Camera, **render: object) -> Config:
    scene = settings.scene.model_copy(update={"camera": camera})
    return settings.model_copy(update={"scene": scene, "render": settings.render.model_copy(update=render)})


def test_a_focal_length_is_a_field_of_view() -> None:
    """48 mm before 24 mm see 2 atan(1/4), and the sensor's height counts."""
    for length, sensor in ((0.048, 0.024), (0.085, 0.024), (0.018, 0.0149)):
        seen = path(Camera(focal_length=length, sensor=sensor)).at(0.0).field_of_view
        assert seen == pytest.approx(2 * np.arctan(sensor / 2 / length), rel=1e-12)
    assert path(Camera(field_of_view=0.5)).at(0.0).field_of_view == pytest.approx(0.5, rel=1e-12)


def test_a_turntable_goes_round_evenly_and_ends_before_it_begins_again() -> None:
    camera = Camera(
        position=(0.1, 0.3, 0.8), look_at=(0.0, 0.1, 0.0), up=(0.0, 2.0, 0.0), turntable=2 * np.pi
    )
    around = path(camera, frames=36)
    places = np.array([around.at(i / 24).position for i in range(37)])
    steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
    spread = steps.max() / steps.min() - 1
    print(f"steps equal to {spread:.1e}, frame 37 is frame 1 to {np.abs(places[36] - places[0]).max():.1e} m")
    assert spread < 1e-12
    assert np.allclose(places[36], places[0], atol=1e-14)
    assert np.allclose(places[:, 1], 0.3)
    assert places[9, 0] > 0.5, "seen from above it goes counterclockwise, towards +x from +z"


def test_keyframes_are_met_smoothly_and_on_a_line_never_passed() -> None:
    keys = (
        CameraKeyframe(time=0.5, position=(0.0, 0.0, 1.0), focal_length=0.03),
        CameraKeyframe(time=1.0, position=(0.2, 0.1, 0.8), focal_length=0.06),
        CameraKeyframe(time=2.5, position=(0.3, 0.15, 0.7), focal_length=0.12),
    )
    along = path(Camera(keyframes=keys, look_at=CENTRE))
    for key in keys:
        view = along.at(key.time)
        assert np.allclose(view.position, key.position)
        assert view.field_of_view == pytest.approx(2 * np.arctan(0.012 / key.focal_length))
    assert np.allclose(along.at(0.0).position, keys[0].position)
    assert np.allclose(along.at(9.0).position, keys[-1].position)
    times = np.linspace(0.4, 2.6, 2201)
    places = np.array([along.at(time).position for time in times])
    velocity = np.diff(places, axis=0) / np.diff(times)[:, None]
    jump = np.abs(np.diff(velocity, axis=0)).max()
    print(
        f"largest change of the velocity in a millisecond {jump:.4f} m/s, of {np.abs(velocity).max():.2f} m/s"
    )
    assert jump < 0.01
    for axis in range(3):
        assert places[:, axis].max() <= max(key.position[axis] for key in keys) + 1e-12
        assert places[:, axis].min() >= min(key.position[axis] for key in keys) - 1e-12


def test_what_a_keyframe_leaves_open_is_as_without_keyframes() -> None:
    keys = (CameraKeyframe(time=1.0, look_at=(0.0, 0.1, 0.0)), CameraKeyframe(time=2.0))
    along = path(Camera(position=EYE, look_at=CENTRE, keyframes=keys))
    assert np.allclose(along.at(1.5).position, EYE)
    assert np.allclose(along.at(2.0).look_at, CENTRE)


@pytest.mark.parametrize(
    ("camera", "word"),
    [
        (Camera(position=(0, 1, 0), look_at=CENTRE), "line of sight"),
        (Camera(position=CENTRE, look_at=CENTRE), "line of sight"),
        (Camera(position=EYE, look_at=CENTRE, focus=(0, 0, 2)), "focus"),
    ],
)
def test_a_camera_that_sees_nothing_is_refused(camera: Camera, word: str) -> None:
    with pytest.raises(InputError, match=word):
        path(camera).at(0.0)


def on_screen(view: View, target: Target, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Where points (N, 3) lie on the screen, (N, 2), -1 .. 1."""
    target.clear(view, 0.1, 2.0)
    clip = np.c_[points, np.ones(len(points))] @ target.matrix().T
    return clip[:, :2] / clip[:, 3:]


def test_through_any_point_of_the_lens_the_plane_of_sharpness_stays_in_place() -> None:
    camera = Camera(
        position=EYE, look_at=(0.01, 0.02, 0.0), focus=(0.0, 0.0, 0.1), f_stop=0.5, field_of_view=0.4
    )
    view = path(camera).at(0.0)
    assert view.aperture == pytest.approx(0.012 / np.tan(0.2) / 0.5)
    right, up = view.across()
    sharp = view.position + view.focus * view.ahead()
    in_focus = sharp + np.outer([0.0, 0.02, -0.03], right) + np.outer([0.0, 0.01, 0.03], up)
    behind = in_focus + 0.2 * view.ahead()
    target = Target(120, 80, (0, 0, 0))
    whole, whole_behind = on_screen(view, target, in_focus), on_screen(view, target, behind)
    for x, y in ((0.7, 0.0), (0.0, -0.9), (-0.5, 0.5)):
        through = view.through(x, y)
        still = np.abs(on_screen(through, target, in_focus) - whole).max()
        moved = on_screen(through, target, behind) - whole_behind
        # A point behind is seen moved by A/2 (x, y) (1/D - 1/d) in slopes, of which tan(fov/2) is half the height
        slopes = view.aperture / 2 * np.array([x, y]) * (1 / view.focus - 1 / (view.focus + 0.2))
        expected = slopes / np.tan(0.2) * np.array([80 / 120, 1.0])
        print(
            f"lens ({x}, {y}): sharp points move {still:.1e}, points behind by {moved[0]}, expected {expected}"
        )
        assert still < 1e-6
        assert np.allclose(moved, expected, atol=1e-6)
    target.close()


def test_a_point_out_of_focus_is_a_disc_of_the_size_of_the_formula() -> None:
    """A strand of 1 mm, 0.2 m behind the plane of sharpness: rms half width of a disc of diameter c is c/4."""
    camera = Camera(position=EYE, look_at=CENTRE, f_stop=1.0, field_of_view=0.4)
    settings = with_camera(config(width=1e-3, taper=0), camera, passes=64)
    rest = hanging(1, depth=-0.2)
    strands = expansion(rest)
    renderer = FrameRenderer(settings, strands, np.arange(1, dtype=np.uint32))
    moment = Moment(rest, np.eye(4))
    shots = list(passes(settings, path(camera), 1))
    assert len(shots) == 64
    picture = mean(renderer.linear(moment, shot.view) for shot in shots)
    renderer.target.close()
    row = np.abs(picture[48] - picture[0, 0]).sum(axis=1).astype(np.float64)
    x = np.arange(96)
    middle = (row @ x) / row.sum()
    spread = np.sqrt((row @ (x - middle) ** 2) / row.sum())
    aperture = 0.012 / np.tan(0.2)
    disc = aperture * (1 / 0.6 - 1 / 0.8) / np.tan(0.2) * 96 / 2
    width = 1e-3 / (2 * 0.8 * np.tan(0.2)) * 96
    expected = np.sqrt((disc / 4) ** 2 + (width**2 + 1) / 12)
    print(f"disc {disc:.2f} px: rms {spread:.3f} px, expected {expected:.3f}")
    assert spread == pytest.approx(expected, rel=0.03)


def test_samples_of_lens_and_time_are_evenly_spread_whatever_their_number() -> None:
    camera = Camera(position=EYE, look_at=CENTRE, f_stop=2.0, shutter=np.pi)
    for count in (16, 30, 64):
        settings = with_camera(config(), camera, passes=count)
        settings = settings.model_copy(update={"simulate": Simulate(states=10, frames=3)})
        shots = list(passes(settings, path(camera), 2))
        used = np.bincount([shot.back for shot in shots], minlength=5)
        lens = (
            np.array([shot.view.shift for shot in shots]) * shots[0].view.focus / (shots[0].view.aperture / 2)
        )
        radius = np.linalg.norm(lens, axis=1)
        print(
            f"{count} passes: states {used}, lens' middle {lens.mean(axis=0)}, mean r^2 {np.mean(radius**2):.3f}"
        )
        assert [shot.back for shot in shots] == sorted(shot.back for shot in shots)
        assert used.max() - used.min() <= 1
        assert len(used) == 5
        assert radius.max() <= 1
        assert np.abs(lens.mean(axis=0)).max() < 1.5 / np.sqrt(count) / 2
        assert np.mean(radius**2) == pytest.approx(0.5, abs=0.05)
    assert [radical_inverse(i, 2) for i in (1, 2, 3, 4)] == [0.5, 0.25, 0.75, 0.125]


def test_a_shutter_without_states_says_what_to_set() -> None:
    options = {"name": "x", "scene": {"camera": {"shutter": np.pi}}}
    for states, remedy in ((1, "simulate.states = 5"), (2, "simulate.states = 5")):
        with pytest.raises(ValueError, match=remedy):
            Config.model_validate(options | {"simulate": {"states": states}})
    Config.model_validate(options | {"simulate": {"states": 5}})


def test_light_that_is_there_already_gives_the_same_picture() -> None:
    """Views of one moment after one another, each as if it came first."""
    settings, rest = config(), hanging(30)
    renderer = FrameRenderer(settings, expansion(rest), np.arange(30, dtype=np.uint32))
    view = renderer.camera
    moments = [Moment(rest, np.eye(4)), Moment(rest + np.float32(0.01), np.eye(4))]
    views = [View(view.position + move, view.look_at, view.up, view.field_of_view) for move in (0.0, 0.05)]
    apart = [renderer.linear(Moment(moment.guides, moment.pose), at) for moment in moments for at in views]
    together = [renderer.linear(moment, at) for moment in moments for at in views]
    renderer.target.close()
    for one, other in zip(apart, together, strict=True):
        assert np.array_equal(one, other)
    assert not np.array_equal(together[0], together[1])
    assert not np.array_equal(together[0], together[2])
