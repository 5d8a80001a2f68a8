"""A head that moves and deforms mesh by mesh: read as one skin, followed by roots and hair, drawn as it is."""

from pathlib import Path

import numpy as np
import pytest
from guided_runs import interrupted, resumed
from numpy.typing import NDArray
from PIL import Image
from test_head_mesh import ball, write_obj

from pipeline import cache, kernels
from pipeline.body.roots import SkinRoots, rigid_part
from pipeline.cache.expansion import body_frames, distance_field, expansion_from
from pipeline.config import load as load_config
from pipeline.config.schema import Config
from pipeline.config.sequence import numbered_files
from pipeline.errors import InputError
from pipeline.export.source import opened
from pipeline.groom import stage as groom_stage
from pipeline.interpolate import stage as interpolate_stage
from pipeline.render import stage as render_stage
from pipeline.simulate import stage
from pipeline.simulate.screws import exp, place, rigid
from pipeline.simulate.stepper import Simulation
from pipeline.strands.expand import MovedSkin
from pipeline.strands.formats import Ragged
from pipeline.strands.formats.tfx import write_tfx

Points = NDArray[np.float64]
RADIUS, FRAMES, POINTS = 0.1, 7, 16


def rest_mesh() -> tuple[Points, NDArray[np.int64]]:
    points, faces = ball(4, RADIUS)
    return np.asarray(points, np.float64), np.asarray(faces, np.int64)


def strands(count: int = 40) -> Ragged:
    """Strands that stand on the upper part of the ball, slanted."""
    i = np.arange(count) + 0.5
    y, turn = 1 - 0.6 * i / count, np.pi * (1 + 5**0.5) * i
    out = np.stack([np.sqrt(1 - y * y) * np.cos(turn), y, np.sqrt(1 - y * y) * np.sin(turn)], axis=1)
    along = np.linspace(0, 0.12, POINTS)[None, :, None]  # [m]
    side = np.cross(out, [0.0, 1.0, 0.3])
    points = (
        RADIUS * out[:, None]
        + along * (0.3 * out + 0.95 * side / np.linalg.norm(side, axis=1)[:, None])[:, None]
    )
    pins = np.tile(np.array([2, 0], np.uint8), (count, 1))
    return Ragged(points.reshape(-1, 3), np.full(count, POINTS), pins)


def project(folder: Path, frames: list[Points], **simulate: object) -> tuple[Config, cache.Experiment]:
    """A config with a head, its meshes and a groom on it, groomed."""
    points, faces = rest_mesh()
    head = write_obj(folder / "head.obj", points, faces)
    for number, frame in enumerate(frames, start=1001):
        write_obj(folder / f"body.{number}.obj", frame, faces)
    write_tfx(folder / "hair.tfx", strands())
    config = Config(
        name="body",
        scene={"head": str(head), "body": str(folder / "body.%04d.obj") if frames else None},
        groom={"source": str(folder / "hair.tfx"), "points": POINTS, "strands": 40, "guides": 40},
        simulate={"frames": FRAMES, "settle": 0.2, "rest": "groom", "contact": {"spacing": 5e-3}} | simulate,
    )
    experiment = cache.Experiment(folder / "out")
    groom_stage.execute(config, experiment, "groom")
    return config, experiment


def simulated(config: Config, experiment: cache.Experiment) -> list[cache.Frame]:
    simulation = Simulation(config.simulate, config.seed, stage.read_guides(experiment)[0])
    simulation.settle()
    return list(stage.run(simulation))


def motion() -> Points:
    """Poses of a head that turns and goes, (F, 4, 4)."""
    return exp(np.arange(FRAMES)[:, None] / 24 * np.array([0.5, 3.0, 0.0, 0.3, 0.1, 0.0]))


def bent(points: Points, amount: float) -> Points:
    """The ball leaning over: its top goes sideways and turns."""
    height = np.maximum(points[:, 1] + RADIUS, 0) / (2 * RADIUS)
    angle = amount * height**2
    out = points.copy()
    out[:, 0] = np.cos(angle) * points[:, 0] + np.sin(angle) * points[:, 1]
    out[:, 1] = -np.sin(angle) * points[:, 0] + np.cos(angle) * points[:, 1]
    return out


def test_a_skin_that_moves_rigidly_carries_roots_rigidly() -> None:
    points, faces = rest_mesh()
    roots = strands().points[::POINTS]
    skin = SkinRoots(points, faces, roots, 5e-3)
    pose = rigid(np.array([0.4, -1.0, 2.0]), np.array([0.3, 0.1, -0.2]))
    errors = (
        np.abs(skin.poses(place(pose, points)) - pose).max(),
        np.abs(skin.places(place(pose, points)) - place(pose, roots)).max(),
        np.abs(rigid_part(points, place(pose, points)) - pose).max(),
    )
    print(f"root poses off by {errors[0]:.1e}, places by {errors[1]:.1e} m, rigid part by {errors[2]:.1e}")
    assert max(errors) < 1e-6


