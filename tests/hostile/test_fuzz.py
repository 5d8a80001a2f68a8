"""Damaged files, as many as seconds allow; `python -m tests.hostile.fuzz` reads 100,000 for every reader."""

import io
import json
import os
import struct
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from pipeline.errors import InputError
from tests.hostile import engine, readers

ROOT = Path(__file__).parents[2]
QUICK = (
    ".hair",
    ".tfx",
    ".data",
    ".usda",
    "config",
    "formula",
    "transforms",
    "pins",
    "parting",
    "paint",
    "picture",
    "exr",
    "cache",
)


@pytest.mark.parametrize("reader", [*QUICK, ".vtp", "mesh.obj"])
def test_damaged_files_are_read_or_refused_in_bounded_time_and_memory(tmp_path: Path, reader: str) -> None:
    count = "120" if reader in QUICK else "30"
    command = [sys.executable, "-m", "tests.hostile.fuzz", "--files", count, "--keep", str(tmp_path / "kept")]
    done = subprocess.run([*command, "--only", reader], cwd=ROOT, capture_output=True, text=True, check=False)
    print(done.stdout, done.stderr)
    assert done.returncode == 0
    outcomes = json.loads(done.stdout)
    assert outcomes
    for name, found in outcomes.items():
        assert sum(found.values()) == int(count), name
        assert found[engine.REFUSED] > 0.3 * int(count), name


HARM: dict[str, Callable[[], object]] = {  # what a reader may do, and how the fuzzer calls it
    "MemoryError": lambda: bytearray(1 << 30),
    "IndexError": lambda: [][1],
    "SIGABRT": os.abort,
    "SIGALRM": lambda: time.sleep(60),
    "nameless message: wrong": lambda: refuse("wrong"),
    "what was read does not fit together": lambda: None,
}


def image(kind: str) -> bytes:
    to = io.BytesIO()
    Image.fromarray(np.arange(480, dtype=np.uint8).reshape(24, 20)).save(to, kind)
    return to.getvalue()


def with_bytes(data: bytes, at: int, new: bytes) -> bytes:
    return data[:at] + new + data[at + len(new) :]


PNG, BMP = image("PNG"), image("BMP")
PICTURES = {
    "a chunk of 2 GB": with_bytes(PNG, PNG.index(b"IDAT") - 4, struct.pack(">I", 0x7FFFFFFF)),
    "a chunk of no kind": with_bytes(PNG, PNG.index(b"IDAT"), b"\xff\0"),
    "more pixels than bytes can stand for": with_bytes(BMP, 18, struct.pack("<2i", 9000, 9000)),
}


@pytest.mark.parametrize("what", PICTURES)
@pytest.mark.parametrize("reader", ["painted", "picture"])
def test_a_picture_takes_no_memory_that_only_its_header_asks_for(
    tmp_path: Path, reader: str, what: str
) -> None:
    target = next(t for t in readers.targets(tmp_path) if t.name == reader)
    target = replace(target, whole=[PICTURES[what]], damage=lambda data, _: data)
    outcomes = engine.fuzz(target, range(1), 0, tmp_path)
    print(outcomes)
    assert engine.held(*outcomes.outcomes)
    assert outcomes.kilobytes < 20 << 10


def refuse(message: str) -> None:
    raise InputError(message)


@pytest.mark.parametrize("named", HARM)
def test_the_fuzzer_notices_a_reader_that_breaks(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, named: str
) -> None:
    def broken(path: Path) -> object:
        return 1 if path.stat().st_size == 400 else HARM[named]()

    monkeypatch.setattr(engine, "SECONDS", 0.2)
    monkeypatch.setattr(engine, "PATIENCE", 3)
    target = engine.Target(
        "broken", ".x", [bytes(range(200)) * 2], broken, fits=lambda found: found is not None
    )
    outcomes = engine.fuzz(target, range(12), 3, tmp_path).outcomes
    print(outcomes)
    assert outcomes[named] >= 1
    assert outcomes.get(engine.READ, 0) >= 1
    assert sum(outcomes.values()) == 12
