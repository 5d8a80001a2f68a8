"""All other readers, and files that they can read: configs, formulas, tables, meshes, pictures, caches."""

import io
import struct
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from unittest.mock import patch

import h5py
import numpy as np
from isal import isal_zlib
from numpy.typing import NDArray
from PIL import Image

from pipeline import cache
from pipeline.cache.transforms import read_transforms
from pipeline.compare.pictures import load_picture
from pipeline.config import load
from pipeline.config.formula import parse
from pipeline.errors import InputError
from pipeline.groom import head_mesh
from pipeline.groom.image import brightness
from pipeline.groom.mesh_file import MeshFile
from pipeline.groom.mesh_file import _read as read_mesh
from pipeline.strands.formats.table import read_table
from pipeline.strands.held import read_held
from tests.hostile.damage import Rng, damaged
from tests.hostile.engine import Target

ROOT = Path(__file__).parents[2]
CONFIGS = [path for path in sorted(ROOT.glob("configs/*.toml")) if "extends" not in path.read_text()]
TEXTS = [
    "[groom.style.a]\nop = 'clump'\ncount = 3\nwithin = 'b'\n",
    "extends = 'x.toml'\n",
    "[sweep]\nseed = [1, 2]\n",
    "name = '../up'\n",
    "[render]\nsize = [99999999, 99999999]\n",
    "[simulate]\nframes = 1e308\n",
    "a" + ".a" * 3000 + " = 1\n",
    "x = " + "[" * 3000 + "]" * 3000 + "\n",
    "x = " + "{a = " * 1500 + "1" + "}" * 1500 + "\n",
    "seed = " + "9" * 5000 + "\n",
    "[groom.style.a]\nop = 'length'\nlength = { formula = '" + "(" * 140 + "1" + ")" * 140 + "' }\n",
    "[groom.style.a]\nop = 'length'\nlength = { formula = '9**9**9**9**9' }\n",
    "[groom.style.a]\nop = 'length'\nlength = { formula = '" + "-" * 290 + "1' }\n",
]
PIECES = ["(", ")", "**", "9", "1e308", "x", "height", "noise(", "smoothstep(0,1,", ",", "-", "+", "/", " ", "'", '"', "[",
          "]", "lambda:", "__import__", ".", "@", ":=", "for", "if", "\\", "\n", "\0", "é", "not ", "min(", "f'", "*"]  # fmt: skip


def targets(folder: Path) -> list[Target]:
    """Every reader but those of groom files."""
    rows = [np.eye(4).ravel() + 0.001 * k for k in range(6)]
    table = "frame," + ",".join(f"m{k}" for k in range(16)) + "\n"
    table += "".join(f"{k + 1}," + ",".join(map(repr, row.tolist())) + "\n" for k, row in enumerate(rows))
    pins, ends = np.zeros((6, 8), np.uint8), np.tile([2, 0], (6, 1))
    return [
        Target("config", ".toml", [path.read_bytes() for path in CONFIGS], load, damage=_config),
        Target("formula", ".txt", [b"0.02 + 0.05 * smoothstep(0, 1, height) ** 2"], _formula, damage=_pieces),
        Target("transforms", ".csv", [table.encode()], lambda path: read_transforms(path, 24)),
        Target("transforms-h5", ".h5", [_transforms(folder)], lambda path: read_transforms(path, 24)),
        Target("pins", ".csv", [_text(pins), _text(ends)], lambda path: read_held(path, 6, 8)),
        Target("pins-npy", ".npy", [_npy(pins), _npy(ends)], lambda path: read_held(path, 6, 8)),
        Target(
            "parting", ".csv", [b"u,v\n0,0.8\n0.1;0.5\n# no\n0 0.1\n"], lambda p: read_table(p, (2, 3), "two")
        ),
        *_meshes(folder),
        *_pictures(),
        Target("cache", ".h5", _caches(folder), _cache),
        Target("cache-sealed", ".h5", _caches(folder), _cache, damage=_sealed),
    ]


def _config(data: bytes, rng: Rng) -> bytes:
    """Some lines of configs and of harm, and damages on top."""
    lines = data.decode().splitlines(keepends=True)
    if rng.random() < 0.8:  # a long config takes long, and hides most of what is wrong behind the first
        at = int(rng.integers(len(lines)))
        lines = lines[at : at + int(rng.integers(1, 30))]
    for _ in range(rng.integers(0, 4)):
        at = int(rng.integers(len(lines)))
        kind = rng.random()
        if kind < 0.3:
            lines.insert(at, TEXTS[rng.integers(len(TEXTS))])
        elif kind < 0.6:
            lines.insert(at, lines[rng.integers(len(lines))])
        else:
            del lines[at : at + int(rng.integers(1, 4))]
        lines = lines or ["\n"]
    text = "".join(lines).encode()
    return damaged(text, rng) if rng.random() < 0.7 else text


def _pieces(_data: bytes, rng: Rng) -> bytes:
    """Words of formulas and of Python in any order."""
    count = int(rng.integers(1, 60)) if rng.random() < 0.9 else 290
    few = rng.permutation(len(PIECES))[: rng.integers(1, 8)]
    return "".join(PIECES[few[rng.integers(len(few))]] for _ in range(count)).encode()


def _formula(path: Path) -> object:
    """As a config's loader does it: what is wrong is told with the place."""
    try:
        return parse(path.read_bytes().decode())
    except ValueError as error:
        raise InputError(f"{path}: {error}") from None


