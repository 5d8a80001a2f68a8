"""The folder of one experiment, outputs/<name>/: where its files are, and who is working on it."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from pipeline.cache.atomic import remove_stale
from pipeline.cache.locks import holders, locked


@dataclass(frozen=True)
class Experiment:
    """Paths of an experiment; nothing is created before something is written."""

    folder: Path

    @property
    def groom(self) -> Path:
        """All strands at rest, their guides and the head."""
        return self.folder / "groom.h5"

    @property
    def guides(self) -> Path:
        """The guides in motion."""
        return self.folder / "guides.h5"

    @property
    def strands(self) -> Path:
        """The full count of strands and the guides that they follow."""
        return self.folder / "strands.h5"

    @property
    def frames(self) -> Path:
        """The folder of the pictures."""
        return self.folder / "frames"

    @property
    def log(self) -> Path:
        """What its runs have said, as JSON lines (see pipeline/log.py)."""
        return self.folder / "log.jsonl"

    @property
    def working_folders(self) -> tuple[Path, ...]:
        """Where files are written."""
        return self.folder, self.frames, self.guides.with_suffix(".segments")

    @property
    def report(self) -> Path:
        """The page that tells about its last run."""
        return self.folder / "report.html"

    def files(self, stage: str) -> tuple[Path, ...]:
        """The file of a stage before the render, then those that go with it."""
        return {
            "groom": (self.groom,),
            "simulate": (self.guides, self.folder / "diagnostics.png"),
            "interpolate": (self.strands,),
        }[stage]

    @contextmanager
    def working_on(self, stage: str, frames: range | None = None) -> Iterator[None]:
        """Keep other processes away from a stage while it is made; waits, and says so, while one is at it.

        Of the render only from `frames`, if they are given: processes make different frames at once. The lock dies
        with its process. Temporary files of dead processes are removed on the way.
        """
        with locked(self.folder / "locks" / stage, stage, str(self.folder), frames):
            for folder in self.working_folders:
                remove_stale(folder)
            yield

    def workers_on(self, stage: str) -> list[str]:
        """The processes that are making a stage at the moment, as "process 12 on host"."""
        return holders(self.folder / "locks" / stage)