def test_roots_stay_on_a_skin_that_deforms_and_turn_with_it() -> None:
    points, faces = rest_mesh()
    roots = strands().points[::POINTS]
    skin = SkinRoots(points, faces, roots, 5e-3)
    swollen = skin.poses(1.1 * points)
    height = np.linalg.norm(place_each(swollen, roots), axis=1) / np.linalg.norm(roots, axis=1)
    print(f"swelling by 1.1 carries roots to {height.min():.5f} to {height.max():.5f} of their radius")
    assert height == pytest.approx(1.1, abs=1e-3)
    assert np.abs(swollen[:, :3, :3] - np.eye(3)).max() < 1e-2
    top = SkinRoots(points, faces, np.array([[0.0, RADIUS, 0.0]]), 5e-3).poses(bent(points, 0.3))[0]
    turned = np.arccos((np.trace(top[:3, :3]) - 1) / 2)
    print(f"the top, turned by 0.3 rad and sheared, has a frame that turned by {turned:.3f} rad")
    assert turned == pytest.approx(0.3, abs=0.1)


def place_each(poses: Points, points: Points) -> Points:
    return np.asarray(np.einsum("nij,nj->ni", poses[:, :3, :3], points) + poses[:, :3, 3])


def test_meshes_that_only_move_are_a_head_that_moves(tmp_path: Path) -> None:
    points, _ = rest_mesh()
    moving, track = tmp_path / "meshes", tmp_path / "track"
    for folder in (moving, track):
        folder.mkdir()
    by_meshes = project(moving, [place(pose, points) for pose in motion()])
    rows = "\n".join(",".join(repr(float(value)) for value in pose.ravel()) for pose in motion())
    (track / "head.csv").write_text(rows)
    by_track = project(track, [], motion={"file": str(track / "head.csv")})
    frames, expected = simulated(*by_meshes), simulated(*by_track)
    poses = max(np.abs(a.pose - b.pose).max() for a, b in zip(frames, expected, strict=True))
    apart = [np.abs(a.points - b.points).max() for a, b in zip(frames, expected, strict=True)]
    contacts = expected[-1].diagnostics["contacts"]
    middle = [float(np.median(np.abs(a.points - b.points))) for a, b in zip(frames, expected, strict=True)]
    print(
        f"poses differ by {poses:.1e}, hair by {max(middle) * 1e3:.4f} mm (median) and {max(apart) * 1e3:.4f} mm at "
        f"most; {contacts:.0f} contacts"
    )
    assert contacts > 0
    assert poses < 1e-6
    assert max(middle) < 1e-5
    assert max(apart) < 3e-3  # where friction holds or lets go depends on the last bits


def test_hair_follows_a_skin_that_deforms_and_stays_outside(tmp_path: Path) -> None:
    points, _ = rest_mesh()
    frames = [bent(points, 0.5 * np.sin(k / (FRAMES - 1) * np.pi)) for k in range(FRAMES)]
    config, experiment = project(tmp_path, frames)
    with cache.open(experiment.groom, "groom") as groom:
        body = body_frames(groom)
    assert body is not None
    result = simulated(config, experiment)
    guides, _ = stage.read_guides(experiment)
    skin = SkinRoots(body.rest, body.triangles, guides.points[:, 0], body.spacing)
    off, lowest = 0.0, np.inf
    for index, frame in enumerate(result):
        expected = place(
            frame.pose, place_each(skin.poses(body.skin(index)), guides.points[:, 0].astype(float))
        )
        off = max(off, float(np.abs(frame.points[:, 0] - expected).max()))
        field = body.grid.field(body.distance(index))
        back = (frame.points.astype(float) - frame.pose[:3, 3]) @ frame.pose[:3, :3]
        distance = kernels.distance(field, np.ascontiguousarray(back[:, 2:].reshape(-1, 3)))[0]
        lowest = min(lowest, float(distance.min()))
    penetration = max(frame.diagnostics["penetration"] for frame in result)
    strain = max(frame.diagnostics["strain"] for frame in result)
    moved = np.abs(body.points[3] - body.points[0]).max()
    print(
        f"skin moves {moved * 1e3:.0f} mm; roots off by {off:.1e} m, penetration {penetration * 1e3:.4f} mm, lowest "
        f"point {lowest * 1e3:.2f} mm, strain {strain:.1e}"
    )
    assert max(frame.diagnostics["contacts"] for frame in result) > 0
    assert moved > 0.01
    assert off < 1e-6
    assert penetration < 1e-4
    assert lowest > -1e-4
    assert strain <= 1.1e-4


