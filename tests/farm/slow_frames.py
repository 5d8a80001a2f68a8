"""Loaded by workers of tests: frames take a moment, and tell in a file when they are begun and when they are there."""

import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from pipeline import cache

LOG = Path(os.environ["RINGLET_TEST_LOG"])
SECONDS = 0.1


def note(what: str, path: Path) -> None:
    with LOG.open("a") as file:
        file.write(f"{what} {path} {os.getpid()}\n")


def slow(write_picture: Callable[..., None]) -> Callable[..., None]:
    def slowly(path: Path, *arguments: Any, **options: Any) -> None:
        note("begin", path)
        time.sleep(SECONDS)
        write_picture(path, *arguments, **options)
        note("end", path)

    return slowly


if cache.write_picture.__module__ == "pipeline.cache.pictures":  # a worker loads this more than once
    cache.write_picture = slow(cache.write_picture)
