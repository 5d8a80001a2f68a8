"""What experiments of one outputs folder share: equal keys mean equal files, so that one is made and the others link to it.

    outputs/.shared/<key>/<experiment>     an empty file: this experiment has, or once had, the file of this key
    outputs/.shared/<key>/.lock            held while a process makes it

The files themselves are in the experiments' folders as hard links, copies where the file system has none. Deleting an
experiment takes nothing from the others, and the disk is free again when the last of them is gone.
"""

import errno
import os
import shutil
from collections.abc import Iterator
from contextlib import AbstractContextManager
from pathlib import Path

from pipeline.cache.atomic import replacing
from pipeline.cache.experiment import Experiment
from pipeline.cache.locks import locked

_NO_LINKS = (errno.EPERM, errno.EXDEV, errno.EMLINK, errno.ENOTSUP, errno.ENOSYS)


class Sharing:
    """Who has which file; of an experiment's view."""

    def __init__(self, experiment: Experiment) -> None:
        self.experiment = experiment
        self._outputs = experiment.folder.parent
        self._folder = self._outputs / ".shared"

    def making(self, stage: str, key: str) -> AbstractContextManager[None]:
        """Keep other experiments from making the same file at the same time; waits while one is at it."""
        return locked(self._folder / key / ".lock", stage, f"the same for {self.experiment.folder.name}")

    def note(self, key: str) -> None:
        """Remember that this experiment has the file of a key."""
        marker = self._folder / key / self.experiment.folder.name
        if not marker.exists():
            marker.parent.mkdir(parents=True, exist_ok=True)
            marker.touch()

    def others(self, key: str) -> Iterator[Experiment]:
        """Other experiments that may have the file of a key; those whose folder is gone are forgotten."""
        for marker in sorted(self._folder.glob(f"{key}/[!.]*")):
            folder = self._outputs / marker.name
            if not folder.is_dir():
                marker.unlink(missing_ok=True)
            elif marker.name != self.experiment.folder.name:
                yield Experiment(folder)

    def take(self, stage: str, other: Experiment) -> None:
        """Make the files of a stage those of another experiment; a file that goes with it may be missing."""
        for source, target in zip(other.files(stage), self.experiment.files(stage), strict=True):
            if source.exists():
                _link(source, target)


def _link(source: Path, target: Path) -> None:
    with replacing(target) as temporary:
        try:
            os.link(source, temporary)
        except OSError as error:
            if error.errno not in _NO_LINKS:
                raise
            shutil.copyfile(source, temporary)