def test_every_strand_grows_from_the_skin_of_its_frame_and_is_drawn_there(tmp_path: Path) -> None:
    points, _ = rest_mesh()
    config, experiment = project(tmp_path, [bent(points, 0.12 * k) for k in range(FRAMES)])
    config = config.model_copy(
        update={
            "interpolate": config.interpolate.model_copy(update={"strands": 200}),
            "render": config.render.model_copy(update={"size": (64, 64), "grid": 32}),
        }
    )
    stage.execute(config, experiment, "simulate")
    interpolate_stage.execute(config, experiment, "interpolate")
    with cache.open(experiment.groom, "groom") as groom, cache.open(experiment.strands, "strands") as reader:
        expansion, body = expansion_from(groom, reader, config), body_frames(groom)
        roots, height = reader["strands/root"][:], distance_field(groom)
    assert body is not None
    skin = SkinRoots(body.rest, body.triangles, roots, body.spacing)
    index = FRAMES - 1
    field = body.grid.field(body.distance(index))
    with cache.open_guides(experiment.guides) as guides:
        pose = guides.pose(index)
        expansion.frame(guides.frame(index), pose, MovedSkin(skin.places(body.skin(index)), field))
    strands = expansion.chunk(0, 200).astype(np.float64)
    back = np.ascontiguousarray(((strands - pose[:3, 3]) @ pose[:3, :3]).reshape(-1, 3))
    now = kernels.distance(field, back)[0].reshape(200, -1)
    assert height is not None
    then = kernels.distance(height, roots.astype(np.float64))[0]
    lengths = np.linalg.norm(np.diff(strands, axis=1), axis=2).sum(axis=1)
    print(
        f"roots keep their height to {np.abs(now[:, 0] - then).max() * 1e3:.2f} mm on a skin that moved by "
        f"{np.abs(body.skin(index) - body.skin(0)).max() * 1e3:.0f} mm; deepest point {now[:, 1:].min() * 1e3:.2f} mm"
    )
    assert np.abs(now[:, 0] - then).max() < 5e-4
    assert now[:, 1:].min() > -2e-4
    assert lengths == pytest.approx(0.117, abs=0.008)
    with opened(config, experiment, "strands") as source:
        assert np.array_equal(np.concatenate(list(source.moment(FRAMES))), strands)  # what is exported
    pytest.importorskip("vtk")
    render_stage.execute(config, experiment, "render", frames=(1, FRAMES))
    first, last = (np.asarray(Image.open(experiment.frames / f"{k:04d}.png")) for k in (1, FRAMES))
    changed = (np.abs(first.astype(int) - last.astype(int)).max(axis=2) > 8).mean()
    print(f"{changed:.0%} of the pixels change from frame 1 to frame {FRAMES}")
    assert changed > 0.02


def test_a_sag_free_groom_is_at_rest_on_the_skin_of_the_first_frame(tmp_path: Path) -> None:
    """The skin carries and turns every strand; gravity does not turn with it."""
    points, _ = rest_mesh()
    config, experiment = project(tmp_path, [bent(points, 0.6)], rest="sag_free")
    guides = stage.read_guides(experiment)[0]
    simulation = Simulation(config.simulate, 1, guides)
    start = simulation.state.points.copy()
    carried = np.abs(start - guides.points).max()
    simulation.settle()
    moved = np.linalg.norm(simulation.state.points - start, axis=2)
    print(
        f"the skin carries hair by {carried * 1e3:.0f} mm; settling moves it by {np.median(moved) * 1e3:.4f} mm (median)"
    )
    assert carried > 0.01
    assert np.median(moved) < 1e-5


def test_a_resumed_run_on_a_deforming_skin_is_bit_identical(tmp_path: Path) -> None:
    points, _ = rest_mesh()
    config, experiment = project(tmp_path, [bent(points, 0.1 * k) for k in range(FRAMES - 2)])
    guides = stage.read_guides(experiment)[0]
    frames, saved = interrupted(config.simulate, guides, after=3)
    again = resumed(config.simulate, guides, 3, saved)
    assert [a.points.tobytes() for a in again] == [b.points.tobytes() for b in frames[3:]]


def test_meshes_of_another_head_are_refused(tmp_path: Path) -> None:
    points, faces = rest_mesh()
    config, experiment = project(tmp_path, [points, points])
    write_obj(tmp_path / "body.1003.obj", points, faces[::-1])
    with pytest.raises(InputError, match=r"body\.1003\.obj: 1026 points .* are not the .* of head\.obj"):
        groom_stage.execute(config, experiment, "key")
    with pytest.raises(ValueError, match="needs a head in its rest pose"):
        Config(name="b", scene={"body": str(tmp_path / "body.####.obj")})


def test_a_sequence_is_told_by_its_numbers(tmp_path: Path) -> None:
    (tmp_path / "body").mkdir()
    for number in (7, 8, 9, 10):
        (tmp_path / "body" / f"b{number}.obj").write_text("x")
    expected = [f"b{n}.obj" for n in (7, 8, 9, 10)]
    for pattern in ("body/b%d.obj", "body/b#.obj", "body"):
        assert [path.name for path in numbered_files(tmp_path / pattern)] == expected
    (tmp_path / "body/b8.obj").unlink()
    config = tmp_path / "c.toml"
    for pattern, message in (
        ("body/b%d.obj", r"c\.toml:2: scene\.body: .*number 8 of 7 to 10 is missing"),
        ("body/c%d.obj", r"c\.toml:2: scene\.body: .*no such files"),
        ("body/b7.obj", r"c\.toml:2: scene\.body: .*no place for the number"),
    ):
        config.write_text(f'[scene]\nbody = "{pattern}"\n')
        with pytest.raises(InputError, match=message):
            load_config(config)
