"""Elastic rods at rest by collocation: references that share nothing with the kernels.

Unknowns over the arc s in 0 .. 1 (lengths in L, forces in B/L^2, C in B): unit quaternion q that turns the section's
axes (d1, d2, tangent d3) into the world, and moment m in these axes; the place r follows.

    q' = q (0, u)/2,   m' = -u x m - e3 x (q^-1 n),   u = u_n + (m1, m2, m3/C),   r' = q e3
    n(s) = F + Gamma (1 - s) g        q given at s = 0, m = 0 at s = 1

Source: Antman, "Nonlinear problems of elasticity" (2005), chapter VIII; Kirchhoff's rod with dead loads.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import simpson, solve_bvp
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]
_TOLERANCE, _NODES = 1e-6, 4000
DOWN = np.array([0.0, -1.0, 0.0])


@dataclass(frozen=True)
class ElasticRod:
    """A round rod of length 1, clamped at s = 0."""

    curvature: tuple[float, float, float]
    """Natural u_n about d1, d2 and the tangent, the same all along."""
    frame: Array
    """(3, 3): columns d1, d2, d3 at the clamp."""
    twisting: float
    """C over B."""

    def tip(self, gamma: float = 0.0, force: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Array:
        """Where the tip (3,) rests under its weight and a force at it. The load grows in steps; RuntimeError if stuck."""
        arc, shape = self._unloaded()
        part, step = 0.0, 1.0
        while part < 1:
            aim = min(part + step, 1.0)
            slope = self._slope(aim * np.array(force), aim * gamma)
            found = solve_bvp(slope, self._ends, arc, shape, tol=_TOLERANCE, max_nodes=_NODES)
            if found.success:
                part, step, arc, shape = aim, 1.5 * step, found.x, found.y
            elif (step := step / 4) < 1e-5:
                raise RuntimeError(f"no equilibrium found beyond {part:.3g} of the load")
        fine = np.linspace(0, 1, 20_001)
        q = found.sol(fine)[:4]
        along = _turn(q / np.linalg.norm(q, axis=0), np.array([[0.0], [0.0], [1.0]]) * np.ones_like(fine))
        return np.asarray(simpson(along, x=fine))

    def _unloaded(self) -> tuple[Array, Array]:
        arc = np.linspace(0, 1, 401)
        turn = Rotation.from_matrix(self.frame) * Rotation.from_rotvec(np.outer(arc, self.curvature))
        quaternion = turn.as_quat()
        for i in range(1, len(quaternion)):
            quaternion[i] *= np.sign(quaternion[i] @ quaternion[i - 1])
        return arc, np.concatenate([quaternion.T, np.zeros((3, len(arc)))])

    def _slope(self, force: Array, gamma: float) -> Callable[[Array, Array], Array]:
        natural = np.array(self.curvature)[:, None]
        softness = np.array([1.0, 1.0, 1 / self.twisting])[:, None]

        def slope(arc: Array, y: Array) -> Array:
            q, moment = y[:4], y[4:]
            u = natural + softness * moment
            e3 = np.array([[0.0], [0.0], [1.0]]) * np.ones_like(arc)
            inside = force[:, None] + gamma * DOWN[:, None] * (1 - arc)
            turned = _turn(q * np.array([[-1.0], [-1.0], [-1.0], [1.0]]), inside)
            change = -np.cross(u, moment, axis=0) - np.cross(e3, turned, axis=0)
            vector = q[3] * u + np.cross(q[:3], u, axis=0)
            scalar = -(q[:3] * u).sum(axis=0, keepdims=True)
            return np.concatenate([vector / 2, scalar / 2, change])

        return slope

    def _ends(self, root: Array, tip: Array) -> Array:
        start = Rotation.from_matrix(self.frame).as_quat()
        start *= np.sign(start @ root[:4])
        return np.concatenate([root[:4] - start, tip[4:]])


def _turn(q: Array, v: Array) -> Array:
    """Vectors (3, n) turned by quaternions (4, n), scalar last, of any length (their square scales)."""
    twice = 2 * np.cross(q[:3], v, axis=0)
    return np.asarray(v + q[3] * twice + np.cross(q[:3], twice, axis=0))
