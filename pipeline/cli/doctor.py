"""Is everything here that the pipeline needs? Each check tells what it found and, if it failed, the remedy."""

import fcntl
import importlib.metadata
import importlib.util
import os
import re
import resource
import subprocess
import sys
import sysconfig
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from pipeline.cli import machine
from pipeline.cli.machine import GB

_LOW_MEMORY, _LOW_DISK = 2 * GB, 2 * GB
_OLDEST_PYTHON, _OLDEST_MAKE = (3, 11), (4, 3)
_FEW_FILES = 256
_AHEAD_S = 60.0  # that clocks of file servers may be off
_GL_TIMEOUT_S = 60
_DRAW_A_TRIANGLE = """\
import numpy as np
from pipeline.render.target import Target
target = Target(16, 16, (0.0, 0.0, 0.0))
target.triangles(np.eye(3, dtype=np.float32), np.array([[0, 1, 2]]), np.ones((3, 3), np.float32))
print(target.renderer_name)
"""


@dataclass(frozen=True)
class Check:
    """One thing that was looked at."""

    name: str
    passed: bool
    found: str
    remedy: str = ""


def examine(outputs: Path) -> list[Check]:
    """Run all checks, for experiments that go into the folder `outputs`; none of them raises."""
    checks: tuple[Callable[[], Check], ...] = (
        _python,
        _libraries,
        _compiler,
        _headers,
        _kernels,
        _gl,
        _make,
        _threads,
        _memory,
        lambda: _disk(outputs),
        lambda: _folder(outputs),
        lambda: _clock(outputs),
        _limits,
        _extras,
    )
    return [check() for check in checks]


def _python() -> Check:
    version = ".".join(map(str, sys.version_info[:3]))
    oldest = ".".join(map(str, _OLDEST_PYTHON))
    remedy = f"PYTHON=/path/to/python{oldest} make env"
    return Check("python", sys.version_info >= _OLDEST_PYTHON, f"{version}, {sys.executable}", remedy)


def _libraries() -> Check:
    needed = [line for line in importlib.metadata.requires("ringlet") or [] if "extra ==" not in line]
    found, missing = [], []
    for line in needed:
        name = re.split(r"[^\w.-]", line, maxsplit=1)[0]
        try:
            found.append(f"{name} {importlib.metadata.version(name)}")
        except importlib.metadata.PackageNotFoundError:
            missing.append(name)
    text = f"missing: {', '.join(missing)}" if missing else ", ".join(found)
    return Check("libraries", not missing, text, "make env   (or: pip install .)")


def _compiler() -> Check:
    compiler = os.environ.get("CXX", "g++")
    if _has_kernels():
        return Check("compiler", True, "not needed: the kernels are built")
    version = _first_line([compiler, "-dumpfullversion"])
    passed = version is not None and int(version.partition(".")[0]) >= 11
    return Check(
        "compiler",
        passed,
        f"{compiler} {version}" if version else f"no {compiler}",
        "sudo apt-get install -y g++   (version 11 or newer)",
    )


def _headers() -> Check:
    if _has_kernels():
        return Check("python headers", True, "not needed: the kernels are built")
    header = Path(sysconfig.get_path("include")) / "Python.h"
    found = str(header) if header.exists() else f"no {header}"
    return Check("python headers", header.exists(), found, "sudo apt-get install -y python3-dev")


def _has_kernels() -> bool:
    return importlib.util.find_spec("pipeline.kernels._portable") is not None


def _kernels() -> Check:
    try:
        from pipeline import kernels
    except ImportError as error:
        return Check("kernels", False, str(error), "make env   (or: pip install .)")
    return Check("kernels", True, f"{kernels.VARIANT}, {kernels.threads()} threads")


def _gl() -> Check:
    # In a process of its own: a broken driver ends it without asking.
    command = [sys.executable, "-c", _DRAW_A_TRIANGLE]
    try:
        result = subprocess.run(command, capture_output=True, text=True, timeout=_GL_TIMEOUT_S)
    except subprocess.TimeoutExpired:
        return Check("OpenGL", False, f"no picture within {_GL_TIMEOUT_S} s", _GL_REMEDY)
    driver = result.stdout.strip()
    if result.returncode != 0 or not driver:
        return Check("OpenGL", False, f"no picture (exit code {result.returncode})", _GL_REMEDY)
    return Check("OpenGL", True, driver)


