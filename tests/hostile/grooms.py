"""Readers of groom files, and files that they can read."""

import struct
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipeline.strands.formats import Ragged, read_groom
from pipeline.strands.formats.files import LIBRARIES, READERS, read_here
from pipeline.strands.formats.hair import write_hair
from pipeline.strands.formats.lines import Lines
from pipeline.strands.formats.tfx import write_tfx
from pipeline.strands.formats.usc_data import write_data
from pipeline.strands.formats.vtk_lines import write_vtp
from tests.hostile.engine import Target

SHARE = {".hair": 24, ".tfx": 24, ".data": 22, ".vtp": 12, ".usda": 8, ".usdc": 4, ".abc": 4, ".vtkhdf": 2}


def targets(folder: Path, endings: Sequence[str] = tuple(SHARE)) -> list[Target]:
    """The readers of these endings; without a library there are none of its kind."""
    rng = np.random.default_rng(0)
    pins = np.tile(np.array([2, 0], np.uint8), (6, 1))
    ragged = Ragged(rng.normal(size=(38, 3)), np.array([8, 4, 2, 9, 5, 10]), pins)
    even = Ragged(rng.normal(size=(48, 3)), np.full(6, 8), pins)
    wide = Ragged(even.points, even.counts, pins, np.full(48, 1e-4, np.float32))
    lines = Lines(6, 8, np.full(8, 1e-4, np.float32), 24, "seed")
    moment = even.points.reshape(6, 8, 3).astype(np.float32)
    write_hair(folder / "a.hair", ragged)
    write_hair(folder / "b.hair", wide)
    write_tfx(folder / "a.tfx", even)
    write_data(folder / "a.data", ragged)
    write_vtp(folder / "a.vtp", lines, [moment])
    header = struct.pack("<f3Ii", 3.0, 6, 8, 0, 1).ljust(144, b"\0") + struct.pack("<I", 296)
    (folder / "b.tfx").write_bytes(header.ljust(296, b"\0") + moment.tobytes())
    if not set(endings) <= READERS.keys():
        _library_seeds(folder, lines, moment)
    found: dict[str, list[bytes]] = {}
    for path in sorted(folder.iterdir()):
        if path.suffix in endings:
            found.setdefault(path.suffix, []).append(path.read_bytes())
            assert len(READERS.get(path.suffix, read_here)(path)) > 0
        path.unlink()
    return [_target(ending, whole) for ending, whole in found.items()]


def _target(ending: str, whole: list[bytes]) -> Target:
    if ending in READERS:
        return Target(ending, ending, whole, READERS[ending], _fits)
    return Target(ending, ending, whole, LIBRARIES[ending], _fits, read_groom)


def _fits(strands: object) -> bool:
    assert isinstance(strands, Ragged)
    return int(strands.counts.sum()) == len(strands.points) and bool((strands.counts >= 0).all())


def _library_seeds(folder: Path, lines: Lines, moment: NDArray[np.float32]) -> None:
    from vtkmodules.vtkIOXML import vtkXMLPolyDataReader, vtkXMLPolyDataWriter

    reader = vtkXMLPolyDataReader()
    reader.SetFileName(str(folder / "a.vtp"))
    for mode in ("Ascii", "Binary"):
        writer = vtkXMLPolyDataWriter()
        writer.SetInputConnection(reader.GetOutputPort())
        writer.SetFileName(str(folder / f"{mode}.vtp"))
        getattr(writer, f"SetDataModeTo{mode}")()
        writer.Write()
    from pipeline.cache import create_guides

    with create_guides(folder / "a.vtkhdf", "key", guides=6, points=8, fps=24) as guides:
        guides.append(moment, np.eye(4))
    try:
        from pxr import Usd

        from pipeline.strands.formats.usd import UsdWriter

        usd = UsdWriter(folder / "a.usdc", lines)
        usd.append(1, [moment])
        usd.close()
        Usd.Stage.Open(str(folder / "a.usdc")).Export(str(folder / "a.usda"))
    except ModuleNotFoundError as error:
        print(f"without {error.name}", file=sys.stderr)
    try:
        from pipeline.strands.formats.alembic import AlembicWriter

        abc = AlembicWriter(folder / "a.abc", lines, 1)
        abc.append(1, [moment])
        abc.close()
    except ModuleNotFoundError as error:
        print(f"without {error.name}", file=sys.stderr)
