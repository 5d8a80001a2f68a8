"""Where `extends` may lead: configs come from strangers, and are to read nothing but their own kind.

A config may extend what lies in its project: the nearest folder above it that has a MARKER; without one, in its own folder,
and in the current one if that is above it. The environment variable RINGLET_ROOTS names more folders, separated as in
PATH. Links are followed first.
"""

import os
from pathlib import Path

from pipeline.errors import InputError

MARKERS = (".git", "pyproject.toml", "Makefile")
VARIABLE = "RINGLET_ROOTS"
LONGEST = 50
"""Configs that extend one another."""


def roots_of(config: Path) -> tuple[Path, ...]:
    """The folders that configs which this one extends may lie in, links followed."""
    own, here = config.resolve().parent, Path.cwd().resolve()
    marked = (folder for folder in (own, *own.parents) if any((folder / name).exists() for name in MARKERS))
    project = next(marked, here if own.is_relative_to(here) else own)
    named = os.environ.get(VARIABLE, "").split(os.pathsep)
    return (project, *(Path(name).expanduser().resolve() for name in named if name))


def require_within(where: str, parent: Path, roots: tuple[Path, ...]) -> None:
    """Raise InputError for a config that lies in none of the roots; `where` is what names it."""
    found = parent.resolve()
    if not any(found.is_relative_to(root) for root in roots):
        raise InputError(
            f"{where}: {found} lies outside of {roots[0]}, the folder of this project; "
            f"copy it there, or allow it by the environment: {VARIABLE}={found.parent}"
        )
