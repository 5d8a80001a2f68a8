"""Ways to carry the motion of guides over to strands: the one of production, and those that it is compared with.

Notation: bar a thing at rest; x_j points, t_j unit tangents, dl length of a segment; w_g weights of a strand's guides;
A_gj how segment j of guide g has turned, as production knows it (kernels' guide_motion); F_j frames carried along a strand
by minimal rotations, from a root segment that does not turn against the head.
    tangent rotation     x_{j+1} = x_j + R_j (xbar_{j+1} - xbar_j),  R_j the normalised mean of A_gj          (production)
    raw positions        x_j = xbar_j + sum_g w_g (x_gj - xbar_gj)
    frame skinning       x_j = sum_g w_g (x_gj + A_gj (xbar_j - xbar_gj)), its segments brought back to their lengths
    strain increments    k_j = kbar_j + sum_g w_g (k_gj - kbar_gj), k_j the rotation vector from segment j-1 to j in F_{j-1};
                         against drift the tangents get what those of frame skinning, smoothed over a curl, are aside
Sources: Hsu et al., "Real-time Physically Guided Hair Interpolation" (ACM TOG 43, 2024) for what is wrong with positions;
Bergou et al., "Discrete Elastic Rods" (2008) for frames and strains. All strands and guides have one length.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation

from pipeline.config.schema import Interpolate
from pipeline.interpolate.bind import Groom, bind
from pipeline.interpolate.copies import Roots
from pipeline.strands.chart import Chart
from pipeline.strands.expand import Binding, Expansion
from pipeline.strands.follow import GuideSet, shape_of
from pipeline.strands.partings import Neighbours, Partings
from pipeline.validation.interpolation.scene import Index, Scene

Floats = NDArray[np.float64]

_DRIFT = 0.01  # [m] deviation of the Gaussian over which strain increments are corrected


@dataclass(frozen=True)
class Following:
    """Strands of a scene that follow some of the others, the guides."""

    scene: Scene
    strands: Index
    """(n,): the strands that are looked at."""
    guides: Index
    """(G,), ascending."""
    binding: Binding
    """Of all strands of the scene."""

    @classmethod
    def of(cls, scene: Scene, guides: Index) -> "Following":
        """All strands that are no guides, bound as production binds them."""
        points, partings = scene.points, Partings(Chart.from_above())
        root, key = points[:, 0].astype(np.float64), np.zeros(len(points), np.uint32)
        roots = Neighbours(root[guides], partings)
        chosen = GuideSet(roots, shape_of(points[guides]), guides.astype(np.uint32))
        groom = Groom(lambda a, b: points[a:b], Roots(root, partings, scene.field), key, chosen)
        binding = next(bind(groom, Interpolate(), 1))
        return cls(scene, np.setdiff1d(np.arange(len(points)), guides), guides, binding)

    @property
    def rest(self) -> Floats:
        """(n, P, 3) [m]."""
        return self.scene.points[self.strands].astype(np.float64)

    @property
    def guide_rest(self) -> Floats:
        """(G, P, 3) [m]."""
        return self.scene.points[self.guides].astype(np.float64)

    def mean(self, of_guides: Floats) -> Floats:
        """Weighted mean (n, ...) over each strand's guides of what belongs to guides (G, ...)."""
        guide, weight = self.binding.guide[self.strands].astype(np.int64), self.binding.weight[self.strands]
        each = (
            of_guides[g] * w.reshape(-1, *[1] * (of_guides.ndim - 1))
            for g, w in zip(guide.T, weight.T, strict=True)
        )
        return np.asarray(sum(each), np.float64)


Method = Callable[[Following, Floats], Floats]
"""Points (n, P, 3) [m] of the strands from those of their guides, (G, P, 3), in the head's frame."""


def tangent_rotation(to: Following, moved: Floats) -> Floats:
    """What production does, with its kernels."""
    scene = to.scene
    expansion = Expansion(scene.points, scene.points[to.guides], to.binding, scene.field)
    expansion.frame(moved.astype(np.float32), np.eye(4))
    return expansion.chunk(0, len(scene))[to.strands].astype(np.float64)


def raw_positions(to: Following, moved: Floats) -> Floats:
    """Blended displacements."""
    return to.rest + to.mean(moved - to.guide_rest)


def frame_skinning(to: Following, moved: Floats) -> Floats:
    """Blended positions in the guides' turned frames, with lengths restored."""
    turn = turns(to.guide_rest, moved)
    turn = np.concatenate([turn, turn[:, -1:]], axis=1)
    offset = to.mean(moved - np.einsum("gpij,gpj->gpi", turn, to.guide_rest))
    skinned = offset + np.einsum("npij,npj->npi", to.mean(turn), to.rest)
    return _along(to, _tangents(skinned))


