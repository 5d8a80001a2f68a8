"""Expansion: rest shapes and lengths are kept whatever the guides do, and a strand depends on nothing but itself."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from pipeline import kernels
from pipeline.bench.interpolate import HEAD, round_groom, sphere, swung, whole
from pipeline.config.schema import Interpolate
from pipeline.strands.expand import Binding, Expansion, Style

Points = NDArray[np.float32]

STRANDS, POINTS, GUIDES = 600, 32, 60
LENGTH = 0.25
GROOM, REST = round_groom(STRANDS, POINTS, GUIDES)
GUIDE_REST = REST[GROOM.guides.strand]
BINDING = whole(GROOM, Interpolate(strands=3 * STRANDS), seed=5)
OWN = whole(GROOM, Interpolate(), seed=5)
VARIED = Style(clump=0.3, frizz=0.1)
TURNED = np.array([[0.36, 0.48, -0.8, 0.3], [-0.8, 0.6, 0.0, -0.2], [0.48, 0.64, 0.6, 1.0], [0, 0, 0, 1.0]])


def lengths(points: Points) -> NDArray[np.float64]:
    return np.asarray(np.linalg.norm(np.diff(points.astype(np.float64), axis=1), axis=2))


def carried(pose: NDArray[np.float64], points: Points) -> Points:
    return (points @ pose[:3, :3].T + pose[:3, 3]).astype(np.float32)


def everything(expansion: Expansion) -> Points:
    return expansion.chunk(0, expansion.count)


def single(rest: Points, guides: Points, weights: list[float]) -> Expansion:
    """One strand that follows all of the guides."""
    k = len(guides)
    binding = Binding(
        parent=np.zeros(1, np.uint32),
        root=rest[:, 0].copy(),
        guide=np.arange(k, dtype=np.uint32)[None],
        weight=np.array([weights], np.float32),
        key=np.zeros(1, np.uint32),
        scale=np.ones(1, np.float32),
        phase=np.zeros(1, np.float32),
    )
    return Expansion(rest, guides, binding)


def about_z(points: Points, angle: float) -> Points:
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    return np.asarray((points - points[:, :1]) @ turn.T + points[:, :1], np.float32)


@pytest.mark.parametrize("head", [False, True])
def test_at_rest_every_strand_has_its_rest_shape(head: bool) -> None:
    error = np.abs(everything(Expansion(REST, GUIDE_REST, OWN, sphere() if head else None)) - REST).max()
    print(f"rest shape off by {error / LENGTH:.1e} of the length")
    assert error < 1e-5 * LENGTH


def test_lengths_are_exact_whatever_the_guides_do() -> None:
    expansion = Expansion(REST, GUIDE_REST, BINDING, sphere(), VARIED)
    expansion.frame(swung(GUIDE_REST, 1.2), np.eye(4))
    expected = lengths(REST)[BINDING.parent] * BINDING.scale[:, None]
    error = np.abs(lengths(everything(expansion)) / expected - 1).max()
    whole_error = np.abs(lengths(everything(expansion)).sum(axis=1) / expected.sum(axis=1) - 1).max()
    print(f"worst segment off by {error:.1e}, worst strand by {whole_error:.1e}")
    assert error < 1e-5  # positions in float32: 1e-8 m on 8 mm
    assert whole_error < 2e-6


def test_a_turning_head_carries_everything_rigidly() -> None:
    expansion = Expansion(REST, GUIDE_REST, BINDING, sphere(), VARIED)
    still = everything(expansion)
    expansion.frame(carried(TURNED, GUIDE_REST), TURNED)
    error = np.abs(everything(expansion) - carried(TURNED, still)).max()
    print(f"off by {error / LENGTH:.1e} of the length")
    assert error < 5e-5 * LENGTH  # the guides come as float32


def test_a_guide_goes_where_it_was_simulated() -> None:
    expansion = Expansion(REST, GUIDE_REST, OWN)
    moved = swung(GUIDE_REST, 2.0)
    expansion.frame(moved, np.eye(4))
    error = np.abs(everything(expansion)[GROOM.guides.strand] - moved).max()
    print(f"guides off by {error / LENGTH:.1e} of the length")
    assert error < 2e-5 * LENGTH


@settings(max_examples=25, deadline=None)
@given(st.lists(st.integers(0, 3 * STRANDS), max_size=6), st.integers(1, 3))
def test_points_depend_neither_on_chunks_nor_on_threads(cuts: list[int], threads: int) -> None:
    expansion = Expansion(REST, GUIDE_REST, BINDING, sphere(), VARIED)
    expansion.frame(swung(GUIDE_REST, 1.0), TURNED)
    kernels.set_threads(1)
    expected = everything(expansion)
    kernels.set_threads(threads)
    bounds = [0, *sorted(cuts), expansion.count]
    chunks = [expansion.chunk(a, b) for a, b in pairwise(bounds)]
    kernels.set_threads(0)
    assert np.concatenate(chunks).tobytes() == expected.tobytes()


def test_a_strand_is_the_same_whichever_strands_share_its_block() -> None:
    """Blocks are made of neighbours on the skin, tile by tile; a chunk may begin and end inside a tile."""
    groom, rest = round_groom(STRANDS, 12, GUIDES)
    binding = whole(groom, Interpolate(strands=40_000), seed=5)
    guides = rest[groom.guides.strand]
    expansion = Expansion(rest, guides, binding, sphere(), VARIED)
    expansion.frame(swung(guides, 1.0), TURNED)
    expected = everything(expansion)
    cuts = [0, 1, 3000, 16_384, 20_001, 33_000, 40_000]
    chunks = np.concatenate([expansion.chunk(a, b) for a, b in pairwise(cuts)])
    differing = (chunks != expected).any(axis=(1, 2)).sum()
    print(f"{differing} of {len(expected)} strands differ between chunks {cuts} and one piece")
    assert chunks.tobytes() == expected.tobytes()


@pytest.mark.parametrize("angle", [0.5, 1.0, -1.5])
def test_strands_stay_out_of_the_head(angle: float) -> None:
    """At least the skin's distance, as far as it is reached within a quarter of the arc length."""
    style = replace(VARIED, skin=1e-3)
    depth = {}
    for name, field in (("free", None), ("kept out", sphere())):
        expansion = Expansion(REST, GUIDE_REST, BINDING, field, style)
        expansion.frame(carried(TURNED, swung(GUIDE_REST, angle)), TURNED)
        points = carried(np.linalg.inv(TURNED), everything(expansion))
        phi = np.linalg.norm(points, axis=2) - HEAD
        along = np.cumsum(lengths(REST), axis=1)[BINDING.parent] * BINDING.scale[:, None]
        wanted = np.minimum(style.skin, phi[:, :1] + along / 4)
        depth[name] = (wanted - phi[:, 1:]).max()
    print(f"penetration {depth['kept out'] * 1e3:.3f} mm, without push {depth['free'] * 1e3:.1f} mm")
    assert depth["kept out"] < 0.1e-3
    assert depth["free"] > 5e-3


