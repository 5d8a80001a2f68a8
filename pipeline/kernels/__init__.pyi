"""Interface of the C++ kernels. Each room has its section; see the headers for the formulas."""

from typing import Literal, TypeVar

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

def peak_flops(precision: Literal["float32", "float64"]) -> float:
    """Operations a second [1/s] of fused multiply-adds in the registers of one core, measured now: best of 5 runs."""

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
    """(S,) [N m^2]: k_kappa = E I; for torsion "kirchhoff" towards the directors."""
    bending_2: _F64
    """(S,) [N m^2]: for "kirchhoff" across the directors; as `bending` where the section is round."""
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
    root_weight: _F64
    """(S,) [N m]: the same about segment 0 where the head holds points 0 and 1; 0 lets a curl swivel about its root."""
    root_shift: _F64
    """(S, 2): what the first bend of "rotor" at rest, seen in the root's frame, is more than the groom's; 0 by default."""
    held: NDArray[np.uint8]
    """(S, P): 0 free, 1 carried by the head's pose, 2 carried by the hand's pose. Any points may be held."""
    offset: _F64
    """(S, P) [m]: distance that the point keeps from the head's surface."""
    directors: _F64
    """(S, P-1, 3): rest directors of the segments, where held segments carry theirs from; for "kirchhoff"."""
    strain: _F64
    """(S, P-2, 3): rest strains k1, k2 and twist [rad] of the joints at points 1 .. P-2, for "kirchhoff": see `strains`."""
    load: _F64
    """(S, P, 3) [N]: constant force on every point, in the world; 0 by default."""

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

def torsion_rotor(points: _F64, rest: RestShape, directors: _F64 | None = None) -> tuple[_F64, _F64]:
    """Energy (S,) [J] and force (S, P, 3) [N] of the 4-point polynomial torsion with one minimum.

    With directors (S, P-1, 3) float64 of the segments, also that of clamped roots, which keep the direction of their
    first bend.
    """

def kirchhoff(
    points: _F64, directors: _F64, rest: RestShape, twist: _F64 | None = None
) -> tuple[_F64, _F64, _F64]:
    """Energy of elastic rods with material frames, sum [B1 (k1-r1)^2 + B2 (k2-r2)^2 + C (twist-r3)^2] / (2 dl).

    Args:
        points: (S, P, 3) float64 [m].
        directors: (S, P-1, 3) float64, unit and square to their segments.
        rest: stiffness and rest strains.
        twist: (S, P-2) float64 [rad]: of all windings the one nearest to this counts; unset, the smallest twist.

    Returns:
        Energy (S,) [J], force (S, P, 3) [N], minus the gradient by points at parallel transported directors, and
        gradient (S, P-1) [N m] by turns of the directors about their segments.

    Source: Bergou et al., "Discrete elastic rods" (2008); "Discrete viscous threads" (2010).

    """

def untwisted_directors(points: _F64) -> _F64:
    """Directors (S, P-1, 3) without twist along points (S, P, 3) float64 [m], P >= 2; the first is fixed by its segment."""

def strains(points: _F64, directors: _F64) -> _F64:
    """Integrated strains (S, P-2, 3) of the joints: k1, k2 (|k| = 2 tan(bend/2)) and the smallest twist [rad].

    Args:
        points: (S, P, 3) float64 [m], P >= 3.
        directors: (S, P-1, 3) float64, unit and square to their segments.

    """

class State:
    """Where the strands are: six arrays, of numbers all in one precision, advanced in place.

    Saving and restoring these six arrays resumes a simulation bit by bit. The arrays given are held, not
    copied: attributes are views of them.
    """

    points: _Real
    """(S, P, 3) [m], world."""
    velocity: _Real
    """(S, P, 3) [m/s]."""
    tension: _Real
    """(S, P-1) [N]: carried from step to step, so that equilibria do not depend on dt."""
    contact: NDArray[np.uint8]
    """(S, P): 1 where the solve of the last step pressed the point against the head, 2 where only lengths did, else 0."""
    directors: _Real
    """(S, P-1, 3): unit director of every segment, world; only torsion "kirchhoff" changes them."""
    twist: _Real
    """(S, P-2) [rad]: twist of every joint with its whole turns; only torsion "kirchhoff" changes it."""

    def __init__(
        self,
        points: _Real,
        velocity: _Real,
        tension: _Real,
        contact: NDArray[np.uint8],
        directors: _Real,
        twist: _Real,
    ) -> None: ...

def at_rest(points: _Real, directors: _Real | None = None) -> State:
    """A state at these points (copied; their precision is that of the simulation): no velocity, tension, contact.

    Without `directors` (S, P-1, 3) they are `untwisted_directors` of the points. Where the head's first pose is not the
    identity, pass the rest shape's, turned by it: held directors turn to where the head holds them in the first step.
    """

class DistanceField:
    """Signed distance to the head on a grid, negative inside; trilinear between nodes, clamped outside.

    Must be a true distance (1-Lipschitz): far points are skipped by it.
    """

    def __init__(self, values: NDArray[np.float32], origin: _F64, spacing: float) -> None:
        """Values (nx, ny, nz) float32 [m] at origin (3,) [m] + spacing [m] * index, in the head's rest frame."""