def _text(rows: NDArray[np.integer]) -> bytes:
    return "".join(",".join(map(str, row)) + "\n" for row in rows.tolist()).encode()


def _npy(array: NDArray[np.integer]) -> bytes:
    to = io.BytesIO()
    np.save(to, array)
    return to.getvalue()


def _transforms(folder: Path) -> bytes:
    path = folder / "transforms.h5"
    with h5py.File(path, "w") as file:
        file["transforms"] = np.tile(np.eye(4), (6, 1, 1))
        file.create_dataset("time", data=np.arange(6) / 24, chunks=(2,), compression="gzip")
    return path.read_bytes()


def _meshes(folder: Path) -> list[Target]:
    import scipy.sparse.csgraph  # noqa: F401, here, because it makes room for itself, whatever the file
    from vtkmodules.vtkFiltersSources import vtkSphereSource
    from vtkmodules.vtkIOGeometry import vtkOBJWriter, vtkSTLWriter
    from vtkmodules.vtkIOPLY import vtkPLYWriter
    from vtkmodules.vtkIOXML import vtkXMLPolyDataWriter

    ball = vtkSphereSource()
    ball.SetRadius(0.1)
    found = []
    for ending, kind in (
        (".obj", vtkOBJWriter),
        (".ply", vtkPLYWriter),
        (".stl", vtkSTLWriter),
        (".vtp", vtkXMLPolyDataWriter),
    ):
        writer = kind()
        writer.SetInputConnection(ball.GetOutputPort())
        writer.SetFileName(str(folder / f"ball{ending}"))
        writer.Write()
        whole = [(folder / f"ball{ending}").read_bytes()]
        found.append(Target(f"mesh{ending}", ending, whole, _mesh, contained=head_mesh.load_mesh))
    off = b"OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n"
    return [*found, Target("mesh.off", ".off", [off], _mesh, contained=head_mesh.load_mesh)]


def _mesh(path: Path) -> object:
    """Read and checked in this process, where production reads apart."""
    with patch.object(head_mesh, "read_apart", _read_here):
        return head_mesh.load_mesh(path)


def _read_here(paths: Sequence[Path], painted: bool = False) -> Iterator[MeshFile]:
    """Whatever is raised here is one message there."""
    for path in paths:
        try:
            yield read_mesh(path, painted)
        except MemoryError:
            raise
        except (Exception, SystemExit) as error:  # noqa: BLE001, whatever libraries raise
            raise InputError(f"{path}: {error}") from None


def _pictures() -> list[Target]:
    rng = np.random.default_rng(0)
    grey = Image.fromarray(rng.integers(0, 255, (24, 20), np.uint8))
    clear = Image.fromarray(rng.integers(0, 255, (24, 20, 4), np.uint8))
    deep = Image.fromarray(rng.integers(0, 65535, (24, 20)).astype(np.uint16))

    def saved(image: Image.Image, kind: str) -> bytes:
        to = io.BytesIO()
        image.save(to, kind)
        return to.getvalue()

    png = [saved(image, "PNG") for image in (grey, clear, deep)]
    other = [saved(grey, kind) for kind in ("JPEG", "TIFF", "BMP", "GIF", "WEBP", "TGA", "PPM")]
    return [
        Target("painted", ".png", png, _painted),
        Target("painted-other", ".img", other, _painted),
        Target("picture", ".png", png, load_picture),
        *_deep(rng),
    ]


def _deep(rng: Rng) -> list[Target]:
    """The reader of OpenEXR files, where its library is there."""
    try:
        import OpenEXR
    except ModuleNotFoundError as error:
        print(f"without {error.name}", file=sys.stderr)
        return []
    whole = []
    for kind in (np.float16, np.float32):
        with tempfile.TemporaryDirectory() as name:
            path = Path(name) / "a.exr"
            header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
            channels = {channel: rng.random((24, 20)).astype(kind) for channel in "RGB"}
            OpenEXR.File(header, channels).write(str(path))
            whole.append(path.read_bytes())
    return [Target("exr", ".exr", whole, load_picture)]


def _painted(path: Path) -> object:
    brightness.cache_clear()
    return brightness(str(path))


def _caches(folder: Path) -> list[bytes]:
    found = []
    for rows in (3, 70_000):
        path = folder / f"cache{rows}.h5"
        with cache.create(path, "groom", "key") as writer:
            writer.write("strands/points", np.zeros((3, 4, 3), np.float32))
            writer.write("strands/held", np.arange(rows, dtype=np.uint8), chunk_rows=None)
            writer.meta["report"] = {"strands": rows}
        found.append(path.read_bytes())
    return found


def _sealed(data: bytes, rng: Rng) -> bytes:
    """Damaged on purpose: everything is sealed again, as one who knows how would do it."""
    (count,) = struct.unpack_from("<Q", data, len(data) - 20)
    inside = damaged(data[: len(data) - 20 - 16 * count], rng)
    tail = struct.pack("<Q", 0)
    return inside + tail + struct.pack("<I8s", isal_zlib.crc32(tail, isal_zlib.crc32(inside)), b"ringlet1")


def _cache(path: Path) -> object:
    with cache.open(path, "groom") as reader:
        reader.verify()
        return [reader[name][:] for name in reader.names]