def test_roots_below_the_skin_come_out_gently() -> None:
    sunken = (REST - 0.012 * REST[:, :1] / HEAD).astype(np.float32)
    roots = replace(OWN, root=np.ascontiguousarray(sunken[:, 0]))
    points = everything(Expansion(sunken, sunken[GROOM.guides.strand], roots, sphere()))
    outside = np.linalg.norm(points, axis=2)[:, 8:] - HEAD
    turn = (np.diff(points, axis=1) * np.diff(sunken, axis=1)).sum(axis=2) / lengths(sunken) ** 2
    angle = np.arccos(np.minimum(turn, 1)).max()
    print(f"lowest point after 6 cm {outside.min() * 1e3:.2f} mm, largest turn {angle:.2f} rad")
    assert outside.min() > 0.4e-3
    assert 0.01 < angle < 0.8


def test_two_guides_give_half_of_each_turn_and_parted_ones_the_nearest(straight: NDArray[np.float64]) -> None:
    rest = straight[None].astype(np.float32)
    guides = np.concatenate([rest, rest + np.array([0, 0, 0.01], np.float32)])
    expansion = single(rest, guides, [0.5, 0.5])
    found = []
    angles = np.linspace(0, np.pi, 181)
    for angle in angles:
        expansion.frame(np.concatenate([guides[:1], about_z(guides[1:], angle)]), np.eye(4))
        tip = everything(expansion)[0, -1] - rest[0, 0]
        found.append(np.arctan2(tip[1], tip[0]))
    error = np.abs(np.array(found[:45]) - angles[:45] / 2).max()
    print(f"half turns off by {error:.1e} rad; largest step {np.abs(np.diff(found)).max():.3f} rad a degree")
    assert error < 1e-5
    assert np.abs(found[76:]).max() < 1e-6
    assert np.abs(np.diff(found)).max() < 0.06  # no popping in time


def test_a_strand_reads_its_guide_at_the_same_arc_length(straight: NDArray[np.float64]) -> None:
    """A guide of twice the length that bends at a quarter of it bends a strand in the middle."""
    guide = 2 * straight[None].astype(np.float32)
    moved = guide.copy()
    moved[:, 8:] = about_z(guide[:, 8:], 1.0)
    expansion = single(straight[None].astype(np.float32), guide, [1.0])
    expansion.frame(moved, np.eye(4))
    turned = np.abs(np.diff(everything(expansion)[0, :, 1])) > 1e-6
    print(f"first segment that turned: {turned.argmax()} of {len(turned)}")
    assert 14 <= turned.argmax() <= 16
    assert turned[16:].all()


