"""Binding, chunk by chunk: whose shape each strand takes, where it grows and which guides it follows."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pipeline.config.schema import Interpolate
from pipeline.interpolate.copies import Roots, looks
from pipeline.strands.expand import Binding
from pipeline.strands.follow import GuideSet, follow, follow_itself, shape_of

CHUNK = 16_384

Rows = Callable[[int, int], NDArray[np.float32]]


@dataclass(frozen=True)
class Groom:
    """What binding reads of a groom; points are read by `rows(a, b)` and never held whole."""

    rows: Rows
    """Rest points (b-a, P, 3) [m] of strands a to b."""
    roots: Roots
    key: NDArray[np.uint32]
    """(S,)."""
    guides: GuideSet

    def __len__(self) -> int:
        return len(self.key)


def bind(groom: Groom, interpolate: Interpolate, seed: int) -> Iterator[Binding]:
    """Yield the binding of all strands, a chunk at a time: first the groom's own, then rounds of copies."""
    count = interpolate.strands or len(groom)
    begin = 0
    while begin < count:
        inside = begin % len(groom)  # a chunk's parents are neighbouring rows
        end = min(begin + CHUNK, begin - inside + len(groom), count)
        index = np.arange(begin, end)
        chunk = _own if begin < len(groom) else _copies
        yield chunk(groom, index, groom.rows(inside, inside + end - begin), interpolate, seed)
        begin = end


def _own(
    groom: Groom, index: NDArray[np.int64], points: NDArray[np.float32], interpolate: Interpolate, _: int
) -> Binding:
    strand = index.astype(np.uint32)
    guide, weight = follow(
        groom.roots.root[index],
        shape_of(points),
        groom.guides,
        interpolate.guides_per_strand,
    )
    follow_itself(strand, groom.guides, guide, weight)
    return Binding(
        parent=strand,
        root=np.ascontiguousarray(points[:, 0]),
        guide=guide,
        weight=weight,
        key=groom.key[index],
        scale=np.ones(len(index), np.float32),
        phase=np.zeros(len(index), np.float32),
    )


def _copies(
    groom: Groom, index: NDArray[np.int64], points: NDArray[np.float32], interpolate: Interpolate, seed: int
) -> Binding:
    parent = index % len(groom)
    root, shape, k = groom.roots.between(index, seed), shape_of(points), interpolate.guides_per_strand
    guide, weight = follow(root.astype(np.float64), shape, groom.guides, k)
    lost = np.flatnonzero(weight[:, 0] == 0)  # shut off from all guides, as its parent is not: it grows there
    root[lost] = groom.roots.root[parent[lost]]
    guide[lost], weight[lost] = follow(root[lost].astype(np.float64), shape[lost], groom.guides, k)
    varied = looks(index, interpolate.variation, seed)
    return Binding(
        parent=parent.astype(np.uint32),
        root=root,
        guide=guide,
        weight=weight,
        key=varied.key,
        scale=varied.scale,
        phase=varied.phase,
    )
