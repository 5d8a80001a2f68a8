"""Kernels say by TypeError or ValueError what does not fit; `python -m tests.hostile.boundary` calls them more often."""

import os

import pytest

from pipeline import kernels
from tests.hostile.boundary import Kernel, all_kernels, held, outcomes


def test_no_kernel_crashes_whatever_arrays_it_is_given() -> None:
    kernels.set_threads(1)
    wrong = []
    found = all_kernels()
    for kernel in found:
        told = outcomes(kernel, 25)
        print(f"{kernel.name}: {dict(told)}")
        wrong += [] if held(told) else [kernel.name]
    assert len(found) > 40
    assert not wrong


def test_a_crash_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kernels, "broken", lambda _: os.abort(), raising=False)
    told = outcomes(Kernel("broken", (("numpy.ndarray[dtype=float32, shape=(*)]",),)), 3)
    print(dict(told))
    assert not held(told)
    assert sum(told.values()) == 3
