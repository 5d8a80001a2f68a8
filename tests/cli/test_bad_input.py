"""What users get wrong in files: one clear message that names the file, exit code 2, no traceback, nothing left."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from pipeline.cli.main import WRONG_INPUT, call
from pipeline.strands.formats import Ragged
from pipeline.strands.formats.hair import write_hair
from pipeline.strands.formats.tfx import write_tfx


def strands(count: int = 5, length: float = 0.1) -> Ragged:
    points = np.zeros((count, 8, 3))
    points[:, :, 1] = -np.linspace(0, length, 8)
    points[:, :, 0] = np.arange(count)[:, None] * 0.01
    return Ragged(points.reshape(-1, 3), np.full(count, 8), np.tile(np.array([2, 0], np.uint8), (count, 1)))


def tetrahedron(path: Path, points: str, faces: str) -> Path:
    path.write_text(points + faces)
    return path


CORNERS = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
CLOSED = "f 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"


def missing_head(folder: Path) -> tuple[str, Path]:
    return "scene.head", folder / "nobody.obj"


def head_with_a_hole(folder: Path) -> tuple[str, Path]:
    return "scene.head", tetrahedron(folder / "hole.obj", CORNERS, CLOSED[:-8])


def head_with_nan(folder: Path) -> tuple[str, Path]:
    return "scene.head", tetrahedron(folder / "nan.obj", CORNERS.replace("1 0 0", "nan 0 0"), CLOSED)


def truncated_tfx(folder: Path) -> tuple[str, Path]:
    path = folder / "short.tfx"
    write_tfx(path, strands())
    path.write_bytes(path.read_bytes()[:-100])
    return "groom.source", path


def header_that_promises_too_much(folder: Path) -> tuple[str, Path]:
    path = folder / "liar.hair"
    write_hair(path, strands())
    data = bytearray(path.read_bytes())
    data[4:8] = (4_000_000_000).to_bytes(4, "little")
    path.write_bytes(data)
    return "groom.source", path


def empty_groom(folder: Path) -> tuple[str, Path]:
    path = folder / "empty.data"
    path.write_bytes(bytes(4))
    return "groom.source", path


def strands_of_zero_length(folder: Path) -> tuple[str, Path]:
    path = folder / "points.tfx"
    write_tfx(path, strands(length=0.0))
    return "groom.source", path


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (missing_head, "no such"),
        (head_with_a_hole, "open"),
        (head_with_nan, "finite"),
        (truncated_tfx, "truncated"),
        (header_that_promises_too_much, "file has"),
        (empty_groom, "number of strands is 0"),
        (strands_of_zero_length, "none of its 5 strands has a length"),
    ],
)
def test_a_bad_file_gives_one_clear_message(
    make: Callable[[Path], tuple[str, Path]], words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    key, path = make(tmp_path)
    head = "" if key == "scene.head" else '[scene]\nhead = "none"\n'
    table, name = key.split(".")
    config = tmp_path / "bad.toml"
    config.write_text(f'name = "bad"\n{head}[{table}]\n{name} = "{path.name}"\n')
    code = call(["groom", str(config), "--outputs", str(tmp_path / "outputs")])
    message = capsys.readouterr().err
    told = [line for line in message.splitlines() if path.name in line]
    print(told)
    assert code == WRONG_INPUT
    assert len(told) == 1
    assert words in told[0]
    assert "Traceback" not in message
    assert not list((tmp_path / "outputs").rglob("*.h5*"))