_GL_REMEDY = "sudo apt-get install -y libegl1 libgl1-mesa-dri"


def _threads() -> Check:
    here, machine = len(os.sched_getaffinity(0)), os.cpu_count() or 1
    return Check("threads", True, f"{here} of {machine} processors may be used")


def _make() -> Check:
    line = _first_line(["make", "--version"])
    numbers = re.findall(r"\d+", line or "")
    passed = len(numbers) >= 2 and (int(numbers[0]), int(numbers[1])) >= _OLDEST_MAKE
    remedy = "sudo apt-get install -y make   (GNU make 4.3 or newer; `ringlet run` does without)"
    return Check("make", passed, line or "no make", remedy)


def _memory() -> Check:
    room = machine.memory("render")
    found = f"{room.free / GB:.1f} GB free ({room.limit})"
    return Check(
        "memory",
        room.free >= _LOW_MEMORY,
        found,
        "close other programs, or raise the limit; `ringlet plan` tells the need",
    )


def _disk(outputs: Path) -> Check:
    room = machine.disk(outputs)
    found = f"{room.free / GB:.1f} GB free in {room.limit}"
    return Check("disk", room.free >= _LOW_DISK, found, "free some space: make clean removes outputs/")


def _folder(outputs: Path) -> Check:
    """Whether files can appear whole here, and processes keep out of each other's way."""
    there = Path(machine.disk(outputs).limit)
    try:
        with tempfile.TemporaryDirectory(dir=there, prefix=".ringlet-doctor-") as folder:
            path = Path(folder) / "probe"
            with path.open("w") as file:
                fcntl.lockf(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                os.fsync(file.fileno())
            path.replace(path.with_name("renamed"))
    except OSError as error:
        found = f"{there}: {error.strerror}"
        return Check("outputs", False, found, "choose a folder that you may write, by --outputs")
    return Check("outputs", True, f"{there}: files can be written, renamed and locked")


def _clock(outputs: Path) -> Check:
    """Files from the future: the clock went back, and make, which compares times, may miss an edit."""
    limit = time.time() + _AHEAD_S
    ahead = [path for path in outputs.glob("*/*") if path.is_file() and path.stat().st_mtime > limit]
    if not ahead:
        return Check("clock", True, "no file is from the future")
    found = f"{len(ahead)} from the future, such as {ahead[0]}"
    remedy = f"set the clock, or: find {outputs} -exec touch {{}} +   (`ringlet run` minds no times)"
    return Check("clock", False, found, remedy)


def _limits() -> Check:
    size = resource.getrlimit(resource.RLIMIT_FSIZE)[0]
    files = resource.getrlimit(resource.RLIMIT_NOFILE)[0]
    unlimited = resource.RLIM_INFINITY
    told = [f"{files if files != unlimited else 'any number of'} open files"]
    told.append("files of any size" if size == unlimited else f"files up to {size / GB:.3f} GB")
    passed = size == unlimited and (files == unlimited or files >= _FEW_FILES)
    return Check("limits", passed, ", ".join(told), f"ulimit -f unlimited -n {4 * _FEW_FILES}")


_EXTRAS = {
    "movie": (".mp4", ("av",)),
    "plots": ("diagrams", ("matplotlib",)),
    "usd": ("OpenUSD", ("pxr",)),
    "alembic": ("Alembic", ("alembic3d",)),
    "exr": ("OpenEXR", ("OpenEXR",)),
    "farm": ("many processes and machines", ("distributed",)),
    "compare": ("FLIP and SSIM", ("flip_evaluator", "skimage")),
}


def _extras() -> Check:
    missing = [
        name
        for name, (_, modules) in _EXTRAS.items()
        if not all(importlib.util.find_spec(module) for module in modules)
    ]
    if not missing:
        return Check("extras", True, f"all: {', '.join(_EXTRAS)}")
    without = ", ".join(_EXTRAS[name][0] for name in missing)
    return Check("extras", True, f'without {without}; pip install "ringlet[{",".join(missing)}]" brings them')


def _first_line(command: list[str]) -> str | None:
    try:
        result = subprocess.run(command, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return None
    return result.stdout.strip().splitlines()[0]
