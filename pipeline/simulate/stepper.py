"""The guides in motion: a state, the clock, and what moves them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline import kernels
from pipeline.body.frames import BodyFrames
from pipeline.body.placement import Placement
from pipeline.cache import Frame
from pipeline.config.schema import Simulate
from pipeline.errors import InputError
from pipeline.simulate.hair_contact import Cost, neighbours
from pipeline.simulate.motion import hand_motion, head_motion
from pipeline.simulate.rest import rest_shape, settling, step_settings
from pipeline.simulate.sag_free import Report, hold_groom, wanted
from pipeline.simulate.screws import Pose, inverse, place
from pipeline.simulate.skin import MovingSkin
from pipeline.simulate.wind import wind
from pipeline.strands.held import HAND

Arrays = dict[str, NDArray[Any]]
Placed = tuple[NDArray[np.float32], Pose]

_ENERGIES = ("bending", "torsion", "kinetic", "gravity")
_STATE = ("points", "velocity", "tension", "contact", "directors", "twist")


class SimulationDiverged(InputError):
    """A guide is no longer finite or has blown up."""

    def __init__(self, guide: int, frame: int, detail: str = "") -> None:
        self.guide, self.frame = guide, frame
        when = f"before frame {frame}" if frame > 1 else "while settling"
        super().__init__(
            f"simulate: guide {guide}{detail} diverged {when}; raise simulate.substeps or simulate.theta"
        )


@dataclass(frozen=True)
class Guides:
    """What is simulated, in the head's rest pose."""

    points: NDArray[np.float32]
    """(G, P, 3) [m]: the groom, which is the rest shape."""
    held: NDArray[np.uint8]
    """(G, P): 0 free, 1 held by the head, 2 held by the hand."""
    offset: NDArray[np.float32]
    """(G, P) [m]: distance that points keep from the head."""
    field: kernels.DistanceField | None = None
    """Distance to the head; None without one."""
    body: BodyFrames | None = None
    """The head in motion, frame by frame; None where it is rigid."""
    head: Placement | None = None
    """Where the head stands; None for the built-in one."""
    strands: int = 0
    """Strands of the groom that they stand for; 0 for no more than themselves."""


