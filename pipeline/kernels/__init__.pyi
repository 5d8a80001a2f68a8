"""Interface of the C++ kernels. Each room has its section; see the headers for the formulas."""

from typing import Literal

import numpy as np
from numpy.typing import NDArray

_F64 = NDArray[np.float64]
_Real = NDArray[np.float32] | NDArray[np.float64]

VARIANT: str
"""Which build of the kernels was chosen: "portable", "v3" or "v4"."""

def cpu_level() -> int:
    """x86-64 level of this processor: 4, 3 or 0 (neither)."""

def set_threads(count: int) -> None:
    """Threads of every kernel from now on; 0 is all processors. No result depends on it."""

def threads() -> int:
    """Threads that kernels use."""

# --- physics: energies, rest shape, the step (energy, rest, relaxation, contact, step .hpp) ---------
#
# Arrays are C-contiguous numpy. `points` with a leading S are root first, [m]. Shapes are checked: ValueError.

def curvature(points: _F64, form: Literal["equal", "general"]) -> _F64:
    """Curvature at the inner points.

    "equal": kappa = 2 |c| / (dl |e|) with dl the strand's mean spacing; "general": every segment with its own
    length. Second order on a helix; "general" is exactly 0 on a straight strand with uneven spacing.

    Args:
        points: (S, P, 3) float64 [m], P >= 3.
        form: which of the two forms of the lecture.

    Returns:
        (S, P-2) float64 [1/m], for points 1 .. P-2.

    Source: KIST lecture "Hair Simulation 2" (Physically Based Animation, 2008), before and after "Simplification".

    """

def torsion(points: _F64, form: Literal["equal", "general"]) -> _F64:
    """Torsion by the 5-point stencil tau = e.(c x q) / (2 dl |c|^2); not regularised (infinite on a straight strand).

    Args:
        points: (S, P, 3) float64 [m], P >= 5.
        form: which of the two forms of the lecture.

    Returns:
        (S, P-4) float64 [1/m], for points 2 .. P-3.

    Source: KIST lecture "Hair Simulation 2" (2008).

    """

class RestShape:
    """What a strand is made of: lengths, masses, stiffness, rest curvature and torsion, held points, contact offset.

    A plain struct of float64 arrays, made by `rest_shape`. Every attribute may be assigned (for sag-free rest
    shapes, say); `advance` reads them anew on each call.
    """

    points: _F64
    """(S, P, 3) [m]: rest points; held points are carried rigidly from here."""
    length: _F64
    """(S, P-1) [m]: rest lengths of the segments."""
    mass: _F64
    """(S, P) [kg]."""
    bending: _F64
    """(S,) [N m^2]: k_kappa = E I."""
    twisting: _F64
    """(S,) [N m^2]: k_tau = G J; 0 switches torsion off for a strand."""
    curvature: _F64
    """(S, P-2) [1/m]: kappa_r at points 1 .. P-2."""
    torsion: _F64
    """(S, P-4) [1/m]: tau_r at points 2 .. P-3, for torsion "frenet" (regularised, see `torsion_frenet`)."""
    dihedral: _F64
    """(S, P-3) [rad]: phi_r about segments 1 .. P-3, for torsion "rotor"."""
    ratio: _F64
    """(S, P-3): rho, the ratio of the rest sin-bends at the two ends of segments 1 .. P-3."""
    weight: _F64
    """(S, P-3) [N m]: G, the stiffness of "rotor" about segments 1 .. P-3; fades to 0 where the strand is straight."""
    held: NDArray[np.uint8]
    """(S, P): 0 free, 1 carried by the head's pose, 2 carried by the hand's pose. Any points may be held."""
    offset: _F64
    """(S, P) [m]: distance that the point keeps from the head's surface."""

def rest_shape(
    points: _F64,
    mass_per_length: _F64,
    bending: _F64,
    twisting: _F64,
    held: NDArray[np.uint8],
    offset: _F64,
    kappa_0: float = 4.0,
) -> RestShape:
    """The rest shape that a groomed strand defines: its own lengths, curvature and torsion.

    Masses are the consistent ones: a point carries half of each segment beside it (so a tip carries half).

    Args:
        points: (S, P, 3) float64 [m], in the head's rest frame, 8 <= P <= 256, segments of positive length.
        mass_per_length: (S,) float64 [kg/m], > 0.
        bending: (S,) float64 [N m^2], k_kappa.
        twisting: (S,) float64 [N m^2], k_tau.
        held: (S, P) uint8: 0 free, 1 carried by the head, 2 carried by the hand.
        offset: (S, P) float64 [m], contact offset.
        kappa_0: [1/m] curvature below which "rotor" torsion fades out.

    Raises:
        ValueError: wrong shapes, not finite, or a segment of zero length.

    """

def bending(points: _F64, rest: RestShape) -> tuple[_F64, _F64]:
    """Bending energy (S,) [J] and its force (S, P, 3) [N], minus the gradient: E = sum k_kappa (kappa - kappa_r)^2 dl / 2."""

