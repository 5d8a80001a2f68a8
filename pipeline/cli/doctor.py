"""Is everything here that the pipeline needs? Each check tells what it found and, if it failed, the remedy."""

import os
import shutil
import subprocess
import sys
import sysconfig
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

_GB = 1e9
_LOW_MEMORY, _LOW_DISK = 2 * _GB, 2 * _GB
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


def examine() -> list[Check]:
    """Run all checks; none of them raises."""
    checks: tuple[Callable[[], Check], ...] = (
        _compiler,
        _headers,
        _kernels,
        _gl,
        _threads,
        _memory,
        _disk,
        _movie,
        _formats,
    )
    return [check() for check in checks]


def _compiler() -> Check:
    compiler = os.environ.get("CXX", "g++")
    version = _first_line([compiler, "-dumpfullversion"])
    passed = version is not None and int(version.partition(".")[0]) >= 11
    return Check(
        "compiler",
        passed,
        f"{compiler} {version}" if version else f"no {compiler}",
        "sudo apt-get install -y g++   (version 11 or newer)",
    )


def _headers() -> Check:
    header = Path(sysconfig.get_path("include")) / "Python.h"
    found = str(header) if header.exists() else f"no {header}"
    return Check("python headers", header.exists(), found, "sudo apt-get install -y python3-dev")


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


def _memory() -> Check:
    lines = Path("/proc/meminfo").read_text().splitlines()
    free = {line.split(":")[0]: int(line.split()[1]) * 1024 for line in lines}["MemAvailable"]
    found = f"{free / _GB:.1f} GB free"
    return Check("memory", free >= _LOW_MEMORY, found, "close other programs; `ringlet plan` tells the need")


def _disk() -> Check:
    free = shutil.disk_usage(Path.cwd()).free
    found = f"{free / _GB:.1f} GB free in {Path.cwd()}"
    return Check("disk", free >= _LOW_DISK, found, "free some space: make clean removes outputs/")


def _movie() -> Check:
    import importlib.util

    if importlib.util.find_spec("av"):
        return Check("movie", True, "PyAV writes .mp4")
    return Check("movie", True, 'animated PNG only; pip install "ringlet[movie]" for .mp4')


def _formats() -> Check:
    import importlib.util

    extras = {"usd": "pxr", "alembic": "alembic3d"}
    missing = [extra for extra, module in extras.items() if not importlib.util.find_spec(module)]
    if not missing:
        return Check("formats", True, "USD and Alembic beside .tfx, .hair, .data and VTK")
    return Check(
        "formats", True, f'.tfx, .hair, .data and VTK; pip install "ringlet[{",".join(missing)}]" for more'
    )


def _first_line(command: list[str]) -> str | None:
    try:
        result = subprocess.run(command, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return None
    return result.stdout.strip().splitlines()[0]
