"""Procedural grooms: a strand is itself in any count and chunk, grows on the skin and stays out of it."""

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from shipped_configs import shipped

from pipeline import cache
from pipeline.config.schema import Config, Contact, Curl, Groom, Scene, Swatch
from pipeline.groom import stage
from pipeline.groom.head.distance import distance
from pipeline.groom.heads import Head
from pipeline.groom.procedural import Style
from pipeline.groom.roots import Factor, place_roots
from pipeline.groom.swatch import swatch
from pipeline.strands.random import normal, uniform
from pipeline.strands.strands import Strands

COLUMNS = ("points", "held", "normal", "key")


def unequal(points: NDArray[Any]) -> float:
    """Largest relative difference of a segment from the mean of its strand."""
    length = np.linalg.norm(np.diff(points.astype(np.float64), axis=1), axis=2)
    return float(np.abs(length / length.mean(axis=1, keepdims=True) - 1).max())


def assert_same(a: Strands, b: Strands) -> None:
    for name in COLUMNS:
        assert np.array_equal(getattr(a, name), getattr(b, name)), name


def test_a_strand_is_the_same_at_any_count(mannequin: Head, wavy: Strands) -> None:
    few = Style(shipped("default", strands=1000), mannequin).strands(0, 1000)
    moved = np.abs(few.points - wavy.points[:1000]).max()
    print(f"1,000 strands against the first of 5,000: largest difference {moved:.1e} m")
    assert_same(few, Strands(**{name: getattr(wavy, name)[:1000] for name in COLUMNS}))


def test_any_chunking_gives_the_same_strands(mannequin: Head) -> None:
    style = Style(shipped("curly", strands=800), mannequin)
    whole = style.strands(0, 800)
    for edges in ([0, 1, 8, 137, 800], [0, 333, 334, 799, 800]):
        for first, last in pairwise(edges):
            part = style.strands(first, last - first)
            assert_same(part, Strands(**{name: getattr(whole, name)[first:last] for name in COLUMNS}))


def test_seeds_give_other_strands(mannequin: Head, wavy: Strands) -> None:
    config = shipped("default", strands=200).model_copy(update={"seed": 2})
    other = Style(config, mannequin).strands(0, 200)
    apart = np.linalg.norm(other.points - wavy.points[:200], axis=2).mean()
    print(f"mean distance of points under two seeds: {1000 * apart:.1f} mm")
    assert apart > 0.01
    assert (other.key != wavy.key[:200]).all()


def test_roots_lie_on_the_skin(wavy: Strands) -> None:
    off = np.abs(distance(wavy.points[:, 0].astype(np.float64))).max()
    print(f"worst distance of a root from the formula's surface: {1e6 * off:.2f} um")
    assert off < 1e-5


@pytest.mark.parametrize("look", ["wavy", "curly"])
def test_segments_of_a_strand_are_equal(mannequin: Head, wavy: Strands, look: str) -> None:
    strands = wavy if look == "wavy" else Style(shipped("curly", strands=800), mannequin).strands(0, 800)
    worst = unequal(strands.points)
    print(f"{look}: worst deviation of a segment {worst:.1e}")
    assert worst < 1e-3


def test_no_groomed_point_lies_below_the_skin(mannequin: Head, wavy: Strands) -> None:
    d = mannequin.field.distance(wavy.points[:, 1:].reshape(-1, 3)).reshape(len(wavy), -1)
    print(f"lowest first point {1000 * d[:, 0].min():.2f} mm, lowest other {1000 * d[:, 1:].min():.2f} mm")
    assert d[:, 0].min() > 0
    assert d[:, 1:].min() > 3e-4


def test_strands_leave_the_skin_outwards(wavy: Strands) -> None:
    start = wavy.points[:, 1] - wavy.points[:, 0]
    cosine = np.einsum("ij,ij->i", start, wavy.normal) / np.linalg.norm(start, axis=1)
    print(f"angle from the normal: median {np.degrees(np.arccos(np.median(cosine))):.0f} degrees")
    assert (cosine > 0).all()
    assert np.abs(np.linalg.norm(wavy.normal, axis=1) - 1).max() < 1e-5


def test_every_prefix_of_roots_is_more_even_than_white_noise(mannequin: Head, wavy: Strands) -> None:
    def nearest(roots: NDArray[np.float64]) -> tuple[float, float]:
        found = cKDTree(roots).query(roots, k=2)[0][:, 1]
        return float(found.mean()), float(np.percentile(found, 5))

    # One in thirty of a regular sequence, by chance: nothing of its order is left.
    chance, _ = place_roots(1000, 3, mannequin, [Factor(lambda p: mannequin.density(p) / 30, 1.0)])
    for count in (100, 300, 1000):
        (mean, closest), (white, white_closest) = nearest(wavy.points[:count, 0]), nearest(chance[:count])
        print(
            f"{count} roots: nearest neighbours at {1000 * mean:.2f} mm, {mean / white:.2f} of white noise's; "
            f"the closest 5 % at {closest / white_closest:.1f} of white noise's"
        )
        assert mean > 1.1 * white
        assert closest > 1.5 * white_closest


def test_roots_follow_the_wanted_density(mannequin: Head) -> None:
    """Twice the density on one half of the head gives twice the roots there."""

    def share(weight: float) -> float:
        left = Factor(lambda p: np.where(p[:, 0] > 0, 1.0, weight), 1.0)
        roots, _ = place_roots(4000, 1, mannequin, [left, Factor(mannequin.density, 1.0)])
        return float((roots[:, 0] > 0).mean())

    even, double = share(1.0), share(0.5)
    print(f"share of roots on the left: {even:.3f}, with half the density on the right: {double:.3f}")
    assert even == pytest.approx(1 / 2, abs=0.02)
    assert double == pytest.approx(2 / 3, abs=0.02)


