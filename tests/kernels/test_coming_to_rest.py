"""Coming to rest: air and inner damping stop hair within a second and a half of a shake.

64 strands of 25 cm on a round head, yaw of 60 degrees at 2 Hz for a second, then a hard stop; a fibre of 80 um with
0.3 of the drag of an isolated one and beta = 3 ms.
"""

import numpy as np
import pytest
from named_strands import helix
from strand_scenes import drive, hairy_sphere, settings, shake, shape, sphere

from pipeline import kernels

DT = 1 / 240
HAIR = {"straight": np.linspace([0.0, 0, 0], [0.25, 0, 0], 32), "curly": helix(0.008, 0.02, 0.25, 32)}


def speeds_after_the_stop(kind: str, seconds: tuple[float, ...]) -> list[float]:
    """Root mean square of the speed of all points [m/s] so many seconds after the stop."""
    points = hairy_sphere(HAIR[kind], 64)
    rest, state, head = shape(points), kernels.at_rest(points), sphere()
    found, done = [], 0
    for second in seconds:
        steps = round((1 + second) / DT) - done
        kernels.advance(state, rest, head, drive(steps, shake(DT, done)), settings(dt=DT))
        done += steps
        found.append(float(np.sqrt((state.velocity**2).sum(axis=2).mean())))
    return found


@pytest.mark.parametrize("kind", HAIR)
def test_hair_is_at_rest_one_and_a_half_seconds_after_a_stop(kind: str) -> None:
    found = [1e3 * speed for speed in speeds_after_the_stop(kind, (0.5, 1.0, 1.5))]
    print(f"{kind}: rms {', '.join(f'{speed:.0f}' for speed in found)} mm/s after 0.5, 1, 1.5 s")
    assert found[-1] < 30
    assert found == sorted(found, reverse=True)