def distance(field: DistanceField, points: _F64) -> tuple[_F64, _F64]:
    """Signed distance (N,) [m] and unit outward normal (N, 3) at points (N, 3) float64 [m] of the head's rest frame."""

def follow(
    strands: _F64, guides: _F64, candidate: NDArray[np.int64], k: int, alike: float, unlike: float
) -> tuple[NDArray[np.uint32], _F32]:
    """Which of its candidates each strand follows, and how much (follow.hpp).

    Args:
        strands: features (N, D), the root first, in units in which differences of root and shape count the same.
        guides: features (G, D).
        candidate: (N, C) rows of the guides, nearest first; negative for none.
        k: guides of a strand.
        alike: difference of shape from its best guide to which another one counts in full.
        unlike: difference from which on it does not count.

    Returns:
        guide (N, k) uint32 and weight (N, k) float32, greatest first, of sum 1; all 0 for a strand without candidates.

    Raises:
        ValueError: shapes that do not fit, a candidate beyond the guides, more than 64 candidates.

    """

class PartingLines:
    """Partings as segments of the scalp's chart, and whether ways between roots cross them (partings.hpp)."""

    def __init__(self, segments: _F64) -> None:
        """Segments (L, 2, 2) float64, both ends of each; raises ValueError for points that are not finite."""

    def across(self, roots: _F64, targets: _F64, candidate: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Whether the straight way from each root (N, 2) to its candidates (N, K), rows of targets (M, 2), crosses one.

        Raises:
            ValueError: another number of rows, a candidate that is no target.

        """

class MeshDistance:
    """Signed distance from the nodes of a grid to a closed mesh, negative inside (mesh_distance.hpp).

    Exact near the surface, an upper bound within a fraction of a cell away from it.
    """

    def __init__(
        self,
        points: _F64,
        triangles: NDArray[np.int32],
        origin: _F64,
        spacing: float,
        shape: tuple[int, int, int],
    ) -> None:
        """Points (V, 3) float64 [m], triangles (T, 3) int32 wound outwards, nodes at origin (3,) + spacing * index.

        Raises:
            ValueError: shapes or indices that do not fit, points that are not finite, a mesh outside the grid.

        """

    @property
    def values(self) -> NDArray[np.float32]:
        """(nx, ny, nz) float32 [m]."""

    def drift(self, moved: _F64) -> NDArray[np.float32]:
        """(3, nx, ny, nz) float32 [m]: how far the foot of each node moves when the mesh's points move to `moved` (V, 3)."""

    def feet(self, points: _F64) -> tuple[NDArray[np.int32], NDArray[np.float32]]:
        """The triangle (N,) and the barycentric weights (N, 3) of the closest point of the mesh for points (N, 3) near it."""

class StepSettings:
    """How to step. Every attribute may be assigned; defaults are those shown."""

    dt: float  # 1/240 s
    theta: float  # 0.6: implicitness, 0.5 .. 1
    look_ahead: float  # 0 rad: linearise ahead of the step, but turn no segment by more; 0 is off, 0.3 is second order
    gravity: tuple[float, float, float]  # (0, -9.81, 0) [m/s^2]
    damping: float  # 3e-3 s: beta, internal
    torsion: Literal["kirchhoff", "rotor", "frenet", "none"]  # "rotor"
    relaxation: Literal["newton", "sweep"]  # "newton"
    tolerance: float  # 1e-4: worst relative length error of a segment
    friction: float  # 0.3: Coulomb, hair on head
    drag: float  # 3.3 1/s: c_perp = drag + drag_speed |u_perp| (0.3 of an isolated 80 um fibre's 11 and 15)
    drag_speed: float  # 4.5 1/m
    drag_along: float  # 0.4: c_par / c_perp
    integrator: Literal["implicit", "explicit"]  # "implicit"; "explicit" is symplectic Euler, for validation

    def __init__(self) -> None: ...

class Deformation:
    """A skin that changes from one frame to the next: the distance to it is the linear blend of both frames'."""

    def __init__(self, before: DistanceField, after: NDArray[np.float32], drift: NDArray[np.float32]) -> None:
        """The second frame.

        Args:
            before: the first frame, which is the `field` of `advance`.
            after: (nx, ny, nz) float32 [m], distance to the second frame at the same nodes.
            drift: (3, nx, ny, nz) float32 [m], how far the skin moves from the first to the second, at the foot of
                each node: friction holds hair to the moving skin.

        Raises:
            ValueError: shapes that do not fit, values that are not finite.

        """

class Drive:
    """What moves the strands during a call of `advance`: n steps."""

    def __init__(
        self,
        head: _F64,
        wind: _F64,
        hand: _F64 | None = None,
        roots: _F64 | None = None,
        deformation: Deformation | None = None,
        blend: _F64 | None = None,
    ) -> None:
        """Poses, wind and skin.

        Args:
            head: (n+1, 4, 4) float64, head's rest frame -> world: before the first step, then after each step.
            wind: (n, 3) float64 [m/s].
            hand: (n+1, 4, 4) float64, the same for points held by the hand (`RestShape.held` = 2); unset, the head's.
            roots: (n+1, S, 3, 4) float64, a rigid map for what the head holds of each strand, from its rest pose into
                the head's frame; unset, the skin is rigid.
            deformation: how the distance to the head changes; unset, it does not.
            blend: (n+1,) float64, 0 .. 1, from the first frame of the deformation to the second.

        Raises:
            ValueError: shapes that do not fit, a deformation without blend.

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
    """Index of the first strand that is no longer finite or torn (a segment below half or above 1.5 times its length), or -1."""
    seconds: float
    """Wall time of the call: the only number here that may differ between two equal calls, with the next one."""
    neighbour_seconds: float
    """Of it, that of hair-hair contact."""

class Neighbours:
    """A method of hair-hair contact for the strands of one rest shape: `HairGrid` or `HairCapsules`."""

class HairGrid(Neighbours):
    """Hair as a continuum: where it is denser than allowed it pushes, and it takes on the velocity around it.

    Mass and momentum go to a grid in the head's frame and accelerations come back, both trilinearly: momentum is
    conserved to rounding. Where the rest shape is denser than `density`, its own density is allowed.
    """

    def __init__(
        self,
        rest: RestShape,
        cell: float,
        density: float,
        pressure: float,
        drag: float,
        limit: float,
        hold: int = 1,
    ) -> None:
        """The densities of the rest shape, on the grid.

        Args:
            rest: the strands, in the head's rest frame.
            cell: [m] spacing of the grid.
            density: [kg/m^3] above which hair pushes, of the mass in `rest.mass`.
            pressure: [m^2/s^2] k_p of a = -k_p grad(density / allowed).
            drag: [1/s] the rate at which velocities blend.
            limit: [m/s^2] largest push along each axis.
            hold: steps from one look at the grid to the next; the force stays with its point in between.

        Raises:
            ValueError: a value outside its range, or cells too small for the reach of the strands.

        """

def advance(
    state: State,
    rest: RestShape,
    field: DistanceField | None,
    drive: Drive,
    settings: StepSettings,
    neighbours: Neighbours | None = None,
) -> Report:
    """Advances the state in place by the steps of the drive.

    Without neighbours a strand's motion depends neither on the number of threads nor on the strands beside it. With
    hair-hair contact all strands go together from one look at their neighbours to the next, of which the first step of
    a call has one; the result depends neither on the number of threads nor on how the steps are split into calls, if
    each begins where one looks. Never raises for bad physics: see `Report.bad_strand`.

    Raises:
        ValueError: shapes that do not fit, or settings outside their range.

    """

class HairCapsules(Neighbours):
    """Every segment a soft rod: rods of different strands push each other apart and rub.

    Two strands that come nearer than 2 `radius` to each other at rest may come as near anywhere. A pair of segments
    has the force of its closest points; forces of both sides are opposite to rounding.
    """

    def __init__(
        self, rest: RestShape, radius: float, stiffness: float, friction: float, speed: float
    ) -> None:
        """Measures how near strands come to each other at rest.

        Args:
            rest: the strands.
            radius: [m] of the rods.
            stiffness: [N/m] force of a pair of segments per depth.
            friction: Coulomb's coefficient.
            speed: [m/s] rods are not pushed apart faster than this.

        Raises:
            ValueError: a value outside its range.

        """

def neighbour_acceleration(
    state: State, rest: RestShape, neighbours: Neighbours, head: _F64, settings: StepSettings
) -> _F64:
    """(S, P, 3) float64 [m/s^2]: what the neighbours do to every point, with the head at the pose (4, 4).

    Of the settings, theta and dt count: soft contacts are softened so that a step of this length is stable.

    Raises:
        ValueError: shapes that do not fit.

    """

def energies(state: State, rest: RestShape, settings: StepSettings) -> _F64:
    """(S, 4) float64 [J]: bending, torsion, kinetic and gravity energy of every strand.

    For "kirchhoff" torsion is the energy of twist. Gravity is 0 at the origin and holds the energy of the load.
    """

def relax(
    points: _F64, rest: RestShape, method: Literal["newton", "sweep"], tolerance: float
) -> tuple[_F64, int]:
    """Points (S, P, 3) whose segments have their rest lengths within the tolerance, and the iterations of the slowest.

    Held points stay; the free ones move as little as their masses ask for, so that their momentum is conserved.
    """

class SagFree:
    """What `sag_free` finds: rest strains, the forces that go with them, and how much stiffness that takes."""

    strain: _F64
    """(S, P-2, 3): rest strains (k1, k2, twist), for `RestShape.strain`, with the stiffness times `factor`."""
    tension: _F64
    """(S, P-1) [N]: of the segments; 0 between held points."""
    reaction: _F64
    """(S, P) [N]: what the head carries of each point, along its normal; 0 where none was asked for."""
    critical: _F64
    """(S,): smallest factor on the true stiffness at which the groom is stable; 1e-4 stands for any smaller one."""
    needed: _F64
    """(S,): factor that is asked for, at least 1."""
    factor: _F64
    """(S,): factor that is given, no more than max_factor."""

def sag_free(
    rest: RestShape, load: _F64, normal: _F64, margin: float, max_factor: float, lean_above: float
) -> SagFree:
    """Rest strains with which `rest.points` are an equilibrium of "kirchhoff" strands under a load, and its stability.

    The equilibrium is exact for any strand (statics.hpp). It is stable with the stiffness times `critical`
    (stability.hpp), and is given `margin` times that where this is more than 1.

    Args:
        rest: nothing is written to it. Whatever holds points beyond the root takes any force and couple, chosen so that
            rest strains change least. Strands without two held points at the root keep the groom as their rest shape.
        load: (S, P, 3) float64 [N], forces on the points in the head's rest frame, weight included.
        normal: (S, P, 3) float64, unit normal of the head where it can support a point, 0 elsewhere.
        margin: at least 1.
        max_factor: at least 1.
        lean_above: at least 1; strands that need more than this lean on the head, where that halves what they need.

    Raises:
        ValueError: shapes that do not fit, or strands without stiffness.

    """

# --- expansion: strands from guides (expand.hpp) -----------------------------------------------------

class BoundStrands:
    """Strands and the guides that they follow; holds the arrays given (see `pipeline.strands.expand.Binding`)."""

    def __init__(
        self,
        parent: NDArray[np.uint32],
        root: NDArray[np.float32],
        guide: NDArray[np.uint32],
        weight: NDArray[np.float32],
        key: NDArray[np.uint32],
        scale: NDArray[np.float32],
        phase: NDArray[np.float32],
    ) -> None:
        """(N,), (N, 3) [m], (N, k), (N, k), (N,), (N,), (N,) [rad], 1 <= k <= 8; raises ValueError."""

class GuideMotion:
    """How the guides' segments have turned since rest, seen from the head: the rotations that strands inherit."""

    def __init__(
        self,
        rest: NDArray[np.float32],
        points: NDArray[np.float32],
        pose: _F64,
        roots: NDArray[np.float32] | None = None,
    ) -> None:
        """Rotations of G guides.

        Args:
            rest: (G, Q, 3) float32 [m], Q >= 3, in the head's rest frame.
            points: (G, Q, 3) float32 [m], in the world.
            pose: (4, 4) float64, head's rest frame -> world.
            roots: (N, 3) float32 [m], where a skin that deforms has carried the root of each strand, in the head's
                rest frame; unset, roots are as at rest.

        Raises:
            ValueError: wrong shapes.

        """

    @property
    def rotations(self) -> NDArray[np.float32]:
        """(G, Q-1, 4) float32: unit quaternions (w, x, y, z), of continuous sign along a guide."""

class ExpandStyle:
    """Distance from the skin [m], clump (0 .. 1) and frizz [rad] of copies."""

    skin: float
    clump: float
    frizz: float

    def __init__(self, skin: float, clump: float, frizz: float) -> None: ...

def expand(
    rest: NDArray[np.float32],
    strands: BoundStrands,
    motion: GuideMotion,
    field: DistanceField | None,
    style: ExpandStyle,
    begin: int,
    out: NDArray[np.float32],
) -> None:
    """Writes the points of strands begin .. begin+n to out, (n, P, 3) float32 [m] in the world.

    `rest` is the groom (S, P, 3) float32 [m], P >= 2. Tangent rotation: a segment turns by the weighted mean of
    its guides' rotations at the same arc length. A strand depends on nothing but its own row of the binding.

    Raises:
        ValueError: shapes or indices that do not fit.

    """

# --- shading: density grid, sweeps, fibres, skin (density, sweep, sky, fibre, shade, surface .hpp) ---
#
# World space [m], float32. Lights are directional; `directions` are unit vectors from the scene to the light.

_F32 = NDArray[np.float32]

class DensityGrid:
    """Drawn hair in voxels, as integer counts.

    Integers add in any order, so that the sums depend neither on threads nor on how strands are cut into chunks.
    """

    def __init__(self, shape: tuple[int, int, int], origin: _F64, spacing: float, width: float) -> None:
        """An empty grid.

        Args:
            shape: voxels along x, y, z; each >= 4.
            origin: (3,) float64 [m], outer corner of the first voxel.
            spacing: [m], side of a voxel.
            width: [m], a typical drawn width; the counts are multiples of spacing * width / 4096.

        """

    def add(self, points: _F32, widths: _F32) -> None:
        """Adds strands: points (S, P, 3) float32 [m], widths (S, P) float32 [m]. Parts outside the grid are left out."""

    def density(self) -> _F32:
        """(nx, ny, nz) float32 [1/m]: length * width per volume; blurred by a Gaussian of 0.7 voxels."""

    shape: tuple[int, int, int]
    origin: tuple[float, float, float]
    spacing: float

def optical_depth(density: _F32, spacing: float, directions: _F32) -> _F32:
    """Line integrals of the density from every voxel's middle along a direction to the border of the grid.

    Args:
        density: (N, nx, ny, nz) float32 [1/m]; (1, nx, ny, nz) is shared by all directions.
        spacing: [m].
        directions: (N, 3) float32 unit vectors.

    Returns:
        (N, nx, ny, nz) float32, one for each direction.

    """

def body_density(
    field: DistanceField, pose: _F64, shape: tuple[int, int, int], origin: _F64, spacing: float
) -> _F32:
    """(nx, ny, nz) float32 [1/m]: the head as an almost opaque solid, one voxel thinner than it is.

    Args:
        field: the head in its rest frame.
        pose: (4, 4) float64, rest frame -> world.
        shape: voxels of the grid.
        origin: (3,) float64 [m], outer corner of the first voxel.
        spacing: [m].

    """

def surroundings(
    hair: _F32, body: _F32 | None, spacing: float, loss: _F32, directions: _F32, answers: _F32
) -> tuple[_F32, _F32]:
    """What a point sees of the sky, and which way is out of the hair, on a grid of half the resolution.

    Args:
        hair: (nx, ny, nz) float32 [1/m], density without direction; even extents.
        body: (nx/2, ny/2, nz/2) float32 [1/m], on voxels twice as large; None: there is none.
        spacing: [m], of the hair's voxels.
        loss: (3,) float32, part of the light that one fibre takes away, for R, G, B.
        directions: (D, 3) float32, evenly spread unit vectors.
        answers: (D, 17) float32, how hair answers to light from there as the eye sees it. 0-2: the mean over fibres of all
            directions, R, G, B, of mean 1; 3-11: its gradient [1/m] along x, y, z for R, for G, for B, as the eye's
            direction turns from the grid's middle on; 12-16: m (h h - 1/3), xx, yy, xy, xz, yz, where a fibre of tangent t
            answers by m P2(t . h) more in green, h between the directions of light and eye.

    Returns:
        (nx/2, ny/2, nz/2, 16) float32: transmittance as hair answers, R, G, B, 0, outward normal x, y, z (not normalised),
        0, mean of m (h h - 1/3) as much as comes through, xx, yy, xy, xz, yz, 0, 0, 0;
        (nx/2, ny/2, nz/2, 4) float32: mean transmittance R, G, B, 0.

    """

class Shadows:
    """Hair and head as each light sees them: layers of strands under the surface that the light meets first (shadow_map.hpp).

    Sums are integers: they depend neither on threads nor on how strands are cut into chunks.
    """

    def __init__(self, directions: _F32) -> None:
        """Of lights in these directions: (L, 3) float32, unit vectors towards them."""

    def begin(
        self,
        lower: _F64,
        upper: _F64,
        spacing: float,
        width: float,
        share: float = 1.0,
        told: float = 0.0,
    ) -> None:
        """Empties the maps, in the memory that they have.

        Args:
            lower: (3,) float64 [m], bounds of all strands; what lies outside casts no shadow.
            upper: (3,) float64 [m].
            spacing: [m], between the nodes of a map; the bounds are at most 2000 of it.
            width: [m], a typical drawn width.
            share: the part of all strands that is added, as much wider, to cast the shadows of all.
            told: the part of all strands, where they are few, of which it is told past which others light goes.

        """

    def add(self, points: _F32, widths: _F32) -> None:
        """Keeps strands until `finish`: points (S, P, 3) float32 [m], widths (S, P) float32 [m]; P is always the same."""

    def finish(
        self, hair: _F32, origin: _F64, spacing: float, field: DistanceField | None, pose: _F64
    ) -> None:
        """Makes the maps.

        Args:
            hair: (nx, ny, nz) float32 [1/m], strands on the density grid: deep in the hair less care is taken.
            origin: (3,) float64 [m], outer corner of its first voxel.
            spacing: [m], of its voxels.
            field: the head in its rest frame.
            pose: (4, 4) float64, rest -> world.

        """

    def lit(self, light: int, axis: _F32, ways: _F32, roots: _F32, places: _F32) -> _F32:
        """Parts (N,) of strands around points that a light reaches past all other strands, where strands are told apart.

        Args:
            light: its number.
            axis: (N, 3) float32 [m], points of strands.
            ways: (N, 2, 3) float32 [m], how far along the strand, to both sides; none beyond an end.
            roots: (N, 3) float32 [m], the first points of the points' strands.
            places: (N,) float32, where along them the points are: 0 .. 1.

        """

    def map(self, light: int) -> tuple[_F32, _F32, _F32]:
        """A finished map itself, not a copy, on (nu, nv) nodes.

        Returns:
            (nu, nv, 2): distance [m] of the first strand from the map's beginning, and strands there are in all;
            (nu, nv, 32) uint16: 32 times the strands up to each layer, as binary16; (nu, nv): distance [m] of the head.

        """

    def reach(self, light: int, points: _F32, own: float = 0.0) -> _F32:
        """(N, 3) float32 at points (N, 3) float32 [m]: strands towards the light and behind, and what the head lets pass.

        With `own` 1 the strand that each point lies on is not counted.
        """

class FibreTables:
    """Scattering of one fibre, tabulated; see `pipeline.render.fibre`."""

    def __init__(
        self, lobes: _F32, sums: _F32, pigment: _F32, variance: _F32, tilt: _F32, absorption_max: float
    ) -> None:
        """The tables, held and not copied.

        Args:
            lobes: (A, T, H, 8) float32 over absorption (uniform in its root), theta in [0, pi/2], phi in [0, pi]:
                N_R, N_TT, N_TRT, N_rest [1/rad], their means over a half circle G_R, G_TT, G_TRT + G_rest, 0.
            sums: (A, T, 8) float32: a_f, a_b, s, m (see shade.hpp), twice the mean of N over the circle
                for TT and TRT + rest, v_f, v_b.
            pigment: (K, J, 4) float32 over the place from root to tip and variation u in [0, 1]: absorption R, G, B
                [1/radius], factor on the variances.
            variance: (4,) float32, v of the four lobes.
            tilt: (4,) float32 [rad], shift of theta_o in the four lobes.
            absorption_max: [1/radius], absorption at the last level.

        """

    def vary_across(self, across: _F32, eta: float, scale: float) -> None:
        """Let wide strands show what is seen at places across them; see near_field.hpp.

        Args:
            across: (A, T, 32) float32, of each lobe the mean of A_p over the eighths of the way from the middle to a
                side, by the mean over all of it; held and not copied.
            eta: refractive index.
            scale: s of the logistic around the fibre.

        """

    reciprocal: (
        bool  # False: light that is scattered once takes its lobes at theta_d, not at the eye's theta_o
    )

class Illumination:
    """Lights and sky, and what of them reaches where."""

    def __init__(
        self,
        directions: _F32,
        irradiance: _F32,
        sky: _F32,
        shadows: Shadows,
        surroundings: _F32,
        everywhere: _F32,
    ) -> None:
        """Lights with their shadows; all is held and not copied.

        Args:
            directions: (L, 3) float32 unit vectors towards the lights.
            irradiance: (L, 3) float32 [W/m^2], R, G, B on a surface that faces the light.
            sky: (3,) float32, radiance of the constant sky.
            shadows: finished, of the same directions.
            surroundings: (nx/2, ny/2, nz/2, 16) float32, what hair sees of the sky: see `surroundings`.
            everywhere: (nx/2, ny/2, nz/2, 4) float32, what the head does.

        """

    origin: tuple[float, float, float]  # (0, 0, 0) [m]: outer corner of the first voxel
    spacing: float  # 1 m
    glints: bool  # True: sampled visibility per strand and 4 mm instead of its mean

def shade(
    points: _F32,
    variation: _F32,
    key: NDArray[np.uint32],
    eye: _F64,
    light: Illumination,
    tables: FibreTables,
    which: NDArray[np.uint32] | None = None,
) -> _F32:
    """Radiance of strands towards the eye.

    Args:
        points: (S, P, 3) float32 [m], root first.
        variation: (S, 3) float32, how each strand differs: u in [0, 1] and a factor on the variances, see `FibreTables`,
            and what is added to the place on it, of its length.
        key: (S,) uint32, random key of each strand.
        eye: (3,) float64 [m].
        light: lights and sky.
        tables: scattering of one fibre.
        which: (n,) uint32, which of the S * P points; all of them by default.

    Returns:
        (n, 3) float32, linear R, G, B.

    """

class PointShader:
    """Gives points of strands their colours, whenever it is asked."""

class FibreShader(PointShader):
    """Shades points of strands as `shade` does."""

    def __init__(self, light: Illumination, tables: FibreTables, eye: _F64) -> None:
        """Light, scattering of one fibre, and the eye (3,) float64 [m] that looks; light and tables are held."""

class DistanceShader(PointShader):
    """Colours points (1, 1, distance along the line of sight [m])."""

    def __init__(self, eye: _F64, ahead: _F64) -> None:
        """The eye (3,) [m] and the unit line of sight (3,), float64."""

class TangentShader(PointShader):
    """Colours points by the unit direction of their strands from root to tip, in the world."""

class Surface:
    """Points of the head's surface."""

    def __init__(self, points: _F32, normals: _F32, albedo: _F32, curvature: _F32) -> None:
        """Three arrays (N, 3) float32: world positions [m], unit outward normals, linear R, G, B in [0, 1]; (N,) [1/m]."""

def shade_surface(
    surface: Surface, eye: _F64, light: Illumination, field: DistanceField | None, pose: _F64, loss: _F32
) -> _F32:
    """Radiance (N, 3) float32 of the head towards the eye (3,): skin, in the shadow of hair and head.

    Light goes round where the surface is curved, red the farthest; where it is flat skin is Lambertian, with a gloss.

    Args:
        surface: what is lit.
        eye: (3,) float64 [m].
        light: lights and sky.
        field: the head that casts its own shadow, in its rest frame.
        pose: (4, 4) float64, rest frame -> world.
        loss: (3,) float32, part of the light that one fibre takes away, for R, G, B.

    """

# --- pixels (develop.hpp) ---------------------------------------------------------------------------

def turn_over(picture: NDArray[np.uint8] | _F32) -> None:
    """Turns a picture upside down, in place: (H, W, 3) uint8, or (H, W) float32."""

def average(samples: NDArray[np.uint8], per_side: int, decode: _F32) -> _F32:
    """Linear pixels (H, W, 3) float32 of encoded samples (H n, W n, 3), averaged over n x n = per_side x per_side.

    Args:
        samples: uint8.
        per_side: n >= 1.
        decode: (256,) float32, linear value of each byte.

    Raises:
        ValueError: shapes that do not fit.

    """

_Code = TypeVar("_Code", np.uint8, np.uint16)

def develop(linear: _F32, encode: NDArray[_Code], scale: float) -> NDArray[_Code]:
    """Pixels (H, W, 3), uint8 or uint16 as `encode` is, of linear ones (H, W, 3) float32.

    Args:
        linear: of any size; below 0 they are black.
        encode: (K,), the code of scale * linear value, rounded down; values beyond the last entry take it.
        scale: >= 0.

    """

# --- strands as tubes (tubes.hpp) -------------------------------------------------------------------

def tubes(
    points: _F32, widths: _F32, drawn: NDArray[np.bool_], sides: int, eye: _F64, fine: float = 0.0
) -> tuple[_F32, NDArray[np.int32]]:
    """Closed tubes around strands, of which only what faces the eye has triangles.

    Args:
        points: (S, P, 3) float32 [m], P >= 2.
        widths: (S, P) float32 [m], twice the distance of a corner from its point.
        drawn: (S, P-1), the segments that have sides; an end has a lid where its segment is drawn.
        sides: K, 3 to 32.
        eye: (3,) float64 [m].
        fine: [rad], a segment that is narrower as seen from the eye is drawn as its outline, two triangles.

    Returns:
        corners (S, P, K, 3) float32 [m], and triangles (T, 3) over their flat order, outer side against the clock.

    Raises:
        ValueError: shapes that do not fit, 2^31 corners or more.

    """

# --- strands by coverage (raster.hpp) ---------------------------------------------------------------

class Backdrop:
    """What lies behind the hair of a picture of W x H pixels, n x n samples a pixel, top row first."""

    def __init__(self, depth: _F32, samples: NDArray[np.uint8], decode: _F32, per_side: int) -> None:
        """The arrays are held, not copied.

        Args:
            depth: (H n, W n) float32, 0 at the near plane, 1 at the far one, more where there is nothing.
            samples: (H n, W n, 3) uint8, encoded.
            decode: (256,) float32, linear value of each byte.
            per_side: n, 1 to 8.

        """

class Raster:
    """Strands of a picture by exact coverage: `begin`, `count` some or all, `cut_off`, `add` all, `compose`.

    Strands come in chunks of any size, in the same order each time. No result depends on chunks or threads.
    """

    def __init__(self, size: tuple[int, int], layers: float) -> None:
        """Prepare for pictures of one size; memory is kept from one to the next.

        Args:
            size: width and height [px].
            layers: of hair behind which nothing is expected to be seen; a guess that costs time, never the picture.

        """

    shaded: int  # points of the picture; a few of them count twice, where threads meet

    def begin(self, matrix: _F64, scale: float, planes: tuple[float, float]) -> None:
        """Start a picture.

        Args:
            matrix: (4, 4) float64, world [m] to clip space, as OpenGL has it.
            scale: half width [px] that a unit radius has at unit distance.
            planes: distances [m] of the near and the far plane.

        """

    def count(self, points: _F32, widths: _F32, first: int) -> None:
        """Learn how deep hair is seen from strands (S, P, 3) [m] with widths (S, P) [m]; `first` is the first's number."""

    def cut_off(self, backdrop: Backdrop) -> None:
        """End counting: hair behind enough hair, or behind the backdrop, is not looked at."""

    def add(self, points: _F32, widths: _F32, variation: _F32, key: NDArray[np.uint32]) -> None:
        """Add strands (S, P, 3) [m] with widths (S, P) [m], variations (S, 3) and random keys (S,).

        What may be seen of them is copied.
        """

    def compose(
        self,
        backdrop: Backdrop,
        shader: PointShader,
        picture: _F32,
        names: NDArray[np.uint32] | None = None,
    ) -> int:
        """Draw what was added over the backdrop into a picture (H, W, 3), linear RGB.

        Names (H, W) get the key of the strand that takes most of a pixel, 0 where there is no hair.
        Points are shaded when a segment of theirs comes to a pixel that is not full. Returns how many tiles lack hair
        that was cut off too early. If there are any, `add` all strands once more and compose again: only the pixels
        that lack hair are drawn, with nothing cut off.
        """

# --- groom: random numbers, equal spacing, growth, curls, clumps (random, smooth_curve, grow, coil, polylines .hpp) -------
#
# Points (S, P, 3) float64 [m] are strands root first, at equal parts of their `length` (S,) [m] unless told otherwise;
# every result is new, and that of a strand does not depend on the strands beside it. ValueError for other shapes.

def hashed(index: NDArray[np.uint32], word: int) -> NDArray[np.uint32]:
    """Hash (N,) each index (N,) with a word of 32 bits."""

def normal(index: NDArray[np.uint32], word: int, second: int) -> _F64:
    """Standard normal numbers (N,) of the hashes with two words (Box and Muller, 1958); to 1e-14."""

def resampled(points: _F64, count: int) -> _F64:
    """Points (S, count, 3) [m] at equal spacing along the natural cubic splines through strands (S, P, 3), P >= 2.

    Root and tip stay. Segments of a strand agree to 1e-6 of their length, unless it turns back within one segment.
    """

def shortened(points: _F64, length: _F64, count: int) -> _F64:
    """Points (S, count, 3) [m] at equal parts of the first `length` (S,) [m] of polylines (S, K, 3) of any spacing."""

def first_outside(points: _F64, margin: _F64, shape: _F64, ball: bool, hang: float) -> _F64:
    """Arc length (S,) [m] at which polylines (S, K, 3) first come outside by more than `margin` (S,) [m].

    Of the half space n . x + d <= 0, `shape` (n, d), or of a sphere, `shape` (centre, radius). All of it where a strand
    does not. Below the height `hang` [m] a strand is measured as if it hung straight down; -inf: as it lies.
    """

def coiled(points: _F64, reference: _F64, length: _F64, coil: _F64) -> _F64:
    """Points (S, P, 3) [m] moved to a helix about each strand, in frames of least rotation.

    Args:
        points: (S, P, 3) float64 [m].
        reference: (S, 3): direction of the first frame's first axis, as far as it is across the strand.
        length: (S,) [m].
        coil: (S, 6): radius [m], pitch [m], phase at the root [turns], second axis as a part of the first (negative
            for the other hand), arc length [m] at which it begins, arc length [m] over which it reaches its radius.

    Source: Wang, Juettler, Zheng and Liu, "Computation of Rotation Minimizing Frames" (2008).

    """

def shaken(points: _F64, length: _F64, sines: _F64, rise: _F64) -> _F64:
    """Points (S, P, 3) [m] with sines (S, K, 5) added, K <= 8: period [m], phase [turns], amplitude x, y, z [m].

    They grow from the root on, over the arc length `rise` (S,) [m].
    """

def turned(points: _F64, length: _F64, turn: _F64) -> _F64:
    """Points (S, P, 3) [m] of strands whose segments turn about an axis; none changes its length.

    `turn` (S, 6) is the unit axis x, y, z, begin [m], over [m] and angle [rad]: the segment whose middle is at arc length
    s turns by angle * smoothstep((s - begin) / over).
    """

def drawn_in(
    points: _F64, length: _F64, middles: _F64, middle_length: _F64, lock: NDArray[np.int64], pull: _F64
) -> _F64:
    """Points (S, P, 3) [m] moved towards points of the middle (M, Q, 3) that `lock` (S,) tells, of middle_length (M,) [m].

    `pull` (S, 4) is strength, over, begin and shift [m]: the point at arc length s moves by the part
    strength * smoothstep((s - begin) / over) of the way to the middle's at s + shift. A middle that is too short goes
    straight on.
    """

def outside(field: DistanceField, points: _F64, clearance: _F64, rounds: int) -> tuple[_F64, _F64]:
    """Points (S, P, 3) [m] pushed out of the skin along its normal to clearance (P,) [m], and how deep each strand was.

    Points of infinite (negative) clearance stay; the depth (S,) [m] is the greatest of all points and rounds.
    """

def traced(field: DistanceField, origin: _F64, rays: _F64, reach: float, steps: int) -> _F64:
    """Points (N, 3) [m] where unit rays (N, 3) from `origin` (3,) leave the skin, traced inwards from `reach` [m] by spheres."""

class Terrain:
    """What strands grow over: the wall, and the flow of the combing on a grid over the scalp's chart (grow.hpp)."""

    def __init__(
        self, wall: DistanceField, center: _F64, axes: _F64, grid: NDArray[np.float32], step: float
    ) -> None:
        """The chart by its centre (3,) [m] and axes (3, 3), the grid (n, n, 4) of flow x, y, z, and steps of `step` [m]."""

    def grown(self, roots: _F64, first: _F64, growth: _F64, noise: _F64, count: int) -> _F64:
        """Polylines (S, count, 3) [m] of equal steps from the roots (S, 3) and first directions (S, 3).

        Args:
            roots: (S, 3) float64 [m].
            first: (S, 3), unit.
            growth: (S, 10): height of the layer [m], arc length to reach it [m], bend [m], comb [m], what is added to the
                flow x, y, z, what is added to the chart point where the flow is looked up u, v, and length [m]: beyond it
                a strand goes straight on.
            noise: (S, T, 3): added to the target direction, each for 8 steps.
            count: points of a polyline.

        """

class Shape:
    """Signed distance to parts joined in the order in which they are added; see parts.hpp for the formulas.

    `join` is "add", "cut" or "clip" (what is outside of the part goes); `blend` [m] the width of the smooth minimum;
    `box` (2, 3) the corners of a box that holds the part; `turn` (3, 3) takes world rows to the part's axes.
    """

    def __init__(self) -> None: ...
    def ellipsoid(self, join: str, blend: float, box: _F64, center: _F64, turn: _F64, radii: _F64) -> None:
        """An ellipsoid by its middle (3,) [m] and radii (3,) [m]; raises ValueError for radii that are not positive."""

    def tube(self, join: str, blend: float, box: _F64, t: _F64, curve: _F64) -> None:
        """A tube by samples of a curve: parameters (n,), and (3, n, 4) x, y, z, radius with two derivatives."""

    def group(self, join: str, blend: float, box: _F64, center: _F64, turn: _F64, group: Shape) -> None:
        """A shape in axes of its own."""

    def distance(self, points: _F64, reach: float) -> _F64:
        """Distances (N,) [m] of points (N, 3), valid only within `reach` [m] of the surface (infinite: everywhere)."""
