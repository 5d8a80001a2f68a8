"""Shapes at rest: cantilevers, catenaries, and that equilibria depend on nothing but the strand."""

from collections.abc import Sequence

import numpy as np

from pipeline import kernels
from pipeline.validation.case import CURLY, Law, Model, Outcome, Reading
from pipeline.validation.rod import (
    BENDING,
    HAND,
    HEAD,
    TWISTING,
    Array,
    Rod,
    clamped,
    gravito_length,
    helix,
    settling,
    straight,
    undamped,
)

# Tip drop over tip reach over Gamma; two independent solutions of the rod equations agree to 3e-10, and the test
# test_the_master_curve_solves_the_rod_equations solves them once more.
CANTILEVER = {
    0.1: 0.012500, 0.5: 0.062444, 1: 0.124562, 2: 0.246673, 5: 0.585721, 10: 1.066802,
    20: 1.863930, 50: 3.705561, 100: 5.888105, 200: 8.906771, 500: 14.76880, 1000: 21.33544,
}  # fmt: skip
# Drop and reach over length, over the tip load P L^2/B.
TIP_LOAD = {
    0.5: (0.162144, 0.984081),
    1: (0.301721, 0.943567),
    2: (0.493457, 0.839358),
    5: (0.713792, 0.612372),
    10: (0.810609, 0.445004),
}
LOOSE = "relaxation to 1e-4"  # lengths, too, are kept to no more
CATENARY = {0.5: 0.398194, 0.9: 0.190709}  # sag over length, for span over length
SEVERAL = (
    "its torsion sees the sine of the dihedral alone, so that a curl has several equilibria (wrong coils); "
    "which of them a fall ends in depends on the way"
)
HAIR_TWISTING = (0.0, TWISTING, TWISTING)  # what is straight by nature needs none
TIME_STEPS = (0.5e-3, 1e-3, 2e-3, 8e-3, 16e-3)


def cantilevers(gammas: Sequence[float], model: Model = "none", points: int = 64) -> Array:
    """Tip drop over tip reach of strands of these Gammas, clamped horizontally."""
    strands = np.concatenate([straight(gravito_length(gamma), points) for gamma in gammas])
    tips = Rod(strands, clamped(points), settling(model)).to_rest()[:, -1]
    return np.asarray(-tips[:, 1] / tips[:, 0])


def master_curve(model: Model, quick: bool) -> Outcome:
    """The drooping of strands from hardly to almost entirely."""
    gammas = [1, 10, 100] if quick else [gamma for gamma in CANTILEVER if gamma <= 100]
    found = dict(zip(gammas, cantilevers(gammas, model), strict=True))
    if not quick:
        long = [gamma for gamma in CANTILEVER if gamma > 100]
        found |= dict(zip(long, cantilevers(long, model, 192), strict=True))
    readings = [Reading(f"Gamma {g:g}, H/W", float(h), CANTILEVER[g], 0.01) for g, h in found.items()]
    return Outcome(tuple(readings), {"gamma": np.array([*found]), "ratio": np.array([*found.values()])})


def order(model: Model, quick: bool) -> Outcome:
    """How the error of a cantilever falls with the spacing."""
    gammas = [10] if quick else [1, 10, 100]
    points = np.array([16, 32, 64] if quick else [16, 32, 64, 128])
    reference = np.array([CANTILEVER[gamma] for gamma in gammas])
    errors = np.array([np.abs(cantilevers(gammas, model, count) / reference - 1) for count in points])
    finest = points >= (16 if quick else 32)  # Gamma = 100 is resolved by no fewer
    slopes = -np.polyfit(np.log(points[finest] - 1.5), np.log(errors[finest]), 1)[0]
    readings = [
        Reading(f"Gamma {g}, order", float(s), 2.0, 0.05) for g, s in zip(gammas, slopes, strict=True)
    ]
    curves = {f"Gamma {gamma}": error for gamma, error in zip(gammas, errors.T, strict=True)}
    return Outcome(tuple(readings), {"points": points, **curves})


def tip_loads(model: Model, quick: bool, points: int = 64) -> Outcome:
    """A force at the tip of strands that weigh nothing."""
    length, loads = 0.1, [1, 10] if quick else [*TIP_LOAD]
    settings = settling(model)
    settings.gravity = (0.0, 0.0, 0.0)
    rod = Rod(np.repeat(straight(length, points), len(loads), axis=0), clamped(points), settings)
    force = np.zeros((len(loads), points, 3))
    force[:, -1, 1] = -np.array(loads) * BENDING / length**2
    rod.rest.load = force
    tips = rod.to_rest()[:, -1] / length
    readings = []
    for load, tip in zip(loads, tips, strict=True):
        drop, reach = TIP_LOAD[load]
        readings += [Reading(f"P L^2/B {load}, drop/L", float(-tip[1]), drop, 0.01)]
        readings += [Reading(f"P L^2/B {load}, reach/L", float(tip[0]), reach, 0.01)]
    return Outcome(tuple(readings), {"load": np.array(loads), "drop": -tips[:, 1], "reach": tips[:, 0]})


