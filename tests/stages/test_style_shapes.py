"""Operators that give hair another shape: bend, gather and fringe keep their laws on the mannequin."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from shipped_configs import shipped

from pipeline import cache
from pipeline.cache.expansion import expansion_from
from pipeline.config.schema import Bend, Config, Fringe, Gather, Groom, Lengths
from pipeline.groom import stage as groom_stage
from pipeline.groom.head_field import Field
from pipeline.groom.heads import Head
from pipeline.groom.procedural import Style
from pipeline.groom.style.fringe import in_fringe
from pipeline.groom.style.gather import Ring
from pipeline.interpolate import stage as interpolate_stage
from pipeline.simulate import stage as simulate_stage
from pipeline.strands.spacing import arc_length
from pipeline.strands.strands import Strands
from tests.stages.test_style_operators import styled

COUNT = 1500
TAIL = Gather(op="gather")
FRINGE = Fringe(op="fringe")


@pytest.fixture(scope="module")
def tied(mannequin: Head) -> Strands:
    """Hair of 36 cm in a ponytail, and nothing else."""
    style = {"length": Lengths(op="length", length=0.36), "tail": TAIL}
    config = Config(name="tied", groom=Groom(strands=COUNT, points=48, style=style))
    return Style(config, mannequin).strands(0, COUNT)


def crossing(points: NDArray[np.float64], ring: Ring) -> NDArray[np.float64]:
    """Distance [m] from the ring's middle at which strands pass its plane; infinite where they do not."""
    beyond = (points - ring.middle) @ ring.axis
    passes = (beyond[:, :-1] < 0) & (beyond[:, 1:] >= 0)
    part = np.where(passes, -beyond[:, :-1] / np.where(passes, np.diff(beyond, axis=1), 1), 0)[..., None]
    at = points[:, :-1] * (1 - part) + points[:, 1:] * part
    return np.where(passes, np.linalg.norm(at - ring.middle, axis=2), np.inf).min(axis=1)


def test_every_strand_passes_through_the_ring(mannequin: Head, tied: Strands) -> None:
    far = crossing(tied.points.astype(np.float64), Ring.on(mannequin.fitted_field, TAIL))
    print(
        f"strands pass up to {1000 * far.max():.1f} mm from the middle of a ring of {1000 * TAIL.radius:.0f} mm"
    )
    assert far.max() < TAIL.radius
    assert far.min() < 0.2 * TAIL.radius  # and not all at its rim


def test_the_head_holds_strands_at_the_ring_and_nowhere_else(mannequin: Head, tied: Strands) -> None:
    """Two points beside the ring's plane hold the direction in which the tail leaves, as two at the root do."""
    ring = Ring.on(mannequin.fitted_field, TAIL)
    inner = tied.held[:, 2:].astype(bool)
    away = np.abs((tied.points[:, 2:] - ring.middle) @ ring.axis)[inner]
    # Roots whose own clamp is at the ring
    below = np.linalg.norm(tied.points[:, 0] - ring.middle, axis=1) < 0.03
    print(
        f"{below.sum()} roots below the ring; held points at most {1000 * away.max():.1f} mm from its plane"
    )
    assert (inner[~below].sum(axis=1) == 2).all()
    assert (inner[below].sum(axis=1) <= 2).all()
    assert away.max() <= tied.spacing.max()
    assert (tied.held[:, :2] == 1).all()


def test_gathered_hair_lies_on_the_skin_and_the_tail_falls(mannequin: Head, tied: Strands) -> None:
    points = tied.points.astype(np.float64)
    depth = mannequin.field.distance(points[:, 1:].reshape(-1, 3))
    first = np.array([np.flatnonzero(row)[-1] for row in tied.held])
    heights = [own[at + 8 :, 1] for own, at in zip(points, first, strict=True)]
    falls = np.mean([(np.diff(own) < 0).all() for own in heights if len(own) > 1])
    print(
        f"lowest point {1000 * depth.min():.2f} mm above the skin; {100 * falls:.1f} % of tails fall all the way"
    )
    assert depth.min() > 0
    assert falls > 0.99


def test_hair_too_short_for_the_ring_stays_untied(mannequin: Head) -> None:
    style = {"length": Lengths(op="length", length=0.1), "tail": TAIL}
    strands = Style(Config(name="short", groom=Groom(strands=COUNT, style=style)), mannequin).strands(
        0, COUNT
    )
    reached = strands.held[:, 2:].any(axis=1)
    root = np.linalg.norm(strands.points[:, 0] - Ring.on(mannequin.fitted_field, TAIL).middle, axis=1)
    print(
        f"10 cm of hair: {100 * reached.mean():.0f} % are tied, roots up to {100 * root[reached].max():.1f} cm away"
    )
    assert 0 < reached.mean() < 1
    assert root[reached].max() < 0.1
    assert (strands.held[~reached, 2:] == 0).all()


