"""Binding: near and similar guides of the same side, copies between their neighbours, prefixes that stay."""

from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from pipeline import cache, kernels
from pipeline.bench.interpolate import HEAD, round_groom, sphere, swung, whole
from pipeline.cache.expansion import expansion_from
from pipeline.cache.partings import write_partings
from pipeline.config.schema import Config, Interpolate
from pipeline.interpolate import bind as bind_module
from pipeline.interpolate import stage
from pipeline.interpolate.copies import Roots
from pipeline.strands.chart import Chart
from pipeline.strands.expand import Binding
from pipeline.strands.follow import GuideSet, follow, shape_of
from pipeline.strands.partings import Neighbours, Partings

STRANDS, POINTS, GUIDES = 900, 32, 80
GROOM, REST = round_groom(STRANDS, POINTS, GUIDES)
COUNT = 2500
UNPARTED = Partings(Chart.from_above())
BINDING = whole(GROOM, Interpolate(strands=COUNT), seed=9)


def columns(binding: Binding) -> dict[str, NDArray[np.generic]]:
    return {field.name: getattr(binding, field.name) for field in fields(Binding)}


def test_no_strand_follows_a_guide_across_the_parting() -> None:
    crossing = (np.sign(GROOM.guides.roots.points[BINDING.guide, 0]) != np.sign(BINDING.root[:, :1])) & (
        BINDING.weight > 0
    )
    close = (np.abs(BINDING.root[:, 0]) < 5e-3).sum()
    print(f"{crossing.sum()} crossings; {close} strands grow within 5 mm of the parting")
    assert close > 20
    assert not crossing.any()


def test_weights_are_sorted_and_sum_to_one() -> None:
    error = np.abs(BINDING.weight.sum(axis=1) - 1).max()
    print(f"sums off by {error:.1e}; mean weights {BINDING.weight.mean(axis=0).round(3)}")
    assert error < 1e-6
    assert (np.diff(BINDING.weight, axis=1) <= 0).all()
    assert (BINDING.weight >= 0).all()


def test_a_guide_follows_itself_alone() -> None:
    strand = GROOM.guides.strand
    assert np.array_equal(BINDING.guide[strand, 0], np.arange(GUIDES))
    assert (BINDING.weight[strand] == [1, 0, 0]).all()


def test_similar_guides_come_before_nearer_ones(straight: NDArray[np.float64]) -> None:
    """Of two guides as near, the one of the strand's own shape is preferred; nearness alone does not decide."""
    shapes = np.stack([straight, straight[:, [1, 0, 2]], straight]).astype(np.float32)
    root = np.array([[0, 0, 0.000], [0, 0, 0.004], [0, 0, 0.008]])
    guides = GuideSet(Neighbours(root[:2], UNPARTED), shape_of(shapes[:2]), np.arange(2, dtype=np.uint32))
    guide, weight = follow(root[2:], shape_of(shapes[2:]), guides, 2)
    print(f"nearer but unlike: {weight[0, 1]:.1e}, farther but alike: {weight[0, 0]:.3f}")
    assert guide[0].tolist() == [0, 1]
    assert weight[0, 0] > 0.7


def test_weights_change_smoothly_from_strand_to_strand(straight: NDArray[np.float64]) -> None:
    """Where the set of guides changes, the one that leaves has no weight left."""
    roots = np.random.default_rng(2).uniform(0, 0.05, (60, 3)) * [1, 1, 0]
    shape = shape_of(straight[None].astype(np.float32))
    guides = GuideSet(Neighbours(roots, UNPARTED), shape.repeat(60, 0), np.arange(60, dtype=np.uint32))
    path = np.linspace([0.01, 0.01, 0], [0.04, 0.03, 0], 2000)
    guide, weight = follow(path, shape.repeat(2000, 0), guides, 3)
    dense = np.zeros((2000, 60))
    np.put_along_axis(dense, guide.astype(np.intp), weight.astype(np.float64), axis=1)
    step = np.abs(np.diff(dense, axis=0)).max()
    print(f"largest change of a weight over 18 um: {step:.4f}; {len(np.unique(guide))} guides met")
    assert step < 0.02
    assert len(np.unique(guide)) > 8


def test_who_is_shut_off_from_all_guides_has_no_weights() -> None:
    """Roots right of the parting, guides to its left; one guide on its own side is enough."""
    right = GROOM.roots.root[GROOM.roots.root[:, 0] > 0.01][:5]
    points = GROOM.guides.roots.points.copy()
    points[:, 0] = -np.abs(points[:, 0]) - 1e-3
    for moved, weights in ((None, 0), (7, 1)):
        if moved is not None:
            points[moved, 0] *= -1
        guides = GuideSet(Neighbours(points, GROOM.roots.partings), GROOM.guides.shape, GROOM.guides.strand)
        guide, weight = follow(right, shape_of(REST[:5]), guides, 3)
        print(f"weights {weight[0]}, guides {guide[0]}")
        assert (weight == [weights, 0, 0]).all()
    assert (guide[:, 0] == 7).all()


def test_fewer_guides_than_asked_for_leave_the_rest_without_weight() -> None:
    root = Neighbours(GROOM.guides.roots.points[:1], UNPARTED)
    one = GuideSet(root, GROOM.guides.shape[:1], np.zeros(1, np.uint32))
    guide, weight = follow(GROOM.roots.root[:5], shape_of(REST[:5]), one, 4)
    assert not guide.any()
    assert (weight == [1, 0, 0, 0]).all()


@pytest.mark.parametrize("count", [100, STRANDS, STRANDS + 1, 2000])
def test_every_prefix_is_the_same_groom(count: int) -> None:
    prefix = columns(whole(GROOM, Interpolate(strands=count), seed=9))
    for name, column in columns(BINDING).items():
        assert np.array_equal(column[:count], prefix[name]), name