def catenary(model: Model, _quick: bool, points: int = 65) -> Outcome:
    """Sag over length of strands without stiffness, held at their level ends at a distance of span times length."""
    length, ramp = 0.2, np.linspace(0, 1, points // 2 + 1)[:, None]
    chains = []
    for span in CATENARY:
        half = ramp * np.array([span, -np.sqrt(1 - span**2), 0]) * length / 2
        chains.append(np.concatenate([half, half[-2::-1] * (-1, 1, 1) + (span * length, 0, 0)]))
    holds = [HEAD] + [0] * (points - 2) + [HAND]
    rod = Rod(np.array(chains), holds, settling(model, 8e-3), bending=0.0, twisting=0.0)
    sags = -rod.to_rest()[..., 1].min(axis=1) / length
    rows = zip(CATENARY.items(), sags, strict=True)
    return Outcome(tuple(Reading(f"span/L {span}, sag/L", float(s), sag, 1e-3) for (span, sag), s in rows))


def drift_of_helix(model: Model, _quick: bool, points: int = 64) -> Outcome:
    """How far a curl moves from its rest shape in 5 s without gravity, over its length."""
    curl = helix(0.01, 0.02, 0.2, points)
    rod = Rod(curl, clamped(points), undamped(model, theta=0.6))
    rod.advance(1200)
    return Outcome(
        (Reading("drift/L in 5 s", float(np.abs(rod.state.points - curl).max() / 0.2), 0.0, 1e-6),)
    )


def hair(points: int = 32, length: float = 0.2) -> Array:
    """Straight, wavy and curly strands along x, (3, P, 3) [m]."""
    curls = [(0.0, 0.05), (0.01, 0.05), (0.01, 0.03)]
    return np.concatenate([helix(radius, pitch, length, points) for radius, pitch in curls])


def steady(model: Model, quick: bool) -> Outcome:
    """How far tips leave their equilibrium, over their length, when dt, damping or relaxation change."""
    rod = Rod(hair(), clamped(32), settling(model), twisting=HAIR_TWISTING)
    rod.to_rest(still=1e-11)
    rested = rod.state.points.copy()
    readings = []
    for what, settings in _ways(model, quick).items():
        rod.settings = settings
        rod.state.points[:], rod.state.velocity[:] = rested, 0
        rod.advance(round(2.0 / settings.dt))
        drift = np.abs(rod.state.points[:, -1] - rested[:, -1]).max() / 0.2
        readings.append(Reading(what, float(drift), 0.0, 1e-6))
    return Outcome(tuple(readings))


def same_end(model: Model, quick: bool) -> Outcome:
    """How far apart the tips of one hair come to rest, over their length, on ways of different dt and damping."""
    ends = {}
    for what, settings in {"dt 4 ms": settling(model), **_ways(model, quick)}.items():
        rod = Rod(hair(), clamped(32), settings, twisting=HAIR_TWISTING)
        ends[what] = rod.to_rest(still=1e-10)[:, -1].copy()
    first = ends.pop("dt 4 ms")
    readings = []
    for what, end in ends.items():
        error = float(np.abs(end - first).max() / 0.2)
        readings.append(Reading(what, error, 0.0, 1e-4 if what == LOOSE else 1e-6))
    return Outcome(tuple(readings))


def _ways(model: Model, quick: bool) -> dict[str, kernels.StepSettings]:
    ways = {f"dt {1e3 * dt:g} ms": settling(model, dt) for dt in (TIME_STEPS[::2] if quick else TIME_STEPS)}
    for what, name, value in (
        ("damping 10 ms", "damping", 10e-3),
        ("drag 30 /s", "drag", 30.0),
        ("theta 0.6", "theta", 0.6),
        (LOOSE, "tolerance", 1e-4),
        ("relaxation by sweeps", "relaxation", "sweep"),
    ):
        if not (quick and name in ("drag", "theta", "relaxation")):
            ways[what] = settling(model)
            setattr(ways[what], name, value)
    return ways


def laws() -> list[Law]:
    """The laws of this file."""
    return [
        Law(
            "cantilever",
            "A strand is clamped horizontally and droops under its own weight; H/W is the drop of its tip over its "
            "reach, Gamma = w L^3/B. 64 points, 192 above Gamma = 100. Protocol: Romero et al., *Physical validation "
            "of simulators in computer graphics* (2021); reference: the elastica under its own weight, by collocation.",
            master_curve,
        ),
        Law(
            "cantilever order",
            "The error of H/W falls with the square of the spacing: slope of log error over log(P - 1.5). "
            "The clamp sits at the middle of segment 0, from where lengths count.",
            order,
        ),
        Law(
            "cantilever tip load",
            "A weightless strand is clamped horizontally; a force P of constant direction pulls its tip down. "
            "Reference: Bisshopp & Drucker, *Large deflection of cantilever beams* (1945), elliptic integrals.",
            tip_loads,
        ),
        Law(
            "catenary",
            "A strand without stiffness hangs from its two level ends. Reference: the catenary, y = a cosh(x/a).",
            catenary,
        ),
        Law(
            "helix at rest",
            "A curl of 1 cm radius and 2 cm pitch is let alone for 5 s without gravity: nothing may move it.",
            drift_of_helix,
        ),
        Law(
            "static shape, kept",
            "Straight, wavy and curly strands that hang at rest (dt = 4 ms) are stepped on for 2 s with another time "
            "step, internal damping, drag, implicitness or relaxation: their tips stay.",
            steady,
        ),
        Law(
            "static shape, reached",
            "The same strands fall from their rest shapes, held horizontally, with each of these settings: "
            "their tips come to rest at the same place. (With the relaxation to 1e-4, lengths are as loose.)",
            same_end,
            CURLY,
            {"frenet": SEVERAL},
        ),
    ]