def test_a_part_of_the_hair_can_be_gathered(mannequin: Head) -> None:
    style = {
        "length": Lengths(op="length", length=0.36),
        "tail": Gather(op="gather", fraction={"formula": "smoothstep(0.599, 0.601, height)"}),
    }
    strands = Style(Config(name="half", groom=Groom(strands=COUNT, style=style)), mannequin).strands(0, COUNT)
    tied = strands.held[:, 2:].any(axis=1)
    lowest, highest = strands.points[tied, 0, 1].min(), strands.points[~tied, 0, 1].max()
    print(
        f"{100 * tied.mean():.0f} % tied: roots above {100 * lowest:.1f} cm; the others below {100 * highest:.1f} cm"
    )
    assert 0.1 < tied.mean() < 0.9
    assert lowest > highest - 1e-3


def test_no_strand_of_a_fringe_reaches_below_the_cut(mannequin: Head) -> None:
    config = shipped("default", strands=4000)
    style = {name: op for name, op in config.groom.style.items() if op.op == "direction"} | {"fringe": FRINGE}
    groom = config.groom.model_copy(update={"style": style})
    strands = Style(config.model_copy(update={"groom": groom}), mannequin).strands(0, 4000)
    rooted = in_fringe(strands.points[:, 0].astype(np.float64), FRINGE)
    points = strands.points[rooted].astype(np.float64)
    off = mannequin.field.distance(points[:, 1:].reshape(-1, 3))
    tips = points[:, -1]
    print(
        f"{rooted.sum()} strands end {1000 * (tips[:, 1].min() - FRINGE.height):.1f} to "
        f"{1000 * (tips[:, 1].max() - FRINGE.height):.1f} mm above the cut, {1000 * off.min():.2f} to {1000 * off.max():.1f} mm off the skin"
    )
    assert rooted.sum() > 50
    assert points[..., 1].min() >= FRINGE.height
    assert np.median(tips[:, 1]) < FRINGE.height + 2 * FRINGE.uneven
    assert off.min() > 0
    assert (tips[:, 2] > 0.08).all()  # in front of the face, not beside it


@pytest.mark.parametrize("measured_from", ["tip", "root"])
def test_a_bend_turns_tips_and_keeps_lengths(measured_from: str) -> None:
    straight = styled(Lengths(op="length", length=0.3))
    op = Bend(
        op="bend", angle=0.9, jitter=0, over=0.05, start=0.02, measured_from=measured_from, towards=(1, 0, 0)
    )
    hair = styled(Lengths(op="length", length=0.3), op)
    segments = np.diff(hair.points, axis=1)
    turned = np.arctan2(segments[..., 0], -segments[..., 1])
    begin = 0.02 if measured_from == "root" else 0.3 - 0.07
    middle = 0.5 * (hair.along[:, 1:] + hair.along[:, :-1])
    stretch = np.abs(arc_length(hair.points)[:, -1] - arc_length(straight.points)[:, -1]).max()
    after = np.abs(turned[middle > begin + 0.05] - 0.9).max()
    print(f"off by {after:.1e} rad beyond the range; lengths change by {stretch:.1e} m")
    assert np.abs(turned[middle < begin]).max() < 1e-12
    assert after < 1e-12
    assert stretch < 1e-12


def test_a_turn_of_the_head_leaves_every_strand_in_its_ring(tmp_path: Path) -> None:
    """Simulated guides and the strands that follow them, 0.4 s into the shipped motion."""
    config = shipped("ponytail", strands=400, guides=40)
    config = config.model_copy(update={"simulate": config.simulate.model_copy(update={"frames": 11})})
    experiment = cache.Experiment(tmp_path)
    for stage, name in (
        (groom_stage, "groom"),
        (simulate_stage, "simulate"),
        (interpolate_stage, "interpolate"),
    ):
        stage.execute(config, experiment, name)
    with cache.open(experiment.groom, "groom") as groom, cache.open(experiment.strands, "strands") as strands:
        expansion, tied = expansion_from(groom, strands, config), groom["strands/held"][:][:, 2:].any(axis=1)
        spacing = float(groom["head/spacing"][0])
        skin = Field(groom["head/distance"][:], np.asarray(groom["head/origin"][:], np.float64), spacing)
    tail = config.groom.style["tail"]
    assert isinstance(tail, Gather)
    ring = Ring.on(skin, tail)
    far, tips = [], []
    with cache.open_guides(experiment.guides) as guides:
        for frame in (0, 10):
            pose = guides.pose(frame)
            expansion.frame(guides.frame(frame), pose)
            points = expansion.chunk(0, len(tied)).astype(np.float64)[tied]
            own = (points - pose[:3, 3]) @ pose[:3, :3]
            far.append(crossing(own, ring))
            tips.append(own[:, -1])
    swung = np.linalg.norm(tips[1] - tips[0], axis=1).mean()
    moved = np.abs(far[1] - far[0]).max()
    print(
        f"tips swing by {100 * swung:.1f} cm against the head, strands within their ring by {1000 * moved:.2f} mm; "
        f"half of them pass {1000 * np.median(far[1]):.1f} mm from its middle, 99 % within {1000 * np.quantile(far[1], 0.99):.1f} mm"
    )
    assert swung > 0.01
    assert moved < 2e-3  # by the blend of 40 guides
    assert np.quantile(far[1], 0.99) < tail.radius
