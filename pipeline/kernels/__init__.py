"""C++ kernels: arrays in, arrays out; the variant for this processor is chosen at import.

Set RINGLET_KERNELS to "portable", "v3" or "v4" to choose by hand. Results are the same for any number
of threads; between variants they differ in the last digits.
"""

import importlib
import importlib.util
import os

# Steps of hair-hair contact wait for one another many times a frame. A thread that has waited 0.1 ms gives its
# processor away: where other work fills the processors, waiting longer made a step ten times slower (measured).
if "OMP_WAIT_POLICY" not in os.environ:
    os.environ.setdefault("GOMP_SPINCOUNT", "3000")

from pipeline.kernels import _portable

_BY_LEVEL = {0: "portable", 3: "v3", 4: "v4"}
_MODULES = {"portable": "_portable", "v3": "_x86_64_v3", "v4": "_x86_64_v4"}


def _choose() -> str:
    wanted = os.environ.get("RINGLET_KERNELS")
    if wanted is not None:
        if wanted not in _MODULES:
            raise ImportError(f"RINGLET_KERNELS={wanted}: expected one of {', '.join(_MODULES)}")
        return wanted
    level = _portable.cpu_level()
    for name in (_BY_LEVEL[level], "v3", "portable"):
        if importlib.util.find_spec(f"pipeline.kernels.{_MODULES[name]}") and (name != "v3" or level >= 3):
            return name
    return "portable"


VARIANT = _choose()
_native = importlib.import_module(f"pipeline.kernels.{_MODULES[VARIANT]}")

__all__ = [name for name in dir(_native) if not name.startswith("_")]
globals().update({name: getattr(_native, name) for name in __all__})
