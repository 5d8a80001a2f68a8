"""All experiments of a sweep in one process: libraries are loaded once, and stages that no value touches are made once."""

from collections.abc import Sequence
from fnmatch import fnmatchcase
from pathlib import Path

from pipeline import log
from pipeline.batch.stages import Batch
from pipeline.cache import Experiment
from pipeline.config import STAGES
from pipeline.config.sweep import Run, Swept
from pipeline.errors import InputError
from pipeline.progress import say


def chosen(swept: Swept, pattern: str) -> list[Run]:
    """The experiments whose name, or what is behind its "@", fits a pattern such as "*young_modulus=2GPa*".

    Raises InputError when there are none.
    """
    runs = [run for run in swept.runs if any(fnmatchcase(name, pattern) for name in _names(run))]
    if not runs:
        listed = "\n".join(f"  {run.name}" for run in swept.runs)
        raise InputError(f"--only {pattern}: fits none of these experiments:\n{listed}")
    return runs


def batch_of(run: Run, outputs: Path) -> Batch:
    """The stages of one experiment."""
    return Batch(run.loaded.config, Experiment(outputs / run.name))


def make_all(
    batches: Sequence[Batch],
    touch: bool = True,
    stages: Sequence[str] = STAGES,
    frames: range | None = None,
) -> None:
    """Make every stage, or some, and all frames, or some, of every experiment that is not fresh.

    An experiment that cannot be made does not stop the others; raises InputError of all such at the end.
    """
    wrong: list[str] = []
    for number, batch in enumerate(batches, start=1):
        name = batch.experiment.folder.name
        say("sweep", f"{number}/{len(batches)} {name}")
        try:
            with log.kept_in(batch.experiment.log):
                for stage in stages:
                    batch.make(stage, frames if stage == "render" else None, touch=touch)
        except InputError as error:
            say("sweep", f"{name} failed; going on with the others")
            wrong.append(f"{name}: {error}")
    if wrong:
        raise InputError.joined(wrong)


def _names(run: Run) -> tuple[str, str]:
    return run.name, run.name.rpartition("@")[2]
