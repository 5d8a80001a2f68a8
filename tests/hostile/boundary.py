"""Calls of every kernel with arrays that may not fit: it says so by TypeError or ValueError, or works; it never crashes.

    python -m tests.hostile.boundary --calls 2000

What kernels there are and what they take is what they say themselves, "points: numpy.ndarray[dtype=float64, shape=(*, *, 3),
...". A call begins with arguments that fit as far as that tells, of one length along each axis; then some of them get
another rank, length, dtype or stride. One process makes the calls of one kernel, and may die of them. Run it
under the sanitizers to see reads that do not crash (tests/kernels/sanitize.sh).
"""

import argparse
import faulthandler
import os
import re
import resource
import signal
import sys
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from pipeline import kernels
from tests.hostile.damage import Rng

ALLOWED = ("worked", "TypeError", "ValueError", "IndexError", "MemoryError", "OverflowError")
SECONDS = 5
_ARGUMENT = re.compile(r"(\w+): (numpy\.ndarray\[.*?\](?: \| None)?|.*?)(?: = [^,]*)?(?=, \w+: |$)")
_KINDS = ("f8", "f4", "u4", "i8", "i4", "u1", "?", "c8")
_LEFT_OUT = ("set_threads", "peak_flops")  # of the process, and of the processor


@dataclass(frozen=True)
class Kernel:
    """A function, or a class that is made."""

    name: str
    signatures: tuple[tuple[str, ...], ...]
    """The kinds of arguments of each of its forms."""

    def call(self, rng: Rng, spoil: float = 0.25) -> Any:
        """Call it with arguments of which this part does not fit."""
        lengths = [8 if rng.random() < 0.5 else int(rng.integers(1, 20)), 8, 8]
        values = [_value(kind, lengths, rng) for kind in self.signatures[rng.integers(len(self.signatures))]]
        for at in range(len(values)):
            if isinstance(values[at], np.ndarray) and rng.random() < spoil:
                values[at] = _spoilt(values[at], rng)
        return getattr(kernels, self.name)(*values)


def all_kernels() -> list[Kernel]:
    """All that take an array."""
    found = []
    for name in dir(kernels):
        thing = getattr(kernels, name)
        if name in _LEFT_OUT or not callable(thing) or "kernels" not in str(getattr(thing, "__module__", "")):
            continue
        told = (thing.__init__ if isinstance(thing, type) else thing).__doc__ or ""
        lines = [line for line in told.splitlines() if line.startswith((f"{name}(", "__init__("))]
        if any("ndarray" in line for line in lines):
            found.append(Kernel(name, tuple(_kinds(line) for line in lines)))
    return found


def _kinds(signature: str) -> tuple[str, ...]:
    inside = signature.split("(", 1)[1].rsplit(" -> ", 1)[0].rsplit(")", 1)[0]
    return tuple(kind for _, kind in _ARGUMENT.findall(inside.removeprefix("self, ").removeprefix("self")))


def _value(kind: str, lengths: list[int], rng: Rng) -> Any:
    """A value of this kind; arrays have these lengths along their axes, unless the kind tells another."""
    if "None" in kind and rng.random() < 0.3:
        return None
    if "ndarray" in kind:
        dtype = (re.findall(r"dtype=(\w+)", kind) or ["float64"])[0]
        told = re.findall(r"shape=\(([^)]*)\)", kind)
        axes = told[0].replace(" ", "").split(",") if told else ["*", "3"]
        shape = [lengths[min(k, 2)] if axis == "*" else int(axis) for k, axis in enumerate(axes) if axis]
        numbers = rng.normal(size=shape) if dtype.startswith("float") else rng.integers(0, 4, shape)
        return np.ascontiguousarray(numbers.astype(dtype))
    plain: dict[str, Callable[[], Any]] = {
        "bool": lambda: bool(rng.integers(2)),
        "int": lambda: int(rng.choice([-1, 0, 1, 2, 3, 5, 8, 16])),
        "float": lambda: float(rng.choice([-1, 0, 1e-3, 0.1, 1, 10, np.nan, np.inf])),
        "str": lambda: str(rng.choice(["equal", "general", "none", "frenet", "rotor", "kirchhoff", "x"])),
    }
    if kind in plain:
        return plain[kind]()
    if kind.startswith(("tuple", "collections.abc.Sequence")):
        return tuple(int(n) for n in rng.integers(-1, 9, max(kind.count(",") + 1, 3)))
    return _made(kind.removesuffix(" | None").rpartition(".")[2])


