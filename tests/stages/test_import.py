"""Import of grooms: equal spacing along a smooth curve, repairs by strand index, any prefix a groom."""

import time
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from pipeline.config import load as load_config
from pipeline.config.schema import Config, Groom, Scene
from pipeline.errors import InputError
from pipeline.groom.axes import upright
from pipeline.groom.head_field import Field
from pipeline.groom.heads import Head, Skin, make_head
from pipeline.groom.imported import evenly_spaced, in_metres, load, progressive_order
from pipeline.groom.repairs import Repairs, cleaned
from pipeline.strands.formats import Ragged, read_groom
from pipeline.strands.formats.hair import write_hair
from pipeline.strands.formats.tfx import write_tfx
from pipeline.strands.resample import resampled

REPOSITORY = Path(__file__).parents[2]
SHARED = REPOSITORY.parent / "shared/data"
HEAD = 0.1  # radius [m]

Points = NDArray[np.float64]


def ragged(lines: list[Points], root: int = 2, tip: int = 0) -> Ragged:
    counts = np.array([len(line) for line in lines], np.int64)
    return Ragged(np.concatenate(lines), counts, np.tile(np.array([root, tip], np.uint8), (len(lines), 1)))


def round_head(spacing: float = 3e-3) -> Head:
    axis = np.arange(-0.15, 0.15 + spacing, spacing)
    x, y, z = np.meshgrid(axis, axis, axis, indexing="ij")
    distance = (np.sqrt(x**2 + y**2 + z**2) - HEAD).astype(np.float32)
    nothing = np.zeros((0, 3), np.float32)
    skin = Skin(nothing, np.zeros((0, 3), np.int32), nothing, nothing)
    return Head(skin, Field(distance, np.full(3, axis[0]), spacing), 1.0, np.zeros(3), lambda p: (p, p))


