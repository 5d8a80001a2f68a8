"""The simulate stage: roots follow the head, results depend on nothing but the config, and runs resume exactly."""

import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from guided_runs import experiment_with_groom, interrupted, resumed, simulated

from pipeline import cache, kernels
from pipeline.bench.scaling import scaling
from pipeline.bench.simulate import bench, round_head
from pipeline.config.schema import Config, Keyframe, Motion, Simulate
from pipeline.errors import InputError
from pipeline.simulate import stage
from pipeline.simulate.hair_contact import Cost
from pipeline.simulate.motion import head_motion
from pipeline.simulate.rest import rest_shape
from pipeline.simulate.screws import place, rotation_matrix
from pipeline.simulate.stepper import Guides, Simulation, SimulationDiverged
from pipeline.strands.held import held_ends

GUIDES, POINTS = 37, 16
SHAKE = Motion(preset="shake", period=0.4, amplitude=0.6, pivot=(0.0, -0.05, 0.0))
SHORT = Simulate(frames=6, substeps=10, settle=0.2, motion=SHAKE, air={"gusts": 1.0})


@pytest.fixture
def guides() -> Guides:
    return round_head(GUIDES, POINTS)


def bytes_of(frames: list[cache.Frame]) -> list[bytes]:
    return [
        frame.points.tobytes() + frame.pose.tobytes() + repr(frame.diagnostics).encode() for frame in frames
    ]


@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_a_resumed_run_is_bit_identical(guides: Guides, precision: str) -> None:
    simulate = SHORT.model_copy(update={"precision": precision})
    frames, saved = interrupted(simulate, guides, after=3)
    assert bytes_of(resumed(simulate, guides, 3, saved)) == bytes_of(frames[3:])


def test_guides_do_not_depend_on_the_number_of_threads(guides: Guides) -> None:
    results = []
    for threads in (1, 2):
        kernels.set_threads(threads)
        results.append(bytes_of(simulated(SHORT, guides)))
    kernels.set_threads(0)
    assert results[0] == results[1]


def test_roots_move_exactly_with_the_head(guides: Guides) -> None:
    head = head_motion(SHAKE)
    frames = simulated(SHORT.model_copy(update={"precision": "float64"}), guides)
    errors = []
    for index, frame in enumerate(frames):
        pose = head(index / SHORT.fps)
        assert np.array_equal(frame.pose, pose)
        errors.append(np.abs(frame.points[:, :2] - place(pose, guides.points[:, :2])).max())
    moved = np.abs(frames[-1].pose - np.eye(4)).max()
    print(f"roots off by {max(errors):.1e} m, head turned by {moved:.2f}")
    assert max(errors) < 1e-7  # the float32 of the result
    assert moved > 0.1


def test_guides_stay_outside_the_head_and_keep_their_length(guides: Guides) -> None:
    frames = simulated(SHORT.model_copy(update={"settle": 1.0}), guides)
    penetration = max(frame.diagnostics["penetration"] for frame in frames)
    strain = max(frame.diagnostics["strain"] for frame in frames)
    contacts = max(frame.diagnostics["contacts"] for frame in frames)
    print(f"penetration {penetration * 1e3:.4f} mm, strain {strain:.1e}, {contacts:.0f} contacts")
    assert penetration <= 0.06e-3
    assert strain <= 2e-4
    assert contacts > 0


def test_float32_and_float64_agree(guides: Guides) -> None:
    results = [
        simulated(SHORT.model_copy(update={"precision": precision}), guides)[-1].points
        for precision in ("float32", "float64")
    ]
    difference = np.linalg.norm(results[0] - results[1], axis=2)
    print(f"float32 against float64: median {np.median(difference):.1e} m, largest {difference.max():.1e} m")
    assert np.median(difference) < 1e-4


def test_hair_at_rest_stays_at_rest(guides: Guides) -> None:
    frames = simulated(Simulate(frames=2, settle=4.0), guides)
    moved = np.abs(frames[1].points - frames[0].points).max()
    print(
        f"after 4 s of settling a frame moves {moved:.1e} m, kinetic {frames[1].diagnostics['kinetic']:.1e} J"
    )
    assert moved < 1e-4