def test_hair_parts_and_stays_parted(wavy: Strands) -> None:
    left = wavy.points[:, 0, 0] > 0
    top = wavy.points[:, 0, 1] > 0.09
    kept = np.sign(wavy.points[top, -1, 0]) == np.sign(wavy.points[top, 0, 0])
    print(
        f"left {left.mean():.2f}; of {top.sum()} strands from the top {kept.mean():.3f} end on their own side"
    )
    assert 0.4 < left.mean() < 0.6
    assert kept.mean() > 0.9


def test_random_numbers_are_uniform_and_apart() -> None:
    index = np.arange(100_000)
    u, v = uniform(5, index, 1), uniform(5, index, 2)
    n = normal(5, index, 3)
    correlation = [abs(np.corrcoef(u[:-1], w)[0, 1]) for w in (u[1:], v[:-1], uniform(6, index, 1)[:-1])]
    fill = np.bincount((64 * u).astype(int), minlength=64)
    chi2 = float(((fill - fill.mean()) ** 2 / fill.mean()).sum())
    print(
        f"chi^2 of 64 bins {chi2:.0f}, correlations {np.max(correlation):.4f}, normal {n.mean():.4f} +- {n.std():.4f}"
    )
    assert u.min() >= 0
    assert u.max() < 1
    assert 30 < chi2 < 110
    assert np.max(correlation) < 0.015
    assert abs(n.mean()) < 0.015
    assert n.std() == pytest.approx(1, abs=0.01)


@pytest.mark.parametrize("radius", [0.0, 0.004])
def test_a_swatch_has_the_wanted_length_and_direction(radius: float) -> None:
    patch = Swatch(direction=(0, 0, 2), size=0.02, length=0.1, pin_tips=True)
    style = {"curls": Curl(op="curl", radius=radius, pitch=0.03)}
    groom = Groom(source="swatch", strands=50, swatch=patch, style=style)
    strands = swatch(Config(name="s", scene=Scene(head="none"), groom=groom))
    tip = strands.points[:, -1] - strands.points[:, 0]
    print(
        f"length {strands.length.min():.4f} to {strands.length.max():.4f} m, unequal {unequal(strands.points):.1e}"
    )
    assert np.abs(strands.points[:, 0]).max() <= 0.01 + 1e-6
    assert np.abs(strands.points[:, 0, 2]).max() < 1e-9
    assert np.abs(tip[:, 2] - 0.1).max() < 0.005
    assert (strands.held[:, [0, 1, 2, -3, -2, -1]] == [1, 1, 0, 0, 2, 2]).all()
    assert unequal(strands.points) < 1e-3
    if radius == 0:
        assert np.abs(strands.length - 0.1).max() < 1e-6


def test_a_single_strand_of_a_swatch_starts_at_the_origin() -> None:
    groom = Groom(source="swatch", strands=1, swatch=Swatch(size=0))
    assert (swatch(Config(name="s", scene=Scene(head="none"), groom=groom)).points[0, 0] == 0).all()


def test_without_a_head_the_groom_has_none(tmp_path: Path) -> None:
    groom = Groom(source="swatch", strands=40, guides=7)
    config = Config(name="s", scene=Scene(head="none"), groom=groom)
    experiment = cache.Experiment(tmp_path)
    stage.execute(config, experiment, "key")
    with cache.open(experiment.groom, "groom") as r:
        assert not [name for name in r.names if name.startswith("head/")]
        assert r["strands/points"].shape == (40, 32, 3)
        assert r["guides/strand"].shape == (7,)
        assert (r["guides/offset"][:] == np.float32(config.simulate.contact.offset)).all()


def test_the_stage_writes_the_same_bytes_again(
    tmp_path: Path, mannequin: Head, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(stage, "make_head", lambda _config: mannequin)
    config = shipped("default", strands=9000, guides=60)
    made = []
    for name in ("a", "b"):
        experiment = cache.Experiment(tmp_path / name)
        stage.execute(config, experiment, "key")
        with cache.open(experiment.groom, "groom") as r:
            made.append({column: r[column][:] for column in r.names})
            assert r.meta["report"]["strands"] == 9000
    print(f"{len(made[0])} columns: {', '.join(made[0])}")
    assert made[0].keys() == made[1].keys()
    assert all(np.array_equal(made[0][column], made[1][column]) for column in made[0])
    assert made[0]["strands/points"].shape == (9000, 32, 3)
    assert made[0]["guides/offset"].shape == (60, 32)


def test_guides_keep_most_of_their_groomed_distance_up_to_the_layer(mannequin: Head, wavy: Strands) -> None:
    contact, points = Contact(offset=0.001, layer=0.02), wavy.points[:300]
    offset = stage.contact_offset(contact, mannequin.field, points)
    groomed = mannequin.field.distance(points.reshape(-1, 3)).reshape(300, -1)
    above = (offset - np.maximum(groomed, contact.offset)).max()
    steps = np.abs(np.diff(offset[:, 1:], axis=1)).max(axis=1) / wavy.spacing[:300]
    print(
        f"offsets up to {1000 * offset.max():.2f} mm, {1000 * above:.2f} mm above the groomed; steps {steps.max():.2f}"
    )
    assert offset.max() <= contact.layer + 1e-6
    assert above < 1e-6
    assert steps.max() < 0.51
