"""Floating point operations of a step, counted by hand in the kernels: an FMA is two, an estimated reciprocal or root
counts its Newton steps (5 and 7), choices and moves count nothing.

For "rotor" and the Newton relaxation, a point and step (pipeline/kernels: energy, stiffness, banded, implicit, ...):
"""

from pipeline import kernels

_STEP = {
    "unit edges": 18,
    "bend: curvature, its derivative, force": 102,
    "bend: stiffness across": 31,
    "rotor: residuals, derivatives, force": 175,
    "stretch and tension": 28,
    "air drag": 71,
    "mass, drag and right sides": 52,
    "tension and strand ahead, velocity, edges after": 71,
}
_ELIMINATE = {
    "squares of 2 + 1 rows, blocks": 198,
    "window added, the next point for this one": 75,
    "Cholesky of 3 rows in 12": 449,
    "substitution": 66,
}
_LENGTHS = {"strain": 15, "tridiagonal step": 60}
_NEAR = 45  # of a place that is only proved to be far from the head


def flops_per_point_step(solves: float, rounds: float) -> float:
    """Operations for each point and step, with so many solves a step and rounds of relaxation.

    Contacts count as places far from the head, which is the least that they cost, and rows that are dropped not at all.
    """
    eliminated = solves * sum(_ELIMINATE.values())
    relaxed = (rounds + 1) * _LENGTHS["strain"] + rounds * _LENGTHS["tridiagonal step"]
    return sum(_STEP.values()) + eliminated + relaxed + (rounds + 2) * _NEAR


def part_of_peak(flops: float, ns_per_point_step: float, precision: str, threads: int) -> dict[str, float]:
    """What the step reaches of this machine's peak, which is measured now: one core times the threads."""
    peak = kernels.peak_flops("float32" if precision == "float32" else "float64") * threads
    return {
        "flops_per_point_step": round(flops, 1),
        "gflops": round(flops / ns_per_point_step, 2),
        "peak_gflops": round(peak * 1e-9, 1),
        "part_of_peak": round(flops / ns_per_point_step * 1e9 / peak, 4),
    }
