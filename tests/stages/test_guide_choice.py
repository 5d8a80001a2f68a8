"""Guides: real strands, better ones than chance would choose, from a prefix of the groom."""

import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from pipeline import cache
from pipeline.config.schema import Config, Groom, Scene, Swatch
from pipeline.groom import stage
from pipeline.groom.guides import choose_guides, looked_at
from pipeline.strands.chart import Chart
from pipeline.strands.partings import Partings
from pipeline.strands.strands import Strands


def error_of(strands: Strands, guides: NDArray[np.integer]) -> float:
    """Mean distance [m] of points when each strand takes the shape of the guide whose root is nearest on its side."""
    shape = strands.points - strands.points[:, :1]
    total = 0.0
    side = np.sign(strands.points[:, 0, 0])
    for which in (-1, 1):
        own, ours = side == which, guides[side[guides] == which]
        nearest = ours[cKDTree(strands.points[ours, 0]).query(strands.points[own, 0])[1]]
        total += np.linalg.norm(shape[own] - shape[nearest], axis=2).mean(axis=1).sum()
    return total / len(strands)


def test_guides_reconstruct_a_groom_better_than_random_ones(wavy: Strands) -> None:
    count = 300
    chosen = error_of(wavy, choose_guides(wavy.points, count))
    by_chance = [error_of(wavy, np.random.default_rng(k).permutation(len(wavy))[:count]) for k in range(5)]
    prefix = error_of(wavy, np.arange(count))
    print(
        f"{count} guides: chosen {1000 * chosen:.2f} mm; random {1000 * np.mean(by_chance):.2f} mm "
        f"(best of 5: {1000 * min(by_chance):.2f}); the first {count}: {1000 * prefix:.2f} mm"
    )
    assert chosen < 0.95 * min(by_chance)
    assert chosen < prefix


def test_more_guides_reconstruct_better(wavy: Strands) -> None:
    errors = [error_of(wavy, choose_guides(wavy.points, count)) for count in (50, 200, 800)]
    print("50, 200, 800 guides: " + ", ".join(f"{1000 * error:.2f} mm" for error in errors))
    assert errors[0] > errors[1] > errors[2]


@pytest.mark.parametrize("count", [1, 2, 77, 4999, 5000, 6000])
def test_guides_are_as_many_different_strands_as_wanted(wavy: Strands, count: int) -> None:
    chosen = choose_guides(wavy.points, count)
    print(f"{count} wanted: {len(chosen)}")
    assert chosen.dtype == np.uint32
    assert len(chosen) == min(count, len(wavy))
    assert (np.diff(chosen.astype(np.int64)) > 0).all()
    assert chosen[-1] < len(wavy)


def test_guides_of_strands_that_are_all_alike_are_still_different(straight: NDArray[np.float64]) -> None:
    points = np.tile(straight.astype(np.float32), (100, 1, 1))
    chosen = choose_guides(points, 30)
    assert len(np.unique(chosen)) == 30


def test_only_a_prefix_is_looked_at(wavy: Strands, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pipeline.groom.guides._PREFIX", 1000)
    few = choose_guides(wavy.points[: looked_at(100)], 100)
    print(f"looked at {looked_at(100)} of {len(wavy)} strands")
    assert np.array_equal(few, choose_guides(wavy.points, 100))


def test_both_sides_of_the_parting_have_guides(wavy: Strands) -> None:
    side = wavy.points[choose_guides(wavy.points, 200), 0, 0]
    print(f"200 guides: {(side > 0).sum()} left, {(side < 0).sum()} right")
    assert min((side > 0).sum(), (side < 0).sum()) > 70


def test_memory_does_not_grow_with_the_count(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Strands are written chunk by chunk; of all their points only a prefix is kept."""
    monkeypatch.setattr("pipeline.groom.guides._PREFIX", 1000)
    groom = Groom(source="swatch", strands=1000, guides=50, swatch=Swatch(length=0.1))
    config = Config(name="m", scene=Scene(head="none"), groom=groom)
    chunk = stage.swatch(config)

    def peak(chunks: int) -> int:
        unparted = Partings(Chart.from_above())
        source = stage.Source(
            (chunk for _ in range(chunks)), 1000 * chunks, unparted, {}, lambda _: chunk[:1]
        )
        monkeypatch.setattr(stage, "_source", lambda *_: source)
        tracemalloc.start()
        stage.execute(config, cache.Experiment(tmp_path / str(chunks)), "key")
        found = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return found

    peak(1)  # imports
    few, many = peak(4), peak(40)
    with cache.open(tmp_path / "40/groom.h5", "groom") as r:
        assert r["strands/points"].shape[0] == 40_000
    print(
        f"4,000 strands: {few / 1e6:.1f} MB, 40,000: {many / 1e6:.1f} MB; their points: {40 * chunk.points.nbytes / 1e6:.1f} MB"
    )
    assert many < few + 0.2 * 36 * chunk.points.nbytes
