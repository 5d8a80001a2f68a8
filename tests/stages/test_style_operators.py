"""Every style operator keeps its law, on its own and in the stack."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from shipped_configs import shipped

from pipeline.config.schema import (
    Clump,
    Curl,
    Direction,
    Flyaway,
    Frizz,
    Lengths,
    Operator,
    Sphere,
    Trim,
    Wave,
)
from pipeline.errors import InputError
from pipeline.groom.heads import Head
from pipeline.groom.procedural import Style
from pipeline.groom.style.chance import Chance
from pipeline.groom.style.ground import Ground
from pipeline.groom.style.hair import Hair
from pipeline.groom.style.stack import OPERATORS, Stack
from pipeline.strands.chart import Chart
from pipeline.strands.partings import Neighbours, Partings
from pipeline.strands.spacing import arc_length

SEED, POINTS, COUNT = 3, 200, 400
CURL: dict[str, Any] = {
    "op": "curl",
    "onset": 0,
    "ramp": 1e-6,
    "radius_jitter": 0,
    "pitch_jitter": 0,
    "strand_jitter": 0,
}


def hanging(index: NDArray[np.int64]) -> Hair:
    """Straight strands of 30 cm that hang from a square of 10 cm at y = 0."""
    golden = np.array([0.7548776662466927, 0.5698402909980532])
    at = 0.1 * ((0.5 + index[:, None] * golden) % 1)
    root = np.column_stack([at[:, 0], 0 * at[:, 0], at[:, 1]])
    down = np.tile([0.0, -1.0, 0.0], (len(index), 1))
    return Hair(
        index=index,
        root=root,
        normal=down,
        points=root[:, None] + np.linspace(0, 0.3, POINTS)[:, None] * down[:, None],
        length=np.full(len(index), 0.3),
        comb=np.tile([1.0, 0.0, 0.0], (len(index), 1)),
    )


def styled(*operators: Operator, count: int = COUNT, **named: Operator) -> Hair:
    style = {f"{op.op}{k}": op for k, op in enumerate(operators)} | named  # type: ignore[attr-defined]
    every = hanging(np.arange(count))
    stack = Stack(style, Ground(SEED, POINTS), hanging, Neighbours(every.root, Partings(Chart.from_above())))
    return stack.strands(np.arange(count))


def across(hair: Hair) -> NDArray[np.float64]:
    """Horizontal displacement (N, K, 2) [m] from straight strands."""
    return (hair.points - hair.root[:, None])[..., [0, 2]]


def test_strands_get_exactly_the_length_that_is_asked_for() -> None:
    wanted = styled(Lengths(op="length", length=0.123))
    curly = styled(Curl(**CURL, radius=0.004, pitch=0.05), Lengths(op="length", length=0.123))
    error, curly_error = (np.abs(arc_length(hair.points)[:, -1] - 0.123).max() for hair in (wanted, curly))
    print(f"12.3 cm asked for: off by {error:.1e} m straight, {curly_error:.1e} m curled")
    assert error < 1e-12
    assert curly_error < 1e-4  # the arc between points is cut short
    assert np.abs(styled(Lengths(op="length", length=0.5)).length - 0.3).max() < 1e-12, (
        "never longer than it was"
    )


def test_jitter_shortens_and_never_lengthens() -> None:
    length = styled(Lengths(op="length", length=0.2, jitter=0.3)).length
    print(
        f"20 cm with jitter 0.3: {length.min():.3f} to {length.max():.3f} m, median {np.median(length):.3f}"
    )
    assert length.max() <= 0.2
    assert 0.2 * (1 - 0.3 * 2) < length.min() < 0.17


@pytest.mark.parametrize("hangs", [True, False])
def test_a_plane_leaves_nothing_below_it(hangs: bool) -> None:
    curls = Curl(**CURL, radius=0.01, pitch=0.04)
    plane = Trim(op="trim", height=-0.1, slope=0.5, hanging=hangs)
    points = styled(curls, plane).points
    above = points[..., 1] - (-0.1 + np.tan(0.5) * points[..., 2])
    print(f"lowest point {above.min():.1e} m above the plane; ends within {above[:, -1].max():.1e} m")
    assert above.min() > -1e-9
    assert hangs or above[:, -1].max() < 1e-9


def test_a_sphere_leaves_nothing_outside() -> None:
    centre = np.array([0.05, 0.0, 0.05])
    sphere = Sphere(centre=(0.05, 0.0, 0.05), radius=0.12)
    points = styled(Trim(op="trim", sphere=sphere)).points
    inside = 0.12 - np.linalg.norm(points - centre, axis=2)
    print(f"farthest point {inside.min():.1e} m inside the sphere; ends within {inside[:, -1].max():.1e} m")
    assert inside.min() > -1e-9
    assert inside[:, -1].max() < 1e-6  # crossings are found on chords


def test_no_strand_is_cut_shorter_than_the_shortest() -> None:
    cut = styled(Trim(op="trim", height=0.05, shortest=0.02))
    assert np.abs(cut.length - 0.02).max() < 1e-12


def test_layers_are_cut_deeper_and_clumps_unevenly() -> None:
    tufts = Clump(op="clump", count=20, strength=0)
    even = styled(Trim(op="trim", height=-0.2, layers=0.05), tufts=tufts)
    uneven = styled(Trim(op="trim", height=-0.2, uneven=0.03, per="tufts"), tufts=tufts)
    within = [np.ptp(uneven.length[uneven.locks["tufts"] == k]) for k in range(20)]
    print(
        f"layers: {even.length.min():.3f} to {even.length.max():.3f} m; one clump differs by {max(within):.1e} m"
    )
    assert 0.15 - 1e-9 <= even.length.min() < 0.155 < 0.199 < even.length.max()
    assert max(within) < 1e-12
    assert np.ptp(uneven.length) > 0.04


def test_a_full_clump_gathers_its_strands_on_the_middle_ones_curve() -> None:
    frizz = Frizz(op="frizz", amplitude=0.003)
    before = styled(frizz)
    after = styled(frizz, Clump(op="clump", count=20, strength=1, strength_jitter=0, over=0.05))
    lock = after.locks["clump1"]
    closed = after.along[0] >= 0.05
    apart = np.linalg.norm(after.points - before.points[lock], axis=2)
    print(
        f"beyond 5 cm strands lie {apart[:, closed].max():.1e} m from their middles, at the root {apart[:, 0].max():.3f} m"
    )
    assert apart[:, closed].max() < 1e-12
    assert np.abs(after.points[:20] - before.points[:20]).max() < 1e-15, "middles stay where they are"
    assert np.abs(after.points[:, 0] - before.points[:, 0]).max() == 0


def test_a_clump_draws_strands_by_its_strength() -> None:
    before, after = styled(), styled(Clump(op="clump", count=20, strength=0.4, strength_jitter=0, over=0.05))
    way = before.points[after.locks["clump0"], -1] - before.points[:, -1]
    gone = after.points[:, -1] - before.points[:, -1]
    assert np.abs(gone - 0.4 * way).max() < 1e-12


def test_a_clump_within_another_one_never_reaches_over_two() -> None:
    big, small = Clump(op="clump", count=12), Clump(op="clump", count=80, within="big")
    inside = styled(big=big, small=small, count=2000).locks
    free = styled(big=big, small=small.model_copy(update={"within": None}), count=2000).locks
    reached = [
        sum(len(np.unique(locks["big"][locks["small"] == k])) > 1 for k in range(80))
        for locks in (inside, free)
    ]
    print(f"small clumps that reach over two big ones: {reached[0]} of 80, {reached[1]} without `within`")
    assert reached[0] == 0
    assert reached[1] > 10


def test_a_curl_is_a_helix_of_the_radius_and_pitch_asked_for() -> None:
    hair = styled(Curl(**CURL, radius=0.005, pitch=0.02))
    offset = across(hair)[:, 1:]
    radius = np.hypot(offset[..., 0], offset[..., 1])
    turns = np.unwrap(np.arctan2(offset[..., 1], offset[..., 0]), axis=1)
    pitch = 2 * np.pi * (0.3 * (POINTS - 2) / (POINTS - 1)) / np.abs(turns[:, -1] - turns[:, 0])
    hands = np.unique(np.sign(turns[:, -1] - turns[:, 0]))
    print(f"radius off by {np.abs(radius - 0.005).max():.1e} m, pitch by {np.abs(pitch - 0.02).max():.1e} m")
    assert np.abs(radius - 0.005).max() < 1e-12
    assert np.abs(pitch - 0.02).max() < 1e-12
    assert hands.tolist() == [-1, 1]


def test_a_curl_begins_at_its_onset_and_is_shared_by_its_clump() -> None:
    tufts = Clump(op="clump", count=20, strength=0)
    options = CURL | {"onset": 0.1, "ramp": 0.05, "phase_jitter": 0}
    hair = styled(Curl(**options, radius=0.005, pitch=0.02, per="tufts"), tufts=tufts)
    offset = across(hair)
    before = np.abs(offset[:, hair.along[0] < 0.1]).max()
    lock = hair.locks["tufts"]
    alike = np.abs(offset - offset[lock]).max()
    print(f"before the onset {before:.1e} m, strands of one clump differ by {alike:.1e} m")
    assert before == 0
    assert alike < 1e-12
    assert len(np.unique(np.round(offset[:20, -1], 9), axis=0)) == 20


def test_waves_have_their_amplitude_and_length_and_crests_at_one_height() -> None:
    wave = Wave(
        op="wave",
        amplitude=0.006,
        amplitude_jitter=0,
        wavelength=0.05,
        wavelength_jitter=0,
        onset=0,
        ramp=1e-6,
        phase_spread=0,
        phase_jitter=0,
        sideways=0,
    )
    hair = styled(wave)
    offset = across(hair)
    crest = np.abs(offset[..., 0]).max(axis=1)
    spectrum = np.abs(np.fft.rfft(offset[:, 1:, 0] * np.hanning(POINTS - 1), 8 * POINTS, axis=1))
    found = 8 * POINTS * (0.3 / (POINTS - 1)) / spectrum.argmax(axis=1)
    out_of_step = np.ptp(offset[..., 0], axis=0).max()
    print(
        f"amplitude off by {np.abs(crest - 0.006).max():.1e} m, wavelength {found.min():.4f} to {found.max():.4f} m"
    )
    assert np.abs(crest - 0.006).max() < 2e-5  # a crest may fall between two points
    assert np.abs(found / 0.05 - 1).max() < 0.02
    assert np.abs(offset[..., 1]).max() < 1e-12, "all in one plane"
    assert out_of_step < 1e-12


def test_frizz_has_the_root_mean_square_asked_for() -> None:
    hair = styled(Frizz(op="frizz", amplitude=0.002, over=1e-6), count=3000)
    moved = hair.points - hanging(np.arange(3000)).points
    found = np.sqrt((moved[:, 1:] ** 2).sum(axis=2).mean())
    print(f"2 mm asked for: {1000 * found:.3f} mm over 3,000 strands")
    assert found == pytest.approx(0.002, rel=0.02)


def test_the_wanted_fraction_flies_away_and_nothing_else_moves(mannequin: Head) -> None:
    config = shipped("default", strands=3000)
    op = config.groom.style["flyaways"]
    assert isinstance(op, Flyaway)
    style = Style(config, mannequin)
    ground = Ground(1, 32, style.terrain, mannequin)
    hair = style.stack.strands(np.arange(3000))
    flown = Flyaway(op="flyaway", fraction=0.1)
    moved = np.abs(OPERATORS[Flyaway](hair, flown, ground, Chance(1, "f")).points - hair.points).max(
        axis=(1, 2)
    )
    print(f"{(moved > 0).mean():.3f} of the strands leave, by {1000 * moved.max():.1f} mm at most")
    assert (moved > 0).mean() == pytest.approx(0.1, abs=0.02)
    assert 0.002 < moved.max() < 0.04


def test_hair_without_a_style_stands_off_the_skin(mannequin: Head) -> None:
    hair = Style(shipped("default", strands=50, style={}), mannequin).stack.strands(np.arange(50))
    way = hair.points[:, -1] - hair.points[:, 0]
    assert np.abs(way - 0.56 * hair.normal).max() < 1e-12


def test_combing_keeps_lengths_and_layers_rise(mannequin: Head) -> None:
    combing = Direction(op="direction")
    style = {"cut": Lengths(op="length", length=0.18), "combing": combing}
    hair = Style(shipped("default", strands=400, style=style), mannequin).stack.strands(np.arange(400))
    found = arc_length(hair.points)[:, -1]
    print(f"18 cm before combing, {found.min():.4f} to {found.max():.4f} m after it")
    assert np.abs(hair.length - 0.18).max() < 1e-12
    assert np.abs(found / 0.18 - 1).max() < 0.02  # chords between 32 points


def test_the_order_of_operators_matters() -> None:
    cut, curls = Lengths(op="length", length=0.1), Curl(**CURL, radius=0.005, pitch=0.02)
    first, last = styled(cut=cut, curls=curls), styled(curls=curls, cut=cut)
    lengths = [float(arc_length(hair.points)[:, -1].mean()) for hair in (first, last)]
    print(f"cut to 10 cm before curling: {lengths[0]:.3f} m of hair; after it: {lengths[1]:.3f} m")
    assert lengths[0] > 1.5 * lengths[1]


def test_an_operator_that_is_switched_off_is_as_absent() -> None:
    curls, frizz = Curl(**CURL, radius=0.005, pitch=0.02), Frizz(op="frizz", amplitude=0.001)
    off = styled(curls=curls.model_copy(update={"enabled": False}), frizz=frizz)
    assert np.array_equal(off.points, styled(frizz=frizz).points)
    assert not np.array_equal(off.points, styled(curls=curls, frizz=frizz).points)


def test_a_clump_that_is_switched_off_still_names_its_clumps() -> None:
    tufts, curls = (
        Clump(op="clump", count=20, strength=0),
        Curl(**CURL, radius=0.005, pitch=0.02, per="tufts"),
    )
    off = styled(tufts=tufts.model_copy(update={"enabled": False}), curls=curls)
    assert np.array_equal(off.points, styled(tufts=tufts, curls=curls).points)


def test_an_operator_of_a_head_is_refused_on_a_swatch() -> None:
    with pytest.raises(InputError, match=r"direction.*works on a head"):
        styled(Direction(op="direction"))


def test_every_operator_gives_the_same_bytes_in_any_chunk() -> None:
    tufts = Clump(op="clump", count=15, within=None)
    style: dict[str, Operator] = {
        "tufts": tufts,
        "frizz": Frizz(op="frizz"),
        "cut": Trim(op="trim", height=-0.2, layers=0.03, uneven=0.01, per="tufts", jitter=0.2),
        "wisps": Clump(op="clump", count=60, within="tufts"),
        "curls": Curl(op="curl", per="wisps"),
        "waves": Wave(op="wave"),
        "short": Lengths(op="length", length=0.15, jitter=0.1),
    }
    every = hanging(np.arange(COUNT))
    stack = Stack(style, Ground(SEED, POINTS), hanging, Neighbours(every.root, Partings(Chart.from_above())))
    whole = stack.strands(np.arange(COUNT))
    for some in ([0], [7, 3, 399], list(range(100, 231))):
        part = stack.strands(np.array(some))
        assert np.array_equal(part.points, whole.points[some])
        assert np.array_equal(part.length, whole.length[some])