def test_copies_keep_their_parents_first_direction_and_vary_without_stretching() -> None:
    expansion = Expansion(REST, GUIDE_REST, BINDING, None, VARIED)
    points = everything(expansion)
    first = np.diff(points[:, :2], axis=1)[:, 0] / BINDING.scale[:, None]
    turn = np.abs(first - np.diff(REST[:, :2], axis=1)[BINDING.parent, 0]).max() / lengths(REST).min()
    apart = np.linalg.norm(points - points[:, :1] - (REST - REST[:, :1])[BINDING.parent], axis=2)[STRANDS:]
    print(
        f"first segments turned by {turn:.1e}; tips of copies {apart[:, -1].mean() * 1e3:.1f} mm from parents'"
    )
    assert turn < 1e-5
    assert apart[:, -1].min() > 1e-4
    assert np.array_equal(points[:STRANDS], everything(Expansion(REST, GUIDE_REST, OWN)))


def test_clump_closes_the_distance_to_the_parent_towards_the_tip() -> None:
    still = replace(BINDING, scale=np.ones_like(BINDING.scale), phase=np.zeros_like(BINDING.phase))
    rest = REST[:, :1] - LENGTH * np.linspace(0, 1, POINTS, dtype=np.float32)[:, None] * np.array(
        [0, 1, 0], np.float32
    )
    points = everything(Expansion(rest, rest[GROOM.guides.strand], still, None, Style(clump=0.4)))
    apart = np.linalg.norm((points - rest[BINDING.parent])[STRANDS:, :, [0, 2]], axis=2)
    ratio = apart[:, -1] / apart[:, 0]
    print(f"distance at the tip over that at the root: {ratio.min():.3f} .. {ratio.max():.3f}, expected 0.6")
    assert np.abs(ratio - 0.6).max() < 0.02


def test_rotations_are_unit_and_of_continuous_sign() -> None:
    noise = np.random.default_rng(3).normal(size=GUIDE_REST.shape).astype(np.float32)
    q = kernels.GuideMotion(GUIDE_REST, GUIDE_REST + 0.05 * noise, np.eye(4)).rotations
    off = np.abs(np.linalg.norm(q, axis=2) - 1).max()
    print(
        f"norm off by {off:.1e}; smallest product of neighbours {(q[:, 1:] * q[:, :-1]).sum(axis=2).min():.3f}"
    )
    assert off < 1e-6
    assert (q[:, 1:] * q[:, :-1]).sum(axis=2).min() >= -1e-6


def test_a_guide_that_turns_back_on_itself_stays_finite(straight: NDArray[np.float64]) -> None:
    rest = straight[None].astype(np.float32)
    expansion = single(rest, rest, [1.0])
    folded = rest.copy()
    folded[0, 16:] = 2 * folded[0, 15] - folded[0, 16:]
    expansion.frame(folded, np.eye(4))
    error = np.abs(everything(expansion) - folded).max()
    print(f"folded strand off by {error:.1e} m")
    assert error < 1e-6


def test_what_does_not_fit_is_refused() -> None:
    with pytest.raises(ValueError, match="a parent beyond the groom"):
        everything(Expansion(REST[:100], GUIDE_REST, BINDING))
    with pytest.raises(ValueError, match="a guide beyond the last one"):
        everything(Expansion(REST, GUIDE_REST[:10], BINDING))
    with pytest.raises(ValueError, match="one length N"):
        Expansion(REST, GUIDE_REST, replace(BINDING, scale=BINDING.scale[:5]))
    with pytest.raises(ValueError, match="positive weight"):
        Expansion(REST, GUIDE_REST, replace(BINDING, weight=np.zeros_like(BINDING.weight)))
    expansion = Expansion(REST, GUIDE_REST, BINDING)
    with pytest.raises(ValueError, match="different shapes"):
        expansion.frame(GUIDE_REST[:5], np.eye(4))
    with pytest.raises(ValueError, match="out has shape"):
        expansion.chunk(0, 10, np.empty((9, POINTS, 3), np.float32))
    with pytest.raises(IndexError):
        expansion.chunk(0, expansion.count + 1)


def test_strand_123_is_the_same_at_a_thousand_a_hundred_thousand_and_a_million() -> None:
    """A groom of 700 strands: strand 123 is its own, strand 823 a copy; binding and points, to the byte."""
    groom, rest = round_groom(700, 12, GUIDES)
    guides = rest[groom.guides.strand]
    found = []
    for count in (1_000, 100_000, 1_000_000):
        binding = whole(groom, Interpolate(strands=count), seed=5)
        expansion = Expansion(rest, guides, binding, sphere(), VARIED)
        expansion.frame(swung(guides, 1.0), TURNED)
        rows = [getattr(binding, name)[[123, 823]].tobytes() for name in vars(binding)]
        found.append((rows, expansion.chunk(123, 124).tobytes(), expansion.chunk(100, 900)[723].tobytes()))
    print(f"{sum(map(len, found[0][0]))} bytes of binding, {len(found[0][1])} bytes of points each")
    assert found[0] == found[1] == found[2]
