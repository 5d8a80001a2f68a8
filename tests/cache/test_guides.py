from pathlib import Path

import numpy as np
import pytest

from pipeline import cache

FRAMES, GUIDES, POINTS = 5, 7, 9


@pytest.fixture
def frames() -> np.ndarray:
    return np.random.default_rng(1).normal(size=(FRAMES, GUIDES, POINTS, 3)).astype(np.float32)


def write(path: Path, frames: np.ndarray, fps: float = 24.0) -> None:
    with cache.create_guides(path, "key", {}, guides=GUIDES, points=POINTS, fps=fps) as writer:
        for index, points in enumerate(frames):
            writer.append(points, np.eye(4) * (index + 1), {"kinetic": index / 2})


def test_frames_come_back_in_any_order(tmp_path: Path, frames: np.ndarray) -> None:
    write(tmp_path / "guides.h5", frames)
    with cache.open_guides(tmp_path / "guides.h5") as guides:
        assert (guides.frames, guides.guides, guides.points, guides.fps) == (FRAMES, GUIDES, POINTS, 24.0)
        assert guides.key == "key"
        for index in (3, 0, 4, -1):
            np.testing.assert_array_equal(guides.frame(index), frames[index])
        np.testing.assert_array_equal(guides.pose(2), np.eye(4) * 3)
        np.testing.assert_array_equal(guides.diagnostics["kinetic"], np.arange(FRAMES) / 2)
        with pytest.raises(IndexError):
            guides.frame(FRAMES)


def test_vtk_reads_an_animation(tmp_path: Path, frames: np.ndarray) -> None:
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOHDF import vtkHDFReader

    write(tmp_path / "guides.h5", frames, fps=10.0)
    reader = vtkHDFReader()
    reader.SetFileName(str(tmp_path / "guides.h5"))
    reader.UpdateInformation()
    assert reader.GetNumberOfSteps() == FRAMES
    for step in (4, 0, 2):
        reader.SetStep(step)
        reader.Update()
        mesh = reader.GetOutput()
        points = vtk_to_numpy(mesh.GetPoints().GetData()).reshape(GUIDES, POINTS, 3)
        np.testing.assert_array_equal(points, frames[step])
        assert reader.GetTimeValue() == pytest.approx(step / 10)
        assert mesh.GetNumberOfLines() == mesh.GetNumberOfCells() == GUIDES
        cell = mesh.GetCell(GUIDES - 1)
        assert [cell.GetPointId(i) for i in range(POINTS)] == list(
            range((GUIDES - 1) * POINTS, GUIDES * POINTS)
        )


def test_topology_is_stored_once(tmp_path: Path, frames: np.ndarray) -> None:
    write(tmp_path / "guides.h5", frames)
    with cache.open(tmp_path / "guides.h5") as reader:
        assert reader["VTKHDF/Lines/Connectivity"].shape == (GUIDES * POINTS,)


def test_a_damaged_frame_leaves_its_neighbours(tmp_path: Path, frames: np.ndarray) -> None:
    path = tmp_path / "guides.h5"
    write(path, frames)
    import h5py

    with h5py.File(path) as file:
        stored = file["VTKHDF/Points"].id.get_chunk_info(2)
    data = bytearray(path.read_bytes())
    data[stored.byte_offset + stored.size // 2] ^= 1
    path.write_bytes(data)
    with cache.open_guides(path) as guides:
        np.testing.assert_array_equal(guides.frame(1), frames[1])
        np.testing.assert_array_equal(guides.frame(3), frames[3])
        with pytest.raises(cache.Damaged, match="VTKHDF/Points"):
            guides.frame(2)


def test_wrong_frames_are_refused(tmp_path: Path, frames: np.ndarray) -> None:
    with (
        pytest.raises(ValueError, match=r"expected a frame of shape \(7, 9, 3\)"),
        cache.create_guides(tmp_path / "g.h5", "", guides=GUIDES, points=POINTS, fps=24) as writer,
    ):
        writer.append(frames[0, 1:], np.eye(4))
    with (
        pytest.raises(ValueError, match="expected the diagnostics kinetic"),
        cache.create_guides(tmp_path / "g.h5", "", guides=GUIDES, points=POINTS, fps=24) as writer,
    ):
        writer.append(frames[0], np.eye(4), {"kinetic": 1.0})
        writer.append(frames[1], np.eye(4), {})