def torsion_frenet(points: _F64, rest: RestShape) -> tuple[_F64, _F64]:
    """Energy (S,) [J] and force (S, P, 3) [N] of the lecture's torsion, regularised with eps = 0.3 dl."""

def torsion_rotor(points: _F64, rest: RestShape) -> tuple[_F64, _F64]:
    """Energy (S,) [J] and force (S, P, 3) [N] of the 4-point polynomial torsion with one minimum."""

class State:
    """Where the strands are: four arrays, all of one precision, advanced in place.

    Saving and restoring these four arrays resumes a simulation bit by bit. The arrays given are held, not
    copied: attributes are views of them.
    """

    points: _Real
    """(S, P, 3) [m], world."""
    velocity: _Real
    """(S, P, 3) [m/s]."""
    tension: _Real
    """(S, P-1) [N]: carried from step to step, so that equilibria do not depend on dt."""
    contact: NDArray[np.uint8]
    """(S, P): 1 where the head pushed the point in the last step."""

    def __init__(
        self, points: _Real, velocity: _Real, tension: _Real, contact: NDArray[np.uint8]
    ) -> None: ...

def at_rest(points: _Real) -> State:
    """A state at these points (copied; their precision is that of the simulation): no velocity, tension, contact."""

class DistanceField:
    """Signed distance to the head on a grid, negative inside; trilinear between nodes, clamped outside.

    Must be a true distance (1-Lipschitz): far points are skipped by it.
    """

    def __init__(self, values: NDArray[np.float32], origin: _F64, spacing: float) -> None:
        """Values (nx, ny, nz) float32 [m] at origin (3,) [m] + spacing [m] * index, in the head's rest frame."""

def distance(field: DistanceField, points: _F64) -> tuple[_F64, _F64]:
    """Signed distance (N,) [m] and unit outward normal (N, 3) at points (N, 3) float64 [m] of the head's rest frame."""

class StepSettings:
    """How to step. Every attribute may be assigned; defaults are those shown."""

    dt: float  # 1/240 s
    theta: float  # 0.6: implicitness, 0.5 .. 1
    gravity: tuple[float, float, float]  # (0, -9.81, 0) [m/s^2]
    damping: float  # 3e-3 s: beta, internal
    torsion: Literal["rotor", "frenet", "none"]  # "rotor"
    relaxation: Literal["newton", "sweep"]  # "newton"
    tolerance: float  # 1e-4: worst relative length error of a segment
    friction: float  # 0.3: Coulomb, hair on head
    drag: float  # 3.3 1/s: c_perp = drag + drag_speed |u_perp| (0.3 of an isolated 80 um fibre's 11 and 15)
    drag_speed: float  # 4.5 1/m
    drag_along: float  # 0.4: c_par / c_perp
    integrator: Literal["implicit", "explicit"]  # "implicit"; "explicit" is symplectic Euler, for validation

    def __init__(self) -> None: ...

class Drive:
    """What moves the strands during a call of `advance`: n steps."""

    def __init__(self, head: _F64, wind: _F64, hand: _F64 | None = None) -> None:
        """Poses and wind.

        Args:
            head: (n+1, 4, 4) float64, head's rest frame -> world: before the first step, then after each step.
            wind: (n, 3) float64 [m/s].
            hand: (n+1, 4, 4) float64, the same for points held by the hand (`RestShape.held` = 2); unset, the head's.

        """

class Report:
    """What happened in one call of `advance`."""

    strain: float
    """Worst relative length error of a segment at the end of a step."""
    depth: float
    """Worst depth [m] of a point below its contact offset at the end of a step; 0 without a field."""
    rounds: float
    """Mean number of relaxation rounds per step (passes, for "sweep")."""
    rounds_max: int
    """Largest number of relaxation rounds in a step."""
    contacts: float
    """Mean number of points that touch the head, per step."""
    solves: float
    """Banded solves per block and step: 1 plus the re-solves after contacts that would pull."""
    halvings: int
    """Steps that were taken again as two half steps."""
    bad_strand: int
    """Index of the first strand that is no longer finite, or -1."""

def advance(
    state: State, rest: RestShape, field: DistanceField | None, drive: Drive, settings: StepSettings
) -> Report:
    """Advances the state in place by the steps of the drive.

    A strand's motion depends neither on the number of threads nor on the strands beside it. Never raises for bad
    physics: see `Report.bad_strand`.

    Raises:
        ValueError: shapes that do not fit, or settings outside their range.

    """

def energies(state: State, rest: RestShape, settings: StepSettings) -> _F64:
    """(S, 4) float64 [J]: bending, torsion, kinetic and gravity energy of every strand (gravity: 0 at the origin)."""

def relax(
    points: _F64, rest: RestShape, method: Literal["newton", "sweep"], tolerance: float
) -> tuple[_F64, int]:
    """Points (S, P, 3) whose segments have their rest lengths within the tolerance, and the iterations of the slowest.

    Held points stay; the free ones move as little as their masses ask for, so that their momentum is conserved.
    """
