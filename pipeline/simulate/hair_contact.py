"""Hair-hair contact: from the config to the method that the kernels step with, and what it costs."""

import math
from dataclasses import dataclass

from pipeline import kernels
from pipeline.config.schema import HairContact
from pipeline.errors import InputError

_HELD = 0.25
"""Cells that pressure may cross, and part of a velocity that may be blended, between two looks at the grid."""


def steps_held(contact: HairContact, dt: float) -> int:
    """Steps of dt [s] that a look at the grid serves for.

    Pressure spreads at a speed of about sqrt(`pressure`), as sound does in a gas.
    """
    speed = math.sqrt(contact.pressure)
    rate = max(speed / contact.cell, contact.drag, 1e-9)
    return max(1, int(_HELD / rate / dt + 1e-9))


def neighbours(
    contact: HairContact, rest: kernels.RestShape, strands_per_guide: float, dt: float
) -> kernels.Neighbours | None:
    """The method that the config names, for guides that stand for so many strands each; None for "none".

    `density` is that of all strands, so that the number of guides does not matter; the kernels know the guides' mass.
    `dt` [s] is the time step.

    Raises InputError when the cells of the grid are too small for the reach of the guides.
    """
    if contact.method == "grid":
        density = contact.density / strands_per_guide
        try:
            return kernels.HairGrid(
                rest,
                contact.cell,
                density,
                contact.pressure,
                contact.drag,
                contact.limit,
                steps_held(contact, dt),
            )
        except ValueError as error:
            raise InputError(
                f"simulate.hair_contact.cell = {contact.cell * 1e3:g} mm: {error}; make it larger"
            ) from error
    if contact.method == "capsule":
        return kernels.HairCapsules(rest, contact.radius, contact.stiffness, contact.friction, contact.speed)
    return None


@dataclass
class Cost:
    """Wall time of the steps; it goes into the log, never into results."""

    steps: int = 0
    seconds: float = 0.0
    neighbours: float = 0.0
    """Of the seconds, those of hair-hair contact."""
    solves: float = 0.0
    rounds: float = 0.0
    """Solves and rounds of relaxation of a block of strands."""

    def add(self, steps: int, report: kernels.Report) -> None:
        """Count the steps of one call."""
        self.steps += steps
        self.seconds += report.seconds
        self.neighbours += report.neighbour_seconds
        self.solves += steps * report.solves
        self.rounds += steps * report.rounds

    def line(self, method: str) -> str:
        """What hair-hair contact costs, in words."""
        each = self.neighbours / max(1, self.steps)
        part = self.neighbours / max(1e-9, self.seconds)
        return f"hair-hair {method}: {each * 1e3:.2f} ms a step, {part:.0%} of the stepping"
