"""Which strands are simulated: k-means on root and shape, then the strands that those serve worst.

The real strand nearest to each centre is a guide. Of the choices measured on a real groom, clusters of root and shape
rebuild it best: 500 of them beat 1,000 random guides. Clusters average strays away; so all strands that are looked at
are rebuilt from the guides (`pipeline.strands.rebuild`), and the worst that are unlike each other become guides too.
Centres start from an even spread over the progressive order; every step is deterministic.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from pipeline.strands.follow import features, shape_of
from pipeline.strands.partings import NOBODY, Neighbours, Partings
from pipeline.strands.rebuild import rebuild_error

Points = NDArray[np.float32]
Floats = NDArray[np.float64]

_PREFIX = 20_000  # strands that are looked at, or more for many guides
_ROUNDS = 12
_STRAYS = 0.04  # of the guides that are chosen as the worst served
_STRAY_ROUNDS = 2  # guides of the first round serve strays of the second
_APART = 0.5  # strays less unlike than that are one, see `pipeline.strands.follow.features`
_FIRST = 100  # guides that a search for an error begins with
_CLOSE = 0.1  # of the least count: how near the search comes to it


@dataclass(frozen=True)
class Choice:
    """Guides, and how well they stand for the strands that were looked at."""

    strand: NDArray[np.uint32]
    """(G,) ascending."""
    error: Floats
    """(S,): of each strand that was looked at, see `rebuild_error`."""

    @property
    def report(self) -> dict[str, float]:
        """Mean, 95th percentile and worst of the error."""
        figures = (self.error.mean(), np.percentile(self.error, 95), self.error.max())
        return {
            name: round(float(f), 5)
            for name, f in zip(("mean_error", "p95_error", "worst_error"), figures, strict=True)
        }

    def __str__(self) -> str:
        """For the log."""
        mean, p95, worst = (f"{100 * figure:.2g} %" for figure in self.report.values())
        return f"strands rebuilt from them are {mean} of their length off in the mean (95th percentile {p95}, worst {worst})"


def looked_at(count: int) -> int:
    """How many strands `choose_guides` looks at for `count` guides: any prefix is a valid groom."""
    return max(_PREFIX, 4 * count)


def choose_guides(points: Points, count: int, partings: Partings, error: float | None = None) -> Choice:
    """Choose guides among strands (S, P, 3) [m]: `count`, or all strands where there are fewer.

    Where a mean error is given they are as few as reach it, to a tenth, and at most `count`.
    """
    points = points[: looked_at(count)]
    count = min(count, len(points))
    if error is None:
        return _chosen(points, count, partings)
    enough, best = min(_FIRST, count), _chosen(points, min(_FIRST, count), partings)
    short = 0  # a count that is known not to do
    while best.report["mean_error"] > error and enough < count:
        short, enough = enough, min(2 * enough, count)
        best = _chosen(points, enough, partings)
    while enough - short > max(_CLOSE * enough, 1):
        middle = (short + enough) // 2
        found = _chosen(points, middle, partings)
        if found.report["mean_error"] > error:
            short = middle
        else:
            enough, best = middle, found
    return best


def _chosen(points: Points, count: int, partings: Partings) -> Choice:
    """`count` guides: clusters, then rounds of strays."""
    if count == len(points):
        return Choice(np.arange(count, dtype=np.uint32), np.zeros(count))
    x = features(points[:, 0].astype(np.float64), shape_of(points))
    strays = round(_STRAYS * count)
    guides = _nearest_strands(x, _clusters(x, count - strays))
    error = rebuild_error(points, guides, partings)
    for left in range(_STRAY_ROUNDS, 0, -1):
        more = _worst(x, error, guides, round(strays / _STRAY_ROUNDS) if left > 1 else count - len(guides))
        if len(more):
            guides = np.sort(np.concatenate([guides, more]))
            error = rebuild_error(points, guides, partings)
    return Choice(guides, error)


def _clusters(x: Floats, count: int) -> Floats:
    """Centres (count, 12) of clusters of features (S, 12)."""
    centres = x[:count].copy()
    for _ in range(_ROUNDS):
        _, nearest = cKDTree(centres).query(x)
        size = np.bincount(nearest, minlength=count)
        for k in range(x.shape[1]):
            total = np.bincount(nearest, x[:, k], count)
            centres[:, k] = np.where(size > 0, total / np.maximum(size, 1), centres[:, k])
    return centres


def _worst(x: Floats, error: Floats, guides: NDArray[np.uint32], count: int) -> NDArray[np.uint32]:
    """The `count` strands of greatest error that are neither guides nor like each other; like ones where there are no more."""
    order = np.argsort(-error, kind="stable")
    order = order[~np.isin(order, guides)]
    taken: list[int] = []
    for strand in order[: 20 * count]:
        if len(taken) == count:
            break
        if not taken or (((x[taken] - x[strand]) ** 2).sum(axis=1) > _APART**2).all():
            taken.append(int(strand))
    rest = order[~np.isin(order, taken)][: count - len(taken)]
    return np.concatenate([np.array(taken, np.uint32), rest.astype(np.uint32)])


def shut_in(guides: NDArray[np.uint32], roots: NDArray[np.float32], partings: Partings) -> NDArray[np.uint32]:
    """The strands, ascending, that have to be guides too: so that each of the roots (S, 3) [m] has one on its side.

    They are found in progressive order: the first strand of every part of the scalp that partings shut off.
    """
    found: list[int] = []
    if partings:
        near = Neighbours(roots[guides].astype(np.float64), partings).near(roots, 1)[:, 0]
        left = np.flatnonzero(near == NOBODY)
        uv = partings.chart.uv(roots[left])
        while len(left):
            found.append(int(left[0]))
            still = partings.across(uv, uv[:1], np.zeros((len(uv), 1), np.int64))[:, 0]
            left, uv = left[still], uv[still]
    return np.array(found, np.uint32)


def _nearest_strands(x: NDArray[np.float64], centres: NDArray[np.float64]) -> NDArray[np.uint32]:
    """The strand nearest to each centre; where two centres ask for one strand, the next one of the second."""
    tree = cKDTree(x)
    _, wanted = tree.query(centres, k=min(8, len(x)))
    taken: dict[int, None] = {}
    for choices in np.asarray(wanted):
        free = next((int(i) for i in choices if int(i) not in taken), None)
        if free is not None:
            taken[free] = None
    spare = (i for i in range(len(x)) if i not in taken)
    while len(taken) < len(centres):
        taken[next(spare)] = None
    return np.sort(np.array(list(taken), np.uint32))