def spikes(count: int) -> list[Points]:
    """Straight strands of 8 points and 8 cm, from the head outwards."""
    direction = np.random.default_rng(5).normal(size=(count, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    reach = np.linspace(HEAD + 1e-3, HEAD + 0.08, 8)
    return list(direction[:, None] * reach[:, None])


def config(path: Path, **groom: object) -> Config:
    return Config(name="import", scene=Scene(head="none"), groom=Groom(source=str(path), **groom))


def unevenness(points: NDArray[np.floating]) -> NDArray[np.float64]:
    """Worst relative difference of a segment of each strand from its strand's mean."""
    length = np.linalg.norm(np.diff(points.astype(np.float64), axis=1), axis=2)
    return np.abs(length / length.mean(axis=1, keepdims=True) - 1).max(axis=1)


@pytest.mark.parametrize("name", ["straight", "circle", "curl", "kinked", "short"])
@pytest.mark.parametrize("count", [5, 32, 100])
def test_segments_become_equal_and_the_ends_stay(
    name: str, count: int, request: pytest.FixtureRequest
) -> None:
    line: Points = request.getfixturevalue(name)
    even = resampled(line[None], count)
    print(f"{name} as {count} points: segments differ by {unevenness(even).max():.1e}")
    assert unevenness(even).max() < 1e-6
    assert np.abs(even[0, [0, -1]] - line[[0, -1]]).max() < 1e-12


def test_a_straight_strand_of_uneven_spacing_stays_straight() -> None:
    along = np.array([0, 0.001, 0.05, 0.051, 0.11, 0.25])
    even = resampled(along[None, :, None] * np.array([0.6, 0.0, 0.8]), 32)
    wanted = np.linspace(0, 0.25, 32)[:, None] * np.array([0.6, 0.0, 0.8])
    print(f"straight: {np.abs(even[0] - wanted).max():.1e} m off its line")
    assert np.abs(even[0] - wanted).max() < 1e-8


def test_resampling_converges_to_the_smooth_curve_with_fourth_order() -> None:
    """Away from the ends, where a natural spline is straight, its error falls with the spacing to the power of 4."""
    error = []
    counts = [16, 32, 64, 128]
    for count in counts:
        angle = np.linspace(0, 3 * np.pi, count)
        angle += 0.3 * np.sin(2 * angle)  # uneven spacing
        circle = 0.04 * np.stack([np.sin(angle), np.cos(angle), 0 * angle], axis=-1)
        even = resampled(circle[None], 4 * count)[0]
        error.append(np.abs(np.linalg.norm(even[count:-count], axis=1) - 0.04).max())
    order = np.polyfit(np.log(counts), np.log(error), 1)[0]
    print(
        f"distance from a circle of 4 cm: {error[0]:.1e} m at 16 points, {error[-1]:.1e} at 128, order {-order:.2f}"
    )
    assert -order > 3.5


def test_strands_of_any_number_of_points_are_resampled_on_their_own(curl: Points, short: Points) -> None:
    lines = [curl, short, curl[:2], curl[:17], short + 1]
    together, _ = evenly_spaced(ragged(lines), 24)
    for line, found in zip(lines, together, strict=True):
        assert np.array_equal(found, evenly_spaced(ragged([line]), 24)[0][0])


@pytest.mark.parametrize(
    ("pins", "points", "expected"),
    [
        ((0, 0), 32, (0, 0)),
        ((1, 0), 32, (1, 0)),
        ((2, 2), 32, (2, 2)),
        ((4, 0), 32, (14, 0)),  # 3 of 7 segments are 13.3 of 31
        ((8, 0), 32, (32, 0)),
        ((8, 8), 4, (4, 0)),
    ],
)
def test_held_ends_stay_held(
    straight: Points, pins: tuple[int, int], points: int, expected: tuple[int, int]
) -> None:
    assert evenly_spaced(ragged([straight[:8]], *pins), points)[1].tolist() == [list(expected)]


def test_every_repair_is_reported_by_strand_index(tmp_path: Path, curl: Points) -> None:
    lines = [curl + np.array([0.01 * i, 0, 0]) for i in range(9)]
    lines[2][5, 1] = np.nan
    lines[3][:] = lines[3][0]  # no length
    lines[4][10:14] = lines[4][10]  # repeated
    lines[6][0, 0] = np.inf
    lines[7] = lines[7][:1]  # one point
    lines[8][12] = 1e30
    write_hair(tmp_path / "groom.hair", ragged(lines))
    strands, report = load(config(tmp_path / "groom.hair"), None)
    assert report["file_strands"] == 9
    assert report["repairs"]["not_finite"] == [2, 6]
    assert report["repairs"]["no_length"] == [3, 7]
    assert report["repairs"]["too_long"] == [8]
    assert report["repairs"]["merged_points"] == [4]
    assert len(strands) == 4
    assert unevenness(strands.points).max() < 1e-4  # float32


@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    changes=st.dictionaries(
        st.tuples(st.integers(0, 3), st.integers(0, 7), st.integers(0, 2)), st.floats(width=32), max_size=6
    )
)
def test_hostile_points_harm_no_strand_but_their_own(
    tmp_path: Path, changes: dict[tuple[int, int, int], float]
) -> None:
    lines = spikes(5)
    untouched = evenly_spaced(ragged(lines), 32)[0].astype(np.float32)
    for (strand, point, axis), value in changes.items():
        lines[strand][point, axis] = value
    write_hair(tmp_path / "groom.hair", ragged(lines))
    strands, report = load(config(tmp_path / "groom.hair"), None)
    dropped = (report["repairs"][name] for name in ("not_finite", "no_length", "too_long"))
    assert len(strands) == 5 - sum(map(len, dropped))
    for strand in set(range(5)) - {strand for strand, _, _ in changes}:
        assert np.abs(strands.points - untouched[strand]).max(axis=(1, 2)).min() < 1e-6


@pytest.mark.parametrize("unit_scale", [1e-6, 1e3])
def test_a_file_without_a_length_of_hair_is_refused(tmp_path: Path, curl: Points, unit_scale: float) -> None:
    write_hair(tmp_path / "groom.hair", ragged([curl, curl + 1]))
    with pytest.raises(InputError, match=r"none of its 2 strands has a length .*check groom.unit_scale"):
        load(config(tmp_path / "groom.hair", unit_scale=unit_scale), None)


def test_a_truncated_file_is_refused(tmp_path: Path, curl: Points) -> None:
    path = tmp_path / "groom.tfx"
    write_tfx(path, ragged([curl, curl + 1]))
    path.write_bytes(path.read_bytes()[:-10])
    with pytest.raises(InputError, match="truncated"):
        load(config(path), None)


@pytest.mark.parametrize(("axis", "up"), [("x", 0), ("y", 1), ("z", 2)])
def test_turning_upright_is_a_rotation_that_points_up_to_y(axis: str, up: int) -> None:
    turned = upright(np.eye(3), axis)
    assert np.array_equal(turned[up], [0, 1, 0])
    assert np.linalg.det(turned) == pytest.approx(1)


def test_swapped_strands_are_turned_round(tmp_path: Path) -> None:
    lines = spikes(50)
    for i in (3, 17):
        lines[i] = lines[i][::-1]
    write_hair(tmp_path / "groom.hair", ragged(lines))
    strands, report = load(config(tmp_path / "groom.hair"), round_head())
    assert report["repairs"]["turned_round"] == [3, 17]
    height = np.linalg.norm(strands.points, axis=2) - HEAD
    assert height[:, 0].max() < 2e-3
    assert height[:, -1].min() > 0.07


def test_strands_inside_the_head_are_pushed_out_and_the_others_are_not_touched(tmp_path: Path) -> None:
    lines = spikes(40)
    chord = np.linspace(lines[8][0], -0.6 * lines[8][-1], 16)  # right through the head
    lines[8] = chord
    write_hair(tmp_path / "groom.hair", ragged(lines))
    strands, report = load(config(tmp_path / "groom.hair"), round_head())
    assert report["repairs"]["pushed_out"] == [8]
    depth = HEAD - np.linalg.norm(strands.points[:, 2:], axis=2)
    print(f"deepest point after import {1e3 * depth.max():.3f} mm")
    assert depth.max() < 0
    assert unevenness(strands.points).max() < 1e-4


def test_a_groom_in_the_wrong_unit_does_not_land_on_the_head(tmp_path: Path) -> None:
    write_hair(tmp_path / "groom.hair", ragged(spikes(20)))
    with pytest.raises(InputError, match=r"its roots lie .* m from the head .*groom.unit_scale"):
        load(config(tmp_path / "groom.hair", unit_scale=100), round_head())


def test_any_prefix_of_the_order_is_evenly_spread() -> None:
    """The largest hole that a prefix leaves, against that of the file's own order and of a random one."""
    rng = np.random.default_rng(1)
    roots = np.concatenate([rng.uniform(size=(4000, 3)), rng.uniform(size=(6000, 3)) * 0.2]) * [0.2, 0.2, 0]
    order = progressive_order(roots, seed=1)
    assert np.array_equal(np.sort(order), np.arange(len(roots)))
    for count in (100, 400, 1600):
        hole, chance = (
            cKDTree(roots[chosen]).query(roots)[0].max()
            for chosen in (order[:count], rng.permutation(len(roots))[:count])
        )
        print(f"prefix of {count}: largest hole {1e3 * hole:.1f} mm; of a random order {1e3 * chance:.1f} mm")
        assert hole < 0.8 * chance


def test_roots_in_one_place_have_an_order_too() -> None:
    order = progressive_order(np.ones((20_000, 3)), seed=1)
    assert np.array_equal(np.sort(order), np.arange(20_000))


def test_fewer_strands_are_a_prefix(tmp_path: Path) -> None:
    write_hair(tmp_path / "groom.hair", ragged(spikes(300)))
    many, few = (load(config(tmp_path / "groom.hair", strands=n), None)[0] for n in (300, 40))
    assert np.array_equal(few.points, many.points[:40])
    assert np.array_equal(few.key, many.key[:40])


def test_a_real_groom_lands_on_its_head() -> None:
    if not (SHARED / "sintel/sintel_16points.tfx").exists():
        pytest.skip("the shared Sintel groom is not on this machine")
    sintel = load_config(REPOSITORY / "configs/sintel.toml").config
    head = make_head(sintel)
    assert head is not None
    start = time.process_time()
    strands, report = load(sintel, head)
    seconds = time.process_time() - start
    height = head.field.distance(strands.points.reshape(-1, 3)).reshape(len(strands), -1)
    print(
        f"11,400 x 16 as 32 points in {seconds:.2f} s of processor time; {len(report['repairs']['pushed_out'])} "
        f"pushed out; lowest point {1e3 * height[:, 2:].min():.2f} mm, roots {1e3 * height[:, 0].min():.2f} to "
        f"{1e3 * height[:, 0].max():.2f} mm off the skin; segments differ by {unevenness(strands.points).max():.1e}"
    )
    assert strands.points.shape == (11_400, 32, 3)
    assert np.abs(np.median(strands.length) - 0.1015) < 5e-4  # its length in the file
    assert height[:, 2:].min() > 0
    assert np.abs(height[:, 0]).max() < 0.01
    assert unevenness(strands.points).max() < 3e-4  # float32 at a height of 1.6 m
    assert seconds < 3


def test_a_real_groom_is_read_in_a_tenth_of_a_second() -> None:
    path = SHARED / "sintel/sintel_16points.tfx"
    if not path.exists():
        pytest.skip("the shared Sintel groom is not on this machine")
    spent = []
    for _ in range(5):
        start = time.process_time()
        kept, index = cleaned(in_metres(read_groom(path), None, None), Repairs())
        points, _ = evenly_spaced(kept, 32)
        order = progressive_order(points[:, 0], 1)
        spent.append(time.process_time() - start)
    print(
        f"11,400 x 16 read, cleaned, evenly spaced and put in order in {1e3 * min(spent):.0f} ms of processor time"
    )
    assert len(index) == len(order) == len(points) == 11_400
    assert min(spent) < 0.1


def test_a_real_groom_without_a_head_loses_its_degenerate_strands() -> None:
    path = SHARED / "ratboy/ratboy_mohawk.tfx"
    if not path.exists():
        pytest.skip("the shared Ratboy groom is not on this machine")
    strands, report = load(config(path), None)
    print(f"{len(strands)} of 2,228 strands; without length: {report['repairs']['no_length']}")
    assert len(strands) + len(report["repairs"]["no_length"]) == 2_228
    assert len(report["repairs"]["no_length"]) < 20
    assert (strands.held[:, :3] == [1, 1, 0]).all()
    assert not strands.held[:, 2:].any()