class Simulation:
    """Guides that are stepped from frame to frame.

    Step 0 is the first frame; the settling has negative steps. Everything that moves the guides is a function of
    the step, so `save` and `restore` carry on bit by bit.
    """

    def __init__(self, simulate: Simulate, seed: int, guides: Guides) -> None:
        if (simulate.tips or simulate.tips_file) and not (guides.held == HAND).any():
            raise InputError(
                "simulate.tips: no strand has a pinned tip to move; set groom.swatch.pin_tips = true or groom.pins"
            )
        self.simulate = simulate
        self.rest = rest_shape(simulate.hair, guides.points, guides.held, guides.offset)
        self.field = guides.field
        self.settings = step_settings(simulate)
        self.head = head_motion(simulate.motion, simulate.fps, guides.head)
        self.skin: MovingSkin | None = None
        if guides.body is not None:
            self.skin = MovingSkin(guides.body, guides.points[:, 0], simulate.fps)
            self.head = self.skin.moved(self.head)
        self.hand = hand_motion(simulate, _middle_of_held(guides))
        each = max(guides.strands, len(guides.points)) / len(guides.points)
        self.neighbours = neighbours(simulate.hair_contact, self.rest, each, self.settings.dt)
        self.cost = Cost()
        self.wind = wind(simulate.air, seed)
        self.step = 0
        self.sag_free: Report | None = None
        self.state = self._first_state(guides.points)
        load = self.rest.load  # after the groom has found its rest: it is to give way to this load
        load[:, -1] += simulate.tip_load
        self.rest.load = load
        self._diagnostics = _summary([])
        self._before = self._still()

    def settle(self, report: Callable[[int], None] = lambda _: None) -> None:
        """Let the guides come to rest with the head at its first pose; `report` hears of steps done."""
        steps = self.settling_steps
        damped = settling(self.simulate)
        for first in range(-steps, 0, self.simulate.substeps):
            self.step = first
            count = min(self.simulate.substeps, -first)
            done = self._advance(count, damped if first < -steps // 2 else self.settings)
            self._diagnostics = _summary([done])
            report(count)
        self.step = 0
        self._before = self._still()

    @property
    def settling_steps(self) -> int:
        """Number of steps before the first frame."""
        return round(self.simulate.settle / self.settings.dt)

    def next_frame(self) -> None:
        """Step to the next frame, keeping states on the way. Raises SimulationDiverged."""
        parts = self.simulate.states
        reports, self._before = [], []
        for part in range(parts):
            reports.append(self._advance(self.simulate.substeps // parts, self.settings))
            if part < parts - 1:
                self._before.append(self._placed())
        self._diagnostics = _summary(reports)

    def frame(self) -> Frame:
        """The frame at the present step: energies [J] of all guides, worst strain and penetration [m] on the way."""
        energies = kernels.energies(self.state, self.rest, self.settings).sum(axis=0)
        diagnostics = dict(zip(_ENERGIES, energies.tolist(), strict=True)) | self._diagnostics
        return Frame(*self._placed(), diagnostics, tuple(self._before))

    def _placed(self) -> Placed:
        return self.state.points.astype(np.float32), self.head(self._time(0))

    def _still(self) -> list[Placed]:
        """The states on the way to the first frame: everything stands as at it."""
        return [self._placed()] * (self.simulate.states - 1)

    def save(self) -> Arrays:
        """All that the future depends on."""
        arrays = {name: getattr(self.state, name) for name in _STATE}
        return {**arrays, "step": np.array([self.step], np.int64)}

    def restore(self, saved: Arrays) -> None:
        """Carry on from what `save` returned."""
        self.state = kernels.State(**{name: np.ascontiguousarray(saved[name]) for name in _STATE})
        self.step = int(saved["step"][0])

    def _advance(self, count: int, settings: kernels.StepSettings) -> kernels.Report:
        head = self.head.piece(self._time(0))
        heads = [head(self._time(i)) for i in range(count + 1)]
        hands = [pose @ self.hand(self._time(i)) for i, pose in enumerate(heads)]
        winds = [self.wind(self._time(i + 0.5)) for i in range(count)]
        given = np.array(heads), np.array(winds), np.array(hands)
        if self.skin is None:
            field, drive = self.field, kernels.Drive(*given)
        else:
            substeps = self.simulate.substeps
            skin = self.skin.during(self.step / substeps, np.arange(count + 1) / substeps)
            field, drive = skin.field, kernels.Drive(*given, skin.roots, skin.deformation, skin.blend)
        report = kernels.advance(self.state, self.rest, field, drive, settings, self.neighbours)
        self.cost.add(count, report)
        self.step += count
        if report.bad_strand >= 0:
            raise SimulationDiverged(report.bad_strand, 1 - (-self.step // self.simulate.substeps))
        if self.head.piece(self._time(0)) is not head:
            self._carry(self.head(self._time(0)) @ inverse(heads[-1]))
        return report

    def _carry(self, jump: Pose) -> None:
        """Carry everything rigidly over a jump (4, 4) of the head: points, velocities, directors and states on the way."""
        state, turn = self.state, jump[:3, :3].T
        state.points[:] = place(jump, state.points)
        state.velocity[:] = state.velocity @ turn
        state.directors[:] = state.directors @ turn
        self._before = [(place(jump, x).astype(np.float32), jump @ pose) for x, pose in self._before]

    def _time(self, steps: float) -> float:
        return (self.step + steps) * self.settings.dt

    def _first_state(self, points: NDArray[np.float32]) -> kernels.State:
        pose, precision = self.head(0.0), np.dtype(self.simulate.precision)
        each = pose[None] if self.skin is None else pose @ self.skin.root_poses(0)  # of every guide
        turn = each[:, :3, :3].swapaxes(1, 2)
        moved = points.astype(np.float64) @ turn + each[:, None, :3, 3]
        directors = self.rest.directors @ turn
        state = kernels.at_rest(
            np.ascontiguousarray(moved, precision), np.ascontiguousarray(directors, precision)
        )
        if wanted(self.simulate, self.rest):
            start = hold_groom(self.rest, self.field, self.simulate, each)
            state.tension[:], state.contact[:] = start.tension, start.contact
            self.sag_free = start.report
        return state


def _summary(reports: Sequence[kernels.Report]) -> dict[str, float]:
    """What a frame's steps were like: worst strain, penetration [m] and rounds; means a step; halvings in all."""
    count = max(1, len(reports))
    return {
        "strain": max((report.strain for report in reports), default=0.0),
        "penetration": max((report.depth for report in reports), default=0.0),
        "rounds": sum(report.rounds for report in reports) / count,
        "rounds_worst": float(max((report.rounds_max for report in reports), default=0)),
        "contacts": sum(report.contacts for report in reports) / count,
        "solves": sum(report.solves for report in reports) / count,
        "halvings": float(sum(report.halvings for report in reports)),
    }


def _middle_of_held(guides: Guides) -> NDArray[np.float64]:
    """The middle (3,) [m] of the outermost points that the hand holds."""
    held = guides.held == HAND
    outermost = held & ~np.pad(held[:, 1:], ((0, 0), (0, 1)))
    if not held.any():
        return np.zeros(3)
    return np.asarray(guides.points[outermost].mean(axis=0, dtype=np.float64))
