"""The pictures that one frame is the mean of: points of the lens, and moments while the shutter is open.

Samples are the first of a sequence of low discrepancy, the same for every frame, so that nothing flickers and no frame
depends on which others are made: pass i of n has time (i + 1/2) / n and the radical inverses of i + 1 to bases 2 and 3
(Hammersley, 1960; Halton, 1964), which Shirley & Chiu's map (1997) takes to the disc of the lens. The shutter closes at
the frame. Hair is in one of the states that the simulation has kept, each of which stands for the time around it.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.config import Config
from pipeline.config.schema import open_states
from pipeline.render.camera import CameraPath
from pipeline.render.view import View

Linear = NDArray[np.float32]


@dataclass(frozen=True)
class Pass:
    """One picture of the mean: hair `back` states before the frame, and the view."""

    back: int
    view: View


def passes(config: Config, path: CameraPath, number: int) -> Iterator[Pass]:
    """The passes of a frame, counted from 1, those of one state together; a single one for a pinhole without shutter."""
    camera, simulate = config.scene.camera, config.simulate
    states = open_states(camera.shutter, simulate.states)
    time = (number - 1) / simulate.fps
    if camera.f_stop is None and not camera.shutter:
        yield Pass(0, path.at(time))
        return
    count = config.render.passes
    for i in range(count):
        before = (i + 0.5) / count * states
        back = int(before)
        view = path.at(time - (before - 0.5) / (simulate.fps * simulate.states) if camera.shutter else time)
        if camera.f_stop is not None:
            view = view.through(*_on_disc(radical_inverse(i + 1, 2), radical_inverse(i + 1, 3)))
        yield Pass(back, view)


def mean(pictures: Iterable[Linear]) -> Linear:
    """The mean of linear pictures, added one by one; a single one as it is."""
    total, count = None, 0
    for picture in pictures:
        count += 1
        total = picture if total is None else np.add(total, picture, out=total)
    if total is None:
        raise ValueError("no picture to take the mean of")
    return total if count == 1 else np.multiply(total, np.float32(1 / count), out=total)


def radical_inverse(number: int, base: int) -> float:
    """The digits of a number mirrored at the point, in [0, 1) (van der Corput, 1935)."""
    value, place = 0.0, 1.0 / base
    while number:
        number, digit = divmod(number, base)
        value += digit * place
        place /= base
    return value


def _on_disc(u: float, v: float) -> tuple[float, float]:
    """A point of the unit square on the unit disc; equal areas stay equal."""
    a, b = 2 * u - 1, 2 * v - 1
    if a == 0 and b == 0:
        return 0.0, 0.0
    if abs(a) > abs(b):
        radius, angle = a, np.pi / 4 * b / a
    else:
        radius, angle = b, np.pi / 2 - np.pi / 4 * a / b
    return float(radius * np.cos(angle)), float(radius * np.sin(angle))
