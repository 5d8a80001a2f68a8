"""Files of pins: which points are held, at one end, at both or between, as hinges and as clamps."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from pipeline import cache
from pipeline.config.schema import Config, Keyframe, Simulate
from pipeline.errors import InputError
from pipeline.groom.stage import execute
from pipeline.simulate.screws import rigid
from pipeline.simulate.stage import read_guides
from pipeline.simulate.stepper import Guides, Simulation
from pipeline.strands.held import held_ends, read_held

POINTS = 16


def hanging(held: NDArray[np.uint8], lean: float = 0.02) -> Guides:
    """Straight strands of 15 cm that hang, leaning a little."""
    points = np.zeros((len(held), POINTS, 3), np.float32)
    along = np.linspace(0, 0.15, POINTS)
    points[..., 1], points[..., 0] = -along * np.sqrt(1 - lean**2), lean * along
    return Guides(points, held, np.zeros(held.shape, np.float32))


def settled(guides: Guides, **values: object) -> Simulation:
    simulation = Simulation(Simulate(settle=1.0, rest="groom", **values), 1, guides)
    simulation.settle()
    return simulation


@pytest.mark.parametrize("kind", ["csv", "npy"])
def test_counts_and_masks_say_the_same(tmp_path: Path, kind: str) -> None:
    counts = np.array([[2, 0], [1, 0], [0, 0], [2, 2], [1, 1], [3, 0], [0, 2]])
    expected = held_ends(counts, POINTS)
    for name, values in (("counts", counts), ("mask", expected)):
        path = tmp_path / f"{name}.{kind}"
        if kind == "npy":
            np.save(path, values)
        else:
            head = ["root,tip"] if name == "counts" else []
            path.write_text("\n".join([*head, *(",".join(map(str, row)) for row in values)]))
        assert np.array_equal(read_held(path, len(counts), POINTS), expected)
    assert expected.sum(axis=1).tolist() == [2, 1, 0, 6, 3, 3, 4]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("2,0\n", r"pins of 1 strands; the groom has 2"),
        ("2,0\n2,x\n", r"pins\.csv:2: not a line of numbers: 2,x; a strand has 2"),
        ("2,0\n2\n", r"pins\.csv:2: 1 numbers; a strand has 2 \(held at root and tip\) or 16"),
        ("2,0\n2,0.5\n", r"pins\.csv:2: pins are whole numbers"),
        ("root tip\n2 0\n-1 0\n", r"pins\.csv:3: a number of held points is negative"),
        ("2,0\n9,8\n", r"pins\.csv:2: more held points than the 16"),
        ("1 " * 16 + "\n" + "3 " * 16 + "\n", r"pins\.csv:2: expected 0 \(free\), 1"),
    ],
)
def test_what_is_wrong_with_pins_is_told_with_its_line(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "pins.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=message):
        read_held(path, 2, POINTS)


def test_arrays_that_do_not_fit_are_refused(tmp_path: Path) -> None:
    np.save(tmp_path / "pins.npy", np.zeros((2, 5)))
    with pytest.raises(InputError, match=r"shape \(2, 5\); a strand has 2"):
        read_held(tmp_path / "pins.npy", 2, POINTS)
    (tmp_path / "text.npy").write_text("no")
    with pytest.raises(InputError, match="not a numpy array"):
        read_held(tmp_path / "text.npy", 2, POINTS)


def test_the_groom_holds_what_its_file_says(tmp_path: Path) -> None:
    counts = np.array([[2, 0], [1, 2], [0, 1]])
    np.save(tmp_path / "pins.npy", counts)
    groom = {
        "source": "swatch",
        "strands": 3,
        "guides": 3,
        "points": POINTS,
        "pins": str(tmp_path / "pins.npy"),
    }
    config = Config(name="pins", scene={"head": "none"}, groom=groom)
    experiment = cache.Experiment(tmp_path)
    execute(config, experiment, "key")
    guides, strand = read_guides(experiment)
    assert np.array_equal(guides.held, held_ends(counts, POINTS)[strand])


def test_a_hinge_turns_where_a_clamp_bends() -> None:
    """Gravity pulls a leaning strand down: about a hinge as a whole, below a clamp by bending."""
    points = settled(hanging(held_ends(np.array([[1, 0], [2, 0]]), POINTS), lean=0.3)).state.points
    edge = np.diff(points[:, :3], axis=1)
    angle = np.degrees(np.arctan2(edge[..., 0], -edge[..., 1]))
    print(f"first two segments lean by {angle.round(3).tolist()} degrees: hinge, clamp")
    assert np.abs(angle[0]).max() < 1.0
    assert angle[1, 0] == pytest.approx(np.degrees(np.arcsin(0.3)), abs=1e-4)
    assert angle[1, 1] < angle[1, 0] - 0.5


def test_held_points_stay_and_free_strands_fall() -> None:
    tied = np.zeros((3, POINTS), np.uint8)
    tied[0, [0, 1, 9]] = 1  # tied hair: held in between
    tied[1, [0, -1]] = 1  # both ends, as hinges
    guides = hanging(tied)
    points = settled(guides).state.points
    moved = np.linalg.norm(points - guides.points, axis=2)
    print(f"held points move {moved[tied > 0].max():.1e} m, the free strand falls {moved[2].min():.2f} m")
    assert moved[tied > 0].max() < 1e-8
    assert moved[2].min() > 0.3  # air stops it at about half a metre a second


def test_driven_tips_follow_a_file_as_they_follow_keyframes(tmp_path: Path) -> None:
    guides = hanging(held_ends(np.array([[2, 2], [2, 1]]), POINTS))
    frames, way = 7, np.array([0.0, 0.04, 0.02])
    poses = rigid(np.zeros((frames, 3)), np.linspace(0, 1, frames)[:, None] * way)
    path = tmp_path / "tips.csv"
    path.write_text("\n".join(",".join(map(repr, map(float, pose.ravel()))) for pose in poses))
    for motion in (
        {"tips_file": str(path)},
        {"tips": (Keyframe(time=0.0), Keyframe(time=0.25, position=way))},
    ):
        simulation = settled(guides, frames=frames, **motion)
        for _ in range(frames - 1):
            simulation.next_frame()
        error = np.abs((simulation.state.points - guides.points)[:, -1] - way).max()
        print(f"{next(iter(motion))}: driven tips off by {error:.1e} m")
        assert error < 1e-8


def test_tips_are_brought_to_the_first_pose_of_their_file_before_the_first_frame(tmp_path: Path) -> None:
    guides = hanging(held_ends(np.array([[2, 2]]), POINTS))
    turned = rigid(np.array([0.0, 1.2, 0.0]), np.array([0.0, 0.03, 0.0]), np.array([0.01, 0.0, 0.02]))
    (tmp_path / "tips.csv").write_text(",".join(map(repr, map(float, turned.ravel()))))
    simulation = settled(guides, tips_file=str(tmp_path / "tips.csv"))
    expected = guides.points[:, -2:] @ turned[:3, :3].T + turned[:3, 3]
    assert np.abs(simulation.state.points[:, -2:] - expected).max() < 1e-8
    with pytest.raises(ValueError, match="remove one of them"):
        Simulate(tips_file="x", tips=(Keyframe(time=0.0),))


def test_a_load_on_the_tips_pulls_the_strands_its_way() -> None:
    """100 times the weight, sideways: but for the clamp the strand lies along load and weight."""
    guides = hanging(held_ends(np.array([[1, 0], [2, 0]]), POINTS))
    points = settled(guides, tip_load=(1e-3, 0.0, 0.0)).state.points
    last = points[:, -1] - points[:, -2]
    weight = 1300 * np.pi * 40e-6**2 * 0.01 / 2 * 9.81  # of the tip: half a segment
    angle = np.degrees(np.arctan2(-last[:, 1], last[:, 0]))
    print(
        f"last segments {angle.round(4).tolist()} degrees below the load, expected {np.degrees(weight / 1e-3):.4f}"
    )
    assert angle[0] == pytest.approx(np.degrees(weight / 1e-3), abs=0.01)
    assert angle[1] == pytest.approx(0.0, abs=5.0)
