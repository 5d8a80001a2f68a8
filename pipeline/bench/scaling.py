"""How the cost of a step grows: with threads, guides and points."""

from typing import Literal

import numpy as np

from pipeline.bench.simulate import bench

_GUIDES = (32, 16, 8, 4, 2, 1)  # parts of the most
_POINTS = (16, 32, 64, 128)


def scaling(
    precision: Literal["float32", "float64"] = "float32", threads: int = 2, repeats: int = 3, most: int = 8192
) -> dict[str, float]:
    """Cost per point and step [ns] for 1 and `threads` threads, for guides up to `most` and for points.

    Exponents are slopes of log(time of a step) over log(size): 1 is linear.
    """
    figures: dict[str, float] = {}

    def cost(guides: int, points: int, count: int) -> float:
        name = f"ns_{guides}x{points}_{count}_threads"
        if name not in figures:
            found = bench(guides=guides, points=points, precision=precision, threads=count, repeats=repeats)
            figures[name] = found["ns_per_point_step"]
        return figures[name]

    middle = min(1024, most)
    figures["speed_up"] = round(cost(middle, 32, 1) / cost(middle, 32, threads), 3)
    guides = [max(most // part, 1) for part in _GUIDES]
    figures["exponent_guides"] = _exponent(guides, [cost(count, 32, threads) for count in guides])
    figures["exponent_points"] = _exponent(_POINTS, [cost(guides[0], count, threads) for count in _POINTS])
    return figures


def _exponent(sizes: list[int] | tuple[int, ...], ns_per_point: list[float]) -> float:
    slope = np.polyfit(np.log(sizes), np.log(np.multiply(sizes, ns_per_point)), 1)[0]
    return round(float(slope), 4)
