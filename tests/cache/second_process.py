"""A second process that wants what this one holds."""

import subprocess
import sys
from pathlib import Path


def wants(what: str, folder: Path) -> "subprocess.Popen[str]":
    """Start a process that prints "in" once it has entered the context `what`; `folder` is its name for the folder."""
    code = (
        "import sys; from pathlib import Path; from pipeline import cache\n"
        f"folder = Path(sys.argv[1])\nwith {what}: print('in', flush=True)"
    )
    return subprocess.Popen(
        [sys.executable, "-c", code, str(folder)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


def first_words(process: "subprocess.Popen[str]") -> str:
    """The first line of its standard error; it has not ended then."""
    assert process.stderr is not None
    said = process.stderr.readline()
    assert process.poll() is None
    return said