@cache
def _made(name: str) -> Any:
    """An object of a class of the kernels; None where no try makes one."""
    if not isinstance(getattr(kernels, name, None), type):
        return None
    for seed in range(200):
        rng = np.random.default_rng([7, seed])
        try:
            if name == "DistanceField":
                return kernels.DistanceField(rng.normal(size=(4, 5, 6)).astype("f4"), np.zeros(3), 0.1)
            if name == "RestShape":
                return kernels.rest_shape(*_rods(rng))
            if name == "State":
                return kernels.at_rest(_rods(rng)[0])
            lines = (getattr(kernels, name).__init__.__doc__ or "").splitlines()
            lines = [line for line in lines if line.startswith("__init__(")]
            return Kernel(name, tuple(_kinds(line) for line in lines)).call(rng, spoil=0)
        except Exception:  # noqa: BLE001, the next try may fit
            continue
    return None


def _rods(rng: Rng) -> tuple[Any, ...]:
    """Arguments of `rest_shape`: 8 straight strands of 8 points."""
    points = rng.normal(size=(8, 1, 3)) + np.linspace(0, 0.1, 8)[:, None] * np.array([0.0, -1, 0])
    held, one = np.zeros((8, 8), np.uint8), np.ones(8)
    held[:, :2] = 1
    return points, 1e-5 * one, 1e-9 * one, 1e-9 * one, held, np.zeros((8, 8))


def _spoilt(array: Any, rng: Rng) -> Any:
    """An array that is another in one way."""
    way = int(rng.integers(9))
    if way == 0:
        return array[None] if rng.random() < 0.5 else array.reshape(-1)
    if way == 1:
        return array[..., :-1] if array.ndim else array[None]
    if way == 2:
        return np.concatenate([array, array], axis=int(rng.integers(array.ndim)))
    if way == 3:
        return array[:0]
    if way == 4:
        return np.repeat(array, 2, axis=-1)[..., ::2] if rng.random() < 0.5 else array[::-1]
    if way == 5:
        return np.asfortranarray(array)
    if way == 6:
        return array.astype(_KINDS[rng.integers(len(_KINDS))])
    if way == 7:
        return np.broadcast_to(array[:1], array.shape)
    return (array * float(rng.choice([1e30, -1e9, 1e5]))).astype(array.dtype)


def outcomes(kernel: Kernel, calls: int, seed: int = 0) -> Counter[str]:
    """What comes of so many calls, in a process of their own."""
    found: Counter[str] = Counter()
    first = 0
    while first < calls:
        reading, writing = os.pipe()
        child = os.fork()
        if child == 0:
            os.close(reading)
            _work(kernel, range(first, calls), seed, writing)
        os.close(writing)
        with os.fdopen(reading) as told:
            lines = told.read().splitlines()
        code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        found.update(lines)
        if code:
            found[f"{signal.Signals(-code).name if code < 0 else code} at {first + len(lines)}"] += 1
        first += len(lines) + bool(code)
    return found


def _work(kernel: Kernel, numbers: range, seed: int, writing: int) -> None:
    silence = os.open(os.devnull, os.O_WRONLY)
    os.dup2(silence, 2)
    faulthandler.disable()
    signal.signal(signal.SIGPROF, signal.SIG_DFL)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    np.seterr(all="ignore")
    code = 1
    try:
        with os.fdopen(writing, "w") as to:
            for number in numbers:
                signal.setitimer(signal.ITIMER_PROF, SECONDS)
                try:
                    kernel.call(np.random.default_rng([seed, number]))
                    outcome = "worked"
                except Exception as error:  # noqa: BLE001, which one is what is looked at
                    outcome = type(error).__name__
                to.write(outcome + "\n")
                to.flush()
        code = 0
    finally:
        os._exit(code)


def held(found: Counter[str]) -> bool:
    """Whether nothing came out but what is allowed."""
    return all(outcome in ALLOWED for outcome in found)


def main() -> int:
    """Call all kernels."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--calls", type=int, default=2000, help="of every kernel")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", nargs="+", default=[])
    options = parser.parse_args()
    kernels.set_threads(1)
    good = True
    for kernel in all_kernels():
        if not options.only or kernel.name in options.only:
            found = outcomes(kernel, options.calls, options.seed)
            good &= held(found)
            print(f"{'' if held(found) else 'WRONG '}{kernel.name:24} {dict(found)}", flush=True)
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