def test_rest_torsion_of_nearly_straight_hair_is_bounded() -> None:
    """Without the bound, noise of 1e6 /m tears curls whose roots are straight, under "frenet"."""
    late = curls_with_straight_roots(GUIDES)
    unbounded = np.nanmax(np.abs(kernels.torsion(late.points.astype(np.float64), "equal")))
    rest = rest_shape(SHORT.hair, late.points, late.held, late.offset)
    turn = np.abs(rest.torsion * rest.length.mean(axis=1, keepdims=True)).max()
    print(f"largest torsion {unbounded:.1e} /m, bounded to {turn:.2f} rad a segment")
    assert turn <= np.pi + 1e-9 < unbounded * rest.length.mean()
    frames = simulated(SHORT.model_copy(update={"torsion": "frenet"}), late)
    strain = max(frame.diagnostics["strain"] for frame in frames)
    print(f"largest strain {strain:.1e}")
    assert strain <= 2e-4


def curls_with_straight_roots(count: int) -> Guides:
    along = np.linspace(0, 0.2, 32)
    radius = 0.008 * np.clip((along - 0.03) / 0.08, 0, 1)
    curl = np.stack([radius * np.cos(along * 300), -along, radius * np.sin(along * 300)], axis=-1)
    slanted = [curl @ rotation_matrix(np.array([2.0, 0.0, 0.01 * i])) for i in range(count)]
    held = held_ends(np.tile([2, 0], (count, 1)), 32)
    return Guides(np.array(slanted, np.float32), held, np.zeros((count, 32), np.float32))


def swatch(count: int = 3) -> Guides:
    points = np.zeros((count, POINTS, 3), np.float32)
    points[..., 1] = -np.linspace(0, 0.2, POINTS)
    points[..., 0] = 0.01 * np.arange(count)[:, None]
    held = held_ends(np.tile([2, 2], (count, 1)), POINTS)
    return Guides(points, held, np.zeros((count, POINTS), np.float32))


def test_pinned_tips_follow_their_keyframes_relative_to_the_head() -> None:
    tips = (Keyframe(time=0.0), Keyframe(time=0.125, position=(0.0, 0.05, 0.01)))
    head = Motion(keyframes=(Keyframe(time=0.0), Keyframe(time=0.125, position=(0.02, 0.0, 0.0))))
    frames = simulated(Simulate(frames=5, settle=0.1, tips=tips, motion=head), swatch())
    expected = swatch().points[:, -2:] + (0.02, 0.05, 0.01)
    error = np.abs(frames[-1].points[:, -2:] - expected).max()
    print(f"driven tips off by {error:.1e} m")
    assert error < 1e-7


def test_moving_tips_that_nobody_holds_is_an_error(guides: Guides) -> None:
    simulate = Simulate(tips=(Keyframe(time=0.0),))
    with pytest.raises(InputError, match=r"simulate\.tips: no strand has a pinned tip"):
        Simulation(simulate, 3, guides)


def test_divergence_names_guide_and_frame(guides: Guides) -> None:
    simulation = Simulation(SHORT, 3, guides)
    simulation.state.points[5, 9] = np.nan
    with pytest.raises(
        SimulationDiverged, match=r"guide 5 diverged before frame 2; raise simulate\.substeps"
    ):
        simulation.next_frame()


def test_torn_strands_count_as_diverged(guides: Guides) -> None:
    simulation = Simulation(SHORT, 3, guides)
    simulation.settle()
    simulation.state.points[7, 4:] += 50.0
    with pytest.raises(SimulationDiverged, match="guide 7"):
        simulation.next_frame()


# --- with files -----------------------------------------------------------------------------------

CONFIG = Config(
    name="test",
    scene={"head": "none"},
    groom={"source": "swatch"},
    simulate={"frames": 20, "settle": 0.1, "air": {"gusts": 2.0}, "substeps": 4},
)


