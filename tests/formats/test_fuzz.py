"""Damaged files, as many as seconds allow; `python tests/formats/fuzz.py` reads 100,000."""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from pipeline.errors import InputError
from pipeline.strands.formats import Ragged

sys.path.insert(0, str(Path(__file__).parent))
import fuzz

FUZZ = Path(__file__).with_name("fuzz.py")


def test_damaged_files_give_strands_or_a_message_in_bounded_time_and_memory(tmp_path: Path) -> None:
    command = [sys.executable, str(FUZZ), "--files", "1500", "--keep", str(tmp_path / "kept")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    print(done.stdout, done.stderr)
    assert done.returncode == 0
    outcomes = json.loads(done.stdout)
    assert sum(outcomes[".hair"].values()) == 360
    assert min(outcomes[".hair"]["strands"], outcomes[".hair"]["refused"]) > 30


HARM = {  # what a reader may do to a file that was cut off or grew, and how the fuzzer calls it
    "MemoryError": lambda: bytearray(1 << 30),
    "IndexError": lambda: [][1],
    "SIGABRT": os.abort,
    "SIGALRM": lambda: time.sleep(60),
    "nameless message: wrong": lambda: refuse("wrong"),
    "strands that do not fit together": lambda: Ragged(
        np.zeros((1, 3)), np.zeros(1, np.int64), np.zeros((1, 2))
    ),
}


def refuse(message: str) -> None:
    raise InputError(message)


@pytest.mark.parametrize("named", HARM)
def test_the_fuzzer_notices_a_reader_that_breaks(monkeypatch: pytest.MonkeyPatch, named: str) -> None:
    whole = fuzz.READERS[".data"]

    def broken(path: Path) -> Ragged:
        return whole(path) if path.stat().st_size == 484 else HARM[named]()

    monkeypatch.setitem(fuzz.READERS, ".data", broken)
    monkeypatch.setattr(fuzz, "SECONDS", 0.2)
    outcomes = fuzz.fuzz(12, 3, endings=[".data"])[".data"]
    print(outcomes)
    assert outcomes[named] >= 1
    assert outcomes.get("refused", 0) + outcomes.get("strands", 0) >= 1
    assert sum(outcomes.values()) == 12