def strain_increments(to: Following, moved: Floats) -> Floats:
    """The guides' changes of bend, added to the strands' own, with drift taken out."""
    change = to.mean(_strains(_tangents(moved)) - _strains(_tangents(to.guide_rest)))
    t = _tangents(to.rest)
    rebuilt = _rebuilt(t[:, 0], _strains(t) + change)
    reach = _DRIFT / float(np.linalg.norm(to.rest[:, 1:] - to.rest[:, :-1], axis=2).mean())
    drift = gaussian_filter1d(_tangents(frame_skinning(to, moved)) - rebuilt, reach, axis=1, mode="nearest")
    return _along(to, rebuilt + drift)


METHODS: dict[str, Method] = {
    "tangent rotation": tangent_rotation,
    "frame skinning": frame_skinning,
    "strain increments": strain_increments,
    "raw positions": raw_positions,
}


def turns(rest: Floats, moved: Floats) -> Floats:
    """How every segment of guides (G, P, 3) has turned, as production's kernels say: matrices (G, P-1, 3, 3).

    Seen on straight strands that follow one guide each, along two axes.
    """
    guides, points = rest.shape[:2]
    spacing = np.linalg.norm(np.diff(rest, axis=1), axis=2).mean(axis=1)
    along = spacing[:, None] * np.arange(points)
    probes = np.zeros((2, guides, points, 3), np.float32)
    probes[0, ..., 0] = probes[1, ..., 1] = along
    probe = np.arange(2 * guides, dtype=np.uint32)
    one, none = np.ones(2 * guides, np.float32), np.zeros((2 * guides, 3), np.float32)
    binding = Binding(probe, none, probe[:, None] % guides, one[:, None], probe, one, 0 * one)
    expansion = Expansion(probes.reshape(-1, points, 3), rest.astype(np.float32), binding)
    expansion.frame(moved.astype(np.float32), np.eye(4))
    x, y = _tangents(expansion.chunk(0, len(binding)).astype(np.float64)).reshape(2, guides, points - 1, 3)
    return np.stack([x, y, np.cross(x, y)], axis=-1)


def _tangents(points: Floats) -> Floats:
    edge = np.diff(points, axis=1)
    return np.asarray(edge / np.linalg.norm(edge, axis=2, keepdims=True))


def _along(to: Following, direction: Floats) -> Floats:
    """Strands with their own lengths of segments along directions (n, P-1, 3)."""
    length = np.linalg.norm(np.diff(to.rest, axis=1), axis=2, keepdims=True)
    edge = length * direction / np.linalg.norm(direction, axis=2, keepdims=True)
    return np.concatenate([to.rest[:, :1], to.rest[:, :1] + edge.cumsum(axis=1)], axis=1)


def _strains(t: Floats) -> Floats:
    """Rotation vectors (N, P-2, 3) from tangent to tangent of (N, P-1, 3), each in the frame of the segment before."""
    axis = np.cross(t[:, :-1], t[:, 1:])
    sine, cosine = (
        np.linalg.norm(axis, axis=2, keepdims=True),
        (t[:, :-1] * t[:, 1:]).sum(axis=2, keepdims=True),
    )
    turn = axis * np.where(sine > 0, np.arctan2(sine, cosine) / np.maximum(sine, 1e-300), 1.0)
    step, frame, strains = _rotations(turn), _first_frames(t[:, 0]), []
    for j in range(turn.shape[1]):
        strains.append(np.einsum("nij,ni->nj", frame, turn[:, j]))
        frame = step[:, j] @ frame
    return np.stack(strains, axis=1)


def _rebuilt(first: Floats, strain: Floats) -> Floats:
    """Tangents (N, P-1, 3) with these strains, from the first one."""
    step, frame, tangents = _rotations(strain), _first_frames(first), [first]
    for j in range(strain.shape[1]):
        frame = frame @ step[:, j]
        tangents.append(frame[:, :, 2])
    return np.stack(tangents, axis=1)


def _first_frames(t: Floats) -> Floats:
    """Frames (N, 3, 3) whose third column is t, turned there from the vertical: aligned over the scalp."""
    axis = np.stack([t[:, 2], 0 * t[:, 0], -t[:, 0]], axis=1)  # y x t
    sine = np.linalg.norm(axis, axis=1, keepdims=True)
    turn = axis * np.arctan2(sine, t[:, 1:2]) / np.maximum(sine, 1e-300)
    return np.asarray(_rotations(turn) @ np.array([[0.0, 1, 0], [0, 0, 1], [1, 0, 0]]))


def _rotations(vectors: Floats) -> Floats:
    matrices = Rotation.from_rotvec(vectors.reshape(-1, 3)).as_matrix()
    return np.asarray(matrices.reshape(*vectors.shape, 3))
