"""The machine that figures were measured on."""

import datetime
import importlib.metadata
import os
import platform
from pathlib import Path
from typing import Any

import numpy as np

from pipeline import kernels

_SETS = {"portable": "x86-64", "v3": "x86-64-v3 (AVX2)", "v4": "x86-64-v4 (AVX-512)"}


def describe() -> dict[str, Any]:
    """Processor, instruction set of the kernels, memory, versions, date, other load; peaks [GFLOP/s] are measured now."""
    pages, page = os.sysconf("SC_PHYS_PAGES"), os.sysconf("SC_PAGE_SIZE")
    return {
        "processor": _processor(),
        "processors": len(os.sched_getaffinity(0)),
        "instruction_set": _SETS[kernels.VARIANT],
        "peak_gflops_float32": round(kernels.peak_flops("float32") * 1e-9, 1),
        "peak_gflops_float64": round(kernels.peak_flops("float64") * 1e-9, 1),
        "memory_gb": round(pages * page * 1e-9, 1),
        "system": f"{platform.system()} {platform.release()}",
        "python": platform.python_version(),
        "numpy": np.__version__,
        "vtk": importlib.metadata.version("vtk"),
        "ringlet": importlib.metadata.version("ringlet"),
        "date": datetime.datetime.now(datetime.UTC).date().isoformat(),
        "load_before": round(os.getloadavg()[0], 2),
    }


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.machine()
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.machine()
