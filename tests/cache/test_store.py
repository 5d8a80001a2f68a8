import json
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as nps

from pipeline import cache
from pipeline.errors import InputError


def write_groom(path: Path, strands: int = 500) -> np.ndarray:
    points = np.random.default_rng(3).normal(size=(strands, 16, 3)).astype(np.float32)
    with cache.create(path, kind="groom", key="k1", provenance={"seed": 3}) as writer:
        writer.write("strands/points", points, chunk_rows=64)
        writer.write("strands/tip", np.arange(strands, dtype=np.int8) % 2)
        writer.meta["report"] = {"repaired": [1, 5]}
    return points


def read_all(path: Path) -> dict[str, np.ndarray]:
    with cache.open(path, kind="groom") as reader:
        return {name: reader[name][:] for name in reader.names}


def test_what_was_written_is_read(tmp_path: Path) -> None:
    points = write_groom(tmp_path / "groom.h5")
    with cache.open(tmp_path / "groom.h5", kind="groom") as reader:
        assert reader.key == "k1"
        assert reader.meta["report"] == {"repaired": [1, 5]}
        assert reader.provenance["seed"] == 3
        assert {"host", "libraries", "written", "wall_time_s"} <= reader.provenance.keys()
        column = reader["strands/points"]
        for rows in (slice(None), slice(60, 70), slice(10, 10), slice(-3, None), slice(None, None, 7)):
            np.testing.assert_array_equal(column[rows], points[rows])
        np.testing.assert_array_equal(column[-1], points[-1])
        np.testing.assert_array_equal(column[np.array([3, 499, 0])], points[[3, 499, 0]])
        np.testing.assert_array_equal(np.asarray(column), points)


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    array=nps.arrays(
        st.sampled_from([np.float32, np.float64, np.int8, np.uint32, np.int64]),
        nps.array_shapes(min_dims=1, max_dims=3, min_side=1, max_side=9),
    ),
    chunk=st.one_of(st.none(), st.integers(1, 12)),
    cut=st.integers(0, 9),
)
def test_any_array_in_any_pieces_comes_back(
    tmp_path: Path, array: np.ndarray, chunk: int | None, cut: int
) -> None:
    with cache.create(tmp_path / "any.h5", kind="any", key="") as writer:
        column = writer.stream("a", array.shape[1:], array.dtype, chunk)
        column.append(array[:cut])
        column.append(array[cut:])
    with cache.open(tmp_path / "any.h5") as reader:
        np.testing.assert_array_equal(reader["a"][:], array)
        assert reader["a"].dtype == array.dtype


def test_other_hdf5_readers_understand_the_columns(tmp_path: Path) -> None:
    import h5py

    points = write_groom(tmp_path / "groom.h5")
    with h5py.File(tmp_path / "groom.h5") as file:
        np.testing.assert_array_equal(file["strands/points"][:], points)
        assert json.loads(file["provenance/record"][()])["seed"] == 3


def test_empty_columns_are_columns(tmp_path: Path) -> None:
    with cache.create(tmp_path / "e.h5", kind="any", key="") as writer:
        writer.write("none", np.zeros((0, 3), np.float32))
    with cache.open(tmp_path / "e.h5") as reader:
        reader.verify()
        assert reader["none"][:].shape == (0, 3)


def test_two_runs_differ_in_the_record_only(tmp_path: Path) -> None:
    for name in ("a.h5", "b.h5"):
        write_groom(tmp_path / name)
    a, b = read_all(tmp_path / "a.h5"), read_all(tmp_path / "b.h5")
    assert a.keys() == b.keys()
    for name in a:
        np.testing.assert_array_equal(a[name], b[name])


@pytest.fixture(scope="module")
def sealed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("sealed") / "groom.h5"
    write_groom(path)
    return path


@settings(max_examples=400, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(where=st.floats(0, 1, exclude_max=True), bit=st.integers(0, 7))
def test_a_wrong_bit_anywhere_is_found(sealed: Path, tmp_path: Path, where: float, bit: int) -> None:
    """Within a second, too: HDF5 itself goes round in circles over some bits of its bookkeeping."""
    broken = bytearray(sealed.read_bytes())
    broken[int(where * len(broken))] ^= 1 << bit
    path = tmp_path / "groom.h5"
    path.write_bytes(broken)
    with pytest.raises(cache.Damaged, match=re.escape(str(path))):
        read_all(path)


@settings(max_examples=100, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(where=st.floats(0, 1, exclude_max=True), more=st.binary(max_size=40))
def test_a_file_cut_anywhere_or_with_more_at_its_end_is_damaged(
    sealed: Path, tmp_path: Path, where: float, more: bytes
) -> None:
    whole = sealed.read_bytes()
    path = tmp_path / "groom.h5"
    for broken in (whole[: int(where * len(whole))], whole + more + b"."):
        path.write_bytes(broken)
        with pytest.raises(cache.Damaged, match="damaged"), cache.open(path):
            pass


def test_the_seal_leaves_the_data_to_its_checksums(tmp_path: Path) -> None:
    """What has to be read to open a file does not grow with its data; their wrong bits are found all the same."""
    path = tmp_path / "large.h5"
    with cache.create(path, kind="any", key="") as writer:
        writer.write("a", np.random.default_rng(0).normal(size=(1_000_000, 3)).astype(np.float32))
    broken = bytearray(path.read_bytes())
    broken[len(broken) // 2] ^= 4
    path.write_bytes(broken)
    with cache.open(path) as reader, pytest.raises(cache.Damaged, match="dataset /a"):
        reader.verify()


def test_a_flipped_bit_in_the_data_names_file_and_dataset(tmp_path: Path) -> None:
    path = tmp_path / "groom.h5"
    points = write_groom(path)
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)
    with pytest.raises(cache.Damaged, match=r"groom\.h5: .*strands/points"), cache.open(path) as reader:
        reader.verify()
    with cache.open(path) as reader:
        np.testing.assert_array_equal(reader["strands/points"][:64], points[:64])


def test_a_foreign_hdf5_file_is_refused(tmp_path: Path) -> None:
    import h5py

    with h5py.File(tmp_path / "x.h5", "w") as file:
        file["a"] = [1, 2]
    with pytest.raises(cache.Damaged, match="not a file of the cache"), cache.open(tmp_path / "x.h5"):
        pass


def test_missing_file_and_wrong_kind_are_told(tmp_path: Path) -> None:
    write_groom(tmp_path / "groom.h5")
    with pytest.raises(cache.Missing, match="ringlet run"), cache.open(tmp_path / "none.h5"):
        pass
    with (
        pytest.raises(InputError, match="kind groom; expected strands"),
        cache.open(tmp_path / "groom.h5", kind="strands"),
    ):
        pass
    with cache.open(tmp_path / "groom.h5") as reader, pytest.raises(KeyError, match="it has strands/points"):
        reader["strands/pointz"]


def test_wrong_rows_are_refused(tmp_path: Path) -> None:
    with (
        pytest.raises(ValueError, match=r"strands/points: expected rows of shape \(4, 3\)"),
        cache.create(tmp_path / "g.h5", kind="groom", key="") as writer,
    ):
        writer.stream("strands/points", (4, 3), np.float32).append(np.zeros((2, 5, 3), np.float32))
    with (
        pytest.raises(TypeError, match="same_kind"),
        cache.create(tmp_path / "g.h5", kind="groom", key="") as writer,
    ):
        writer.stream("n", (), np.uint32).append(np.array([0.5]))
    assert list(tmp_path.iterdir()) == []
