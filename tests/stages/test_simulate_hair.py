"""Hair-hair contact in the simulate stage: resume, threads, what `density` means, errors, and the cost in the log."""

import re

import numpy as np
import pytest
from guided_runs import interrupted, resumed

from pipeline import cache, kernels
from pipeline.bench.simulate import curly_head, round_head
from pipeline.config.schema import HairContact, Motion, Simulate
from pipeline.errors import InputError
from pipeline.simulate import stage
from pipeline.simulate.hair_contact import neighbours, steps_held
from pipeline.simulate.rest import rest_shape
from pipeline.simulate.stepper import Simulation

SHAKE = Motion(preset="shake", period=0.4, amplitude=0.6, pivot=(0.0, 0.0, 0.0))
every_method = pytest.mark.parametrize("method", ["grid", "capsule"])


def short(method: str, **values: float) -> Simulate:
    contact = HairContact.model_validate({"method": method} | values)
    return Simulate(
        frames=4, settle=0.1, motion=SHAKE, rest="groom", precision="float32", hair_contact=contact
    )


@every_method
def test_a_resumed_run_is_bit_identical_for_any_number_of_threads(method: str) -> None:
    simulate, guides = short(method), curly_head(150, 16)
    kernels.set_threads(2)
    frames, saved = interrupted(simulate, guides, after=2)
    kernels.set_threads(1)
    rest = resumed(simulate, guides, 2, saved)
    kernels.set_threads(0)
    assert [frame.points.tobytes() for frame in rest] == [frame.points.tobytes() for frame in frames[2:]]


@every_method
def test_neighbours_make_a_difference(method: str) -> None:
    guides = curly_head(150, 16)
    ends = []
    for name in ("none", method):
        simulation = Simulation(short(name), 3, guides)
        simulation.settle()
        list(stage.run(simulation))
        ends.append(simulation.state.points)
    moved = np.abs(ends[0] - ends[1]).max()
    print(f"{method}: up to {moved * 1e3:.1f} mm")
    assert moved > 1e-4


def test_the_density_is_that_of_all_strands() -> None:
    """Twice as many guides for the same strands: the same push at the same place, to what is scattered."""
    pushes = []
    for count in (400, 800):
        guides = round_head(count, 32)
        simulate = Simulate(hair_contact=HairContact(density=1.0, drag=0.0))
        rest = rest_shape(simulate.hair, guides.points, guides.held, guides.offset)
        state = kernels.at_rest(guides.points.astype(np.float64))
        state.points[..., [0, 2]] *= 0.8
        method = neighbours(simulate.hair_contact, rest, 60_000 / count, 1 / 240)
        assert method is not None
        a = kernels.neighbour_acceleration(state, rest, method, np.eye(4), kernels.StepSettings())
        pushes.append(float(np.sqrt((a**2).sum(-1).mean())))
    print("root mean square push with 400 and 800 guides:", pushes)
    assert pushes[0] > 1
    assert pushes[1] == pytest.approx(pushes[0], rel=0.25)


def test_the_grid_is_looked_at_before_pressure_crosses_a_cell() -> None:
    contact = HairContact(cell=8e-3, pressure=0.05, drag=3.0)
    held = {dt: steps_held(contact, dt) for dt in (1 / 30, 1 / 240, 1 / 2400)}
    print("steps held:", held)
    assert held[1 / 30] == 1
    for dt in (1 / 240, 1 / 2400):
        assert 0.05**0.5 * held[dt] * dt <= 8e-3 / 4 < 0.05**0.5 * (held[dt] + 1) * dt
    assert steps_held(HairContact(cell=8e-3, pressure=0.2), 1 / 2400) == held[1 / 2400] // 2
    assert steps_held(HairContact(pressure=0.0, drag=60.0), 1 / 240) == 1


def test_cells_that_are_too_small_are_an_error_that_names_the_value() -> None:
    with pytest.raises(InputError, match=r"simulate\.hair_contact\.cell = 0\.1 mm: .* make it larger"):
        Simulation(short("grid", cell=1e-4), 3, round_head(37, 16))


@every_method
def test_the_cost_is_told_in_words(method: str) -> None:
    simulation = Simulation(short(method), 3, round_head(37, 16))
    simulation.settle()
    simulation.next_frame()
    line = simulation.cost.line(method)
    print(line)
    assert re.fullmatch(rf"hair-hair {method}: \d+\.\d\d ms a step, \d+% of the stepping", line)
    assert simulation.cost.steps == 24 + 10
    assert 0 < simulation.cost.neighbours < simulation.cost.seconds


def test_timings_stay_out_of_the_frames() -> None:
    """Diagnostics of two equal runs are equal."""
    runs: list[list[cache.Frame]] = []
    for _ in range(2):
        simulation = Simulation(short("grid"), 3, round_head(37, 16))
        runs.append(list(stage.run(simulation)))
    assert [frame.diagnostics for frame in runs[0]] == [frame.diagnostics for frame in runs[1]]
