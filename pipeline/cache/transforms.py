"""Files of rigid transforms, a row-major 4x4 matrix a sample, as other programs export the motion of a head.

CSV: on each line 16 numbers, or 12 without the last row (0, 0, 0, 1), with a column before them that holds frames
(counted from 1, as the pictures) or times [s]. A header that begins with "frame" or "time" tells which; without one,
whole numbers are frames, and lines without that column follow one another frame by frame.
HDF5: a dataset "transforms" (F, 4, 4), and "time" (F,) [s] unless samples follow one another frame by frame.
"""

from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
from numpy.typing import ArrayLike, NDArray

from pipeline.errors import InputError
from pipeline.strands.formats.table import Table, read_table

Floats = NDArray[np.float64]
Where = Callable[[int], str]

_HDF5 = (".h5", ".hdf5")
_ORTHONORMAL = 1e-3  # that rows of a rotation may be off
_LAST_ROW = 1e-6


def read_transforms(path: Path, fps: float, unit_scale: float = 1.0) -> tuple[Floats, Floats]:
    """Times (K,) [s], ascending, and rigid maps (K, 4, 4) with translations in metres.

    Frame 1 is time 0. `unit_scale` is metres per unit of the file. Rotations that are orthonormal to 1e-3 are replaced
    by the nearest that is so exactly. Raises InputError, with file and line, for a file that cannot be read, a number
    that is not finite, a matrix that is not rigid, and times that do not ascend.
    """
    if not path.is_file():
        raise InputError(f"{path}: no such file of transforms; give a .csv or .h5 file")
    read = _read_hdf5 if path.suffix.lower() in _HDF5 else _read_csv
    times, matrices, where = read(path, fps)
    if not len(matrices):
        raise InputError(f"{path}: no transforms; a line of 12 or 16 numbers is needed for each frame")
    poses = _rigid(matrices, where)
    poses[:, :3, 3] *= unit_scale
    _refuse(~np.isfinite(times), where, "the time is not finite; export it again")
    late = np.flatnonzero(~(np.diff(times) > 0))
    if len(late):
        raise InputError(f"{where(int(late[0]) + 1)}: not later than the sample before it; sort by time")
    return times, poses


def _rigid(matrices: Floats, where: Where) -> Floats:
    """The matrices with the nearest rotations in place of those nearly so."""
    _refuse(~np.isfinite(matrices).all(axis=(1, 2)), where, "a number is not finite; export it again")
    wrong = np.abs(matrices[:, 3] - [0, 0, 0, 1]).max(axis=1) > _LAST_ROW
    _refuse(
        wrong, where, "the last row is not 0 0 0 1; write matrices row by row, translation in the last column"
    )
    rotation = matrices[:, :3, :3]
    off = np.abs(rotation @ rotation.swapaxes(1, 2) - np.eye(3)).max(axis=(1, 2)) > _ORTHONORMAL
    _refuse(off, where, "the rotation is not orthonormal to 1e-3; remove scale and shear before exporting")
    u, _, vt = np.linalg.svd(rotation)
    nearest = np.asarray(u @ vt)
    _refuse(
        np.linalg.det(nearest) < 0, where, "the matrix mirrors; remove the negative scale before exporting"
    )
    poses = matrices.copy()
    poses[:, :3, :3], poses[:, 3] = nearest, (0, 0, 0, 1)
    return poses


def _refuse(bad: ArrayLike, where: Where, what: str) -> None:
    if np.any(bad):
        raise InputError(f"{where(int(np.argmax(bad)))}: {what}")


def _read_csv(path: Path, fps: float) -> tuple[Floats, Floats, Where]:
    table = read_table(path, (16, 12, 13, 17), "a line has 12 or 16, or one more for frame or time")
    return *_columns(table, fps), table.where


def _columns(table: Table, fps: float) -> tuple[Floats, Floats]:
    values, header = table.values, table.header[0] if table.header else ""
    count = len(values)
    matrices = np.tile(np.eye(4), (count, 1, 1))
    entries = values.shape[1] // 4 * 4
    matrices.reshape(count, 16)[:, :entries] = values[:, values.shape[1] - entries :]
    if values.shape[1] == entries:
        return np.arange(count) / fps, matrices
    first = values[:, 0]
    if header not in ("", "frame", "time"):
        raise InputError(f'{table.path}: the first column is called {header}; expected "frame" or "time"')
    if header == "frame" or (header == "" and (first == np.round(first)).all()):
        return (first - 1) / fps, matrices
    return first, matrices


def _read_hdf5(path: Path, fps: float) -> tuple[Floats, Floats, Where]:
    try:
        with h5py.File(path, "r", locking=False) as file:
            matrices = np.asarray(file["transforms"], np.float64)
            times = np.asarray(file["time"], np.float64) if "time" in file else np.arange(len(matrices)) / fps
    except (OSError, LookupError, RuntimeError, ValueError, TypeError, MemoryError) as error:
        raise InputError(f'{path}: no dataset "transforms" of numbers can be read ({error})') from None
    if matrices.ndim != 3 or matrices.shape[1:] != (4, 4) or times.shape != matrices.shape[:1]:
        raise InputError(
            f'{path}: "transforms" has shape {matrices.shape} and "time" {times.shape}; expected (F, 4, 4) and (F,)'
        )
    return times, matrices, lambda row: f"{path}: transforms[{row}]"
