"""The report of the error that guides and interpolation make: its measures, its floors and who wins."""

import re
from functools import cache
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from named_strands import helix

from pipeline.validation.interpolation import Plan, Report, measure, merged
from pipeline.validation.interpolation.forces import in_equilibrium
from pipeline.validation.interpolation.grooms import HEAD, KINDS, LENGTH, groom, round_head
from pipeline.validation.interpolation.measures import Error, distance, error
from pipeline.validation.interpolation.methods import Following, turns
from pipeline.validation.interpolation.page import write_page
from pipeline.validation.interpolation.report import CHOICES, METHODS, OURS, Floor, Row
from pipeline.validation.interpolation.scene import scene

CURLY = next(kind for kind in KINDS if kind.name == "curly")


@cache
def report() -> Report:
    plan = Plan((CURLY,), 120, (15, 60), (60,))
    return merged(plan, [next(measure(plan))])


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_strands_of_every_kind_have_one_length_and_leave_the_head_alone(kind) -> None:
    points = groom(kind, 60)
    edge = np.linalg.norm(np.diff(points, axis=1), axis=2)
    depth = -round_head().distance(points.reshape(-1, 3)).min()
    print(
        f"lengths {edge.sum(axis=1).min():.4f} to {edge.sum(axis=1).max():.4f} m, depth {1000 * depth:.3f} mm"
    )
    assert edge.sum(axis=1) == pytest.approx(LENGTH, rel=4e-3)
    assert np.ptp(edge, axis=1).max() < 1e-5 * edge.max()
    assert depth < 0.05e-3
    assert np.linalg.norm(points[:, 0], axis=1) == pytest.approx(HEAD, rel=1e-6)


def test_measures_are_zero_for_the_truth_and_a_millimetre_for_hair_a_millimetre_aside() -> None:
    rest = groom(CURLY, 20)
    same, aside = (
        error(CURLY, rest, rest[None], rest[None]),
        error(CURLY, rest, rest[None] + [1e-3, 0, 0], rest[None]),
    )
    print(same, aside)
    assert same.mean == same.worst == same.kink == same.radius == same.length == 0
    assert (aside.mean, aside.p95, aside.worst) == pytest.approx([1e-3 / LENGTH] * 3)
    assert abs(aside.kink) < 1e-6


def test_the_radius_of_narrower_curls_is_seen() -> None:
    wide = helix(CURLY.radius, CURLY.pitch, LENGTH, CURLY.points)[None]
    narrow = wide * [1, 0.8, 0.8] + [0, 0.001, 0]
    found = error(CURLY, wide, narrow[None], wide[None])
    print(f"radius of curls of 4 mm against 5 mm: {found.radius:+.1%}")
    assert found.radius == pytest.approx(-0.2, abs=1e-6)


def test_turns_of_guides_are_what_turned_them() -> None:
    rest = groom(CURLY, 5)
    angle = np.linspace(0, 0.5, rest.shape[1] - 1)[:, None, None]
    c, s = np.cos(angle), np.sin(angle)
    turn = np.block([[c, 0 * c, s], [0 * c, 0 * c + 1, 0 * c], [-s, 0 * c, c]])
    edge = np.einsum("pij,gpj->gpi", turn, np.diff(rest, axis=1))
    moved = np.concatenate([rest[:, :1], rest[:, :1] + edge.cumsum(axis=1)], axis=1)
    found = turns(rest, moved)
    off = np.abs(np.einsum("gpij,gpj->gpi", found, np.diff(rest, axis=1)) - edge).max() / np.abs(edge).max()
    print(f"segments turned by them are off by {off:.1e}, the turns by {np.abs(found - turn).max():.1e}")
    assert off < 1e-3
    assert np.abs(found - turn).max() < 0.05


def test_tangent_rotation_errs_least_of_all_methods_that_move_strands_without_solving_for_them() -> None:
    rows = report().find(choice="ours", guides=60)
    print(", ".join(f"{row.method} {row.error.mean:.2%}, length {row.error.length:.1%}" for row in rows))
    length = {row.method: row.error.length for row in rows}
    best = min((row for row in rows if row.method != "internal forces"), key=lambda row: row.error.mean)
    assert len(rows) == 5
    assert best.method == "tangent rotation"
    assert length["tangent rotation"] < 1e-5
    assert length["raw positions"] > 0.1


def test_more_guides_and_chosen_ones_err_less() -> None:
    ours, random = (
        [row.error.mean for row in report().find(choice=choice, method="tangent rotation")]
        for choice in ("ours", "random")
    )
    print(f"15 and 60 guides: ours {ours[0]:.2%}, {ours[1]:.2%}; random {random[0]:.2%}, {random[1]:.2%}")
    assert ours[1] < ours[0]
    assert (np.array(ours) < random).all()


def test_strands_are_found_again_from_the_forces_inside_them() -> None:
    where = scene(CURLY, 24, "none")
    following = Following.of(where, np.arange(8))
    simulation = where.simulation(following.strands)
    (at_rest, *_, moved) = where.moved(np.arange(24))
    found = in_equilibrium(
        following, moved.load[following.strands], at_rest.points[following.strands], simulation.rest.directors
    )
    moved_by, off = (
        distance(x[None], moved.points[None, following.strands]) for x in (following.rest, found)
    )
    print(f"strands that have moved by {moved_by:.2%} are found again to {off:.1e} of their length")
    assert moved_by > 0.005
    assert off < 1e-3


def test_without_hair_on_hair_guides_alone_move_as_among_all() -> None:
    where = scene(CURLY, 24, "none")
    alone, among = where.moved(np.arange(8)), where.moved(np.arange(24))
    assert all(np.array_equal(a.points, b.points[:8]) for a, b in zip(alone, among, strict=True))


def made_up() -> Report:
    """A report whose errors all differ, so that each figure of the page has one place."""
    plan = Plan(KINDS[:2], 120, (15, 60), (60,))
    cases = [
        (hair, choice, OURS) for hair, choice in (("none", "ours"), ("none", "random"), ("grid", "ours"))
    ]
    wanted = [(*case, count) for case, count in product(cases, plan.guides)]
    wanted += [("none", "ours", method, 60) for method in METHODS if method != OURS]
    rows, figure = [], 1.0
    for kind, (hair, choice, method, count) in product(plan.kinds, wanted):
        figure += 0.01
        rows.append(Row(kind.name, hair, count, choice, method, Error(figure / 100, 0.0, 0.0, 0.0, 0.0, 0.0)))
    return Report(plan, tuple(rows), tuple(Floor(kind.name, 0.5, 0.0, 0.0) for kind in plan.kinds))


def test_the_page_has_every_figure_and_the_pictures_that_it_shows(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    found = made_up()
    write_page(found, tmp_path / "docs" / "error.md", quick=True)
    page = (tmp_path / "docs" / "error.md").read_text()
    in_both_tables = found.find(hair_on_hair="none", choice="ours", guides=60, method=OURS)
    for row in found.rows:
        assert page.count(f"| {100 * row.error.mean:.2f} |") == 1 + (row in in_both_tables), row
    assert {row.choice for row in found.rows} == set(CHOICES)
    shown = re.findall(r"\((pictures/.*?)\)", page)
    assert len(shown) == 2
    for name in shown:
        assert (tmp_path / "docs" / name).read_bytes().startswith(b"\x89PNG")