def test_binding_does_not_depend_on_the_chunks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bind_module, "CHUNK", 130)
    for name, column in columns(whole(GROOM, Interpolate(strands=COUNT), seed=9)).items():
        assert column.tobytes() == columns(BINDING)[name].tobytes(), name


def test_copies_grow_on_the_skin_between_their_neighbours() -> None:
    copies = slice(STRANDS, None)
    height = np.abs(np.linalg.norm(BINDING.root[copies], axis=1) - HEAD).max()
    apart = np.linalg.norm(BINDING.root[copies] - REST[BINDING.parent[copies], 0], axis=1)
    across = np.sign(BINDING.root[copies, 0]) != np.sign(GROOM.roots.root[BINDING.parent[copies], 0])
    between = np.linalg.norm(REST[GROOM.roots.neighbours, 0] - REST[:, None, 0], axis=2).max(axis=1)
    print(
        f"off the skin by {height * 1e3:.3f} mm; {apart.mean() * 1e3:.2f} mm from parents; {across.sum()} cross"
    )
    assert height < 0.05e-3
    assert (apart < between[BINDING.parent[copies]]).all()
    assert apart.min() > 0
    assert not across.any()


def test_copies_fill_the_scalp_evenly() -> None:
    """No two strands share a root, and octants of the scalp keep their share."""
    shares = []
    for roots in (BINDING.root[:STRANDS], BINDING.root[STRANDS : 2 * STRANDS]):
        octant = (roots[:, 0] > 0) * 4 + (roots[:, 1] > HEAD / 2) * 2 + (roots[:, 2] > 0)
        shares.append(np.bincount(octant, minlength=8) / STRANDS)
    print(f"largest change of a share {np.abs(shares[1] - shares[0]).max():.3f}")
    assert np.abs(shares[1] - shares[0]).max() < 0.02
    assert len(np.unique(BINDING.root, axis=0)) == COUNT


def test_far_neighbours_are_left_out() -> None:
    """Two patches of hair: copies stay in theirs."""
    patch = np.random.default_rng(1).uniform(0, 0.01, (8, 3)) * [1, 1, 0]
    lonely = np.concatenate([patch, patch[:3] + np.array([0.5, 0, 0])])
    root = Roots(lonely, UNPARTED, None).between(np.arange(11, 2000), seed=1)
    outside = ((root[:, 0] > 0.02) & (root[:, 0] < 0.49)).sum()
    print(f"{outside} roots between the patches")
    assert outside == 0


def test_a_single_strand_may_be_copied() -> None:
    groom, rest = round_groom(1, 16, 1)
    binding = whole(groom, Interpolate(strands=4), seed=1)
    assert np.abs(binding.root - rest[0, 0]).max() < 0.05e-3
    assert len(np.unique(binding.key)) == 4


# --- with files -----------------------------------------------------------------------------------


def written_groom(folder: Path, head: bool) -> cache.Experiment:
    experiment = cache.Experiment(folder)
    with cache.create(experiment.groom, kind="groom", key="groom") as writer:
        writer.write("strands/points", REST)
        write_partings(writer, GROOM.roots.partings)
        writer.write("strands/key", GROOM.key)
        writer.write("guides/strand", GROOM.guides.strand)
        if head:
            axis = np.arange(-0.15, 0.153, 3e-3)
            grid = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"))
            writer.write("head/distance", (np.linalg.norm(grid, axis=0) - HEAD).astype(np.float32))
            writer.write("head/origin", np.full(3, axis[0]))
            writer.write("head/spacing", np.array([3e-3]))
    return experiment


def config(count: int | None, head: bool) -> Config:
    scene = {"head": "builtin" if head else "none"}
    groom = {"source": "procedural" if head else "swatch"}
    return Config(name="test", seed=9, scene=scene, groom=groom, interpolate={"strands": count})


def test_the_stage_writes_what_the_expansion_reads(tmp_path: Path) -> None:
    experiment = written_groom(tmp_path, head=True)
    options = config(COUNT, head=True)
    stage.execute(options, experiment, "key")
    with cache.open(experiment.groom) as groom, cache.open(experiment.strands, kind="strands") as strands:
        assert strands.key == "key"
        assert strands.meta["copies"] == COUNT - STRANDS
        for name, column in columns(BINDING).items():
            assert np.array_equal(strands[f"strands/{name}"][:], column), name
        expansion = expansion_from(groom, strands, options)
    error = np.abs(expansion.chunk(0, STRANDS) - REST).max()
    print(f"from the files at rest: off by {error:.1e} m")
    assert error < 1e-6
    expansion.frame(swung(REST[GROOM.guides.strand], 1.0), np.eye(4))
    phi, _ = kernels.distance(sphere(), expansion.chunk(0, COUNT)[:, 1:].reshape(-1, 3).astype(np.float64))
    print(f"deepest point after a swing {phi.min() * 1e3:.3f} mm")
    assert phi.min() > -0.1e-3


def test_fewer_strands_than_the_groom_need_no_more_of_it(tmp_path: Path) -> None:
    experiment = written_groom(tmp_path, head=False)
    options = config(40, head=False)
    stage.execute(options, experiment, "key")
    with cache.open(experiment.groom) as groom, cache.open(experiment.strands) as strands:
        expansion = expansion_from(groom, strands, options)
    assert expansion.count == 40
    assert np.abs(expansion.chunk(0, 40) - REST[:40]).max() < 1e-6


def test_a_missing_groom_is_named(tmp_path: Path) -> None:
    with pytest.raises(cache.Missing, match=r"groom\.h5"):
        stage.execute(config(None, head=False), cache.Experiment(tmp_path), "key")
    assert not (tmp_path / "strands.h5").exists()