def test_a_killed_run_goes_on_to_the_same_file(tmp_path: Path) -> None:
    undisturbed = experiment_with_groom(tmp_path / "whole", swatch())
    killed = experiment_with_groom(tmp_path / "killed", swatch())
    stage.execute(CONFIG, undisturbed, "key")
    program = f"""
import os, signal
from pathlib import Path
from pipeline import cache
from pipeline.config.schema import Config
from pipeline.simulate import stage, stepper
steps = []
def next_frame(self, step=stepper.Simulation.next_frame):
    steps.append(step(self))
    if len(steps) == 13:
        os.kill(os.getpid(), signal.SIGKILL)
stepper.Simulation.next_frame = next_frame
stage.execute(Config.model_validate_json({CONFIG.model_dump_json()!r}), cache.Experiment(Path({str(killed.folder)!r})), "key")
"""
    ended = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, cwd=Path(__file__).parents[2]
    )
    assert ended.returncode == -signal.SIGKILL, ended.stderr.decode()
    done, _ = cache.Segments(killed.guides, "key").resume()
    print(f"killed after 13 frames, {done} of them kept")
    assert done == stage.CHECKPOINT_FRAMES
    assert not killed.guides.exists()
    stage.execute(CONFIG, killed, "key")
    with cache.open_guides(undisturbed.guides) as one, cache.open_guides(killed.guides) as other:
        assert one.frames == other.frames == 20
        for index in range(one.frames):
            assert np.array_equal(one.frame(index), other.frame(index))
        assert all(np.array_equal(one.diagnostics[name], other.diagnostics[name]) for name in one.diagnostics)


def test_a_diverged_run_keeps_its_state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    experiment = experiment_with_groom(tmp_path, swatch())

    def poisoned(self: Simulation, step=Simulation.next_frame) -> None:
        self.state.points[1, 6] = np.nan
        step(self)

    monkeypatch.setattr(Simulation, "next_frame", poisoned)
    with pytest.raises(
        SimulationDiverged,
        match=r"guide 1 \(strand 1 of the groom; its state is in .*diverged\.h5\) diverged before frame 2;",
    ):
        stage.execute(CONFIG, experiment, "key")
    with cache.open(tmp_path / "diverged.h5", kind="state") as state:
        assert not np.isfinite(state["points"][1]).all()
        assert np.isfinite(state["points"][0]).all()
        assert state["step"][0] == CONFIG.simulate.substeps
    assert not experiment.guides.exists()


def test_the_picture_of_a_run_is_reproducible(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    pictures = []
    for name in ("a", "b"):
        experiment = experiment_with_groom(tmp_path / name, swatch())
        stage.execute(CONFIG, experiment, "key")
        pictures.append((experiment.folder / "diagnostics.png").read_bytes())
    assert pictures[0] == pictures[1]
    assert pictures[0].startswith(b"\x89PNG")


def test_hair_that_lies_still_is_solved_once_a_step() -> None:
    """Fine spacing: many contacts would pull if they were tried anew in every step, and the step be solved again."""
    simulation = Simulation(
        Simulate(rest="groom", hair_contact={"method": "none"}), seed=1, guides=round_head(64, 64)
    )
    simulation.settle()
    simulation.cost = Cost()
    for _ in range(5):
        simulation.next_frame()
    solves, contacts = simulation.cost.solves / simulation.cost.steps, (simulation.state.contact > 0).sum()
    print(f"{solves:.3f} solves a step, {contacts} contacts")
    assert contacts > 64
    assert solves < 1.1


def test_the_bench_measures_what_it_promises() -> None:
    figures = bench(guides=64, points=16, threads=1)
    kernels.set_threads(0)
    print(figures)
    per_second = figures["frames_per_second"] * 10 * 64 * 16
    assert per_second * figures["ns_per_point_step"] == pytest.approx(1e9, rel=1e-3)
    assert figures["threads"] == 1
    assert 1000 < figures["flops_per_point_step"] < 4000
    assert 0 < figures["part_of_peak"] < 1


def test_scaling_fits_how_the_cost_grows(monkeypatch: pytest.MonkeyPatch) -> None:
    """Costs that are known: as guides to the power 1.1, as points to the power 0.9, half of it with two threads."""

    def known(guides: int, points: int, threads: int, **_: object) -> dict[str, float]:
        return {"ns_per_point_step": guides**0.1 * points**-0.1 / threads}

    monkeypatch.setattr("pipeline.bench.scaling.bench", known)
    figures = scaling(threads=2)
    print(figures)
    assert figures["exponent_guides"] == pytest.approx(1.1, abs=1e-4)
    assert figures["exponent_points"] == pytest.approx(0.9, abs=1e-4)
    assert figures["speed_up"] == pytest.approx(2.0)
