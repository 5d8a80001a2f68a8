"""Same config, same bytes: for any number of threads, any split of the frames, any point where a run is taken up again."""

import os
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import tiny

from pipeline import cache, kernels
from pipeline.batch.stages import Batch
from pipeline.config import load
from pipeline.simulate import stage


class Ended(Exception):
    """A run that was cut off here."""


@pytest.fixture
def batch(undisturbed: cache.Experiment, tmp_path: Path) -> Batch:
    """The experiment with its groom, nothing else."""
    found = cache.Experiment(tmp_path / tiny.NAME)
    found.folder.mkdir()
    shutil.copy(undisturbed.groom, found.groom)
    return Batch(load(tiny.CONFIG, tiny.SETTINGS).config, found)


def ending_after(frames: int) -> Callable[..., Iterator[cache.Frame]]:
    """A simulation that is cut off when so many frames are there."""
    run = stage.run

    def cut(*arguments: object) -> Iterator[cache.Frame]:
        for index, frame in enumerate(run(*arguments)):  # type: ignore[arg-type]
            if index == frames:
                raise Ended
            yield frame

    return cut


@pytest.mark.parametrize(
    ("threads", "checkpoint", "cuts"),
    [
        ((1,), 8, ()),
        ((2,), 8, ()),
        ((2, 1), 8, (9,)),
        ((1, 2, 1), 3, (4, 5)),
        ((2, 1, 2, 1), 1, (1, 1, 6)),
        ((2, 1), 5, (5,)),
        ((1, 2, 2), 2, (0, 9)),
    ],
)
def test_guides_do_not_depend_on_threads_or_on_where_a_run_was_taken_up(
    undisturbed: cache.Experiment,
    batch: Batch,
    monkeypatch: pytest.MonkeyPatch,
    threads: tuple[int, ...],
    checkpoint: int,
    cuts: tuple[int, ...],
) -> None:
    monkeypatch.setattr(stage, "CHECKPOINT_FRAMES", checkpoint)
    for count, cut in zip(threads, cuts, strict=False):
        kernels.set_threads(count)
        with monkeypatch.context() as patched, pytest.raises(Ended):
            patched.setattr(stage, "run", ending_after(cut))
            batch.make("simulate")
    kernels.set_threads(threads[-1])
    batch.make("simulate")
    assert tiny.columns(batch.experiment.guides) == tiny.columns(undisturbed.guides)


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("name", ["groom", "interpolate"])
def test_grooms_and_bindings_do_not_depend_on_threads(
    undisturbed: cache.Experiment, batch: Batch, name: str, threads: int
) -> None:
    kernels.set_threads(threads)
    if name == "groom":
        batch.experiment.groom.unlink()
    batch.make(name)
    wanted = {"groom": undisturbed.groom, "interpolate": undisturbed.strands}[name]
    assert tiny.columns(batch.file(name)) == tiny.columns(wanted)


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("split", [[range(1, 11)], [range(7, 11), range(1, 4), range(4, 7)], "one by one"])
def test_frames_do_not_depend_on_threads_or_on_how_they_are_split(
    undisturbed: cache.Experiment, batch: Batch, split: list[range] | str, threads: int
) -> None:
    for path in (undisturbed.guides, undisturbed.strands):
        shutil.copy(path, batch.experiment.folder)
    kernels.set_threads(threads)
    for frames in [range(n, n + 1) for n in (10, 2, 6)] if isinstance(split, str) else split:
        batch.make("render", frames)
    batch.make("render")
    tiny.assert_same(batch.experiment, undisturbed)


def test_one_processor_gives_the_same_bytes(undisturbed: cache.Experiment, tmp_path: Path) -> None:
    """A whole run, whose libraries' own threads are limited as well."""
    tiny.assert_same(tiny.run(tmp_path, processors=[min(os.sched_getaffinity(0))]), undisturbed)


@pytest.fixture(scope="module")
def two_workers() -> Iterator[str]:
    """A scheduler of two workers."""
    pytest.importorskip("distributed", reason='needs the extra "farm"')
    from pipeline.farm.cluster import local_cluster

    with local_cluster(2) as address:
        yield address


@pytest.mark.parametrize(
    ("threads", "cut", "split"),
    [(1, 9, [range(7, 11), range(2, 4)]), (2, 0, [range(1, 11)])],
    ids=["one thread, resumed, pieces", "two threads, whole"],
)
def test_workers_give_the_same_bytes(
    undisturbed: cache.Experiment,
    batch: Batch,
    two_workers: str,
    monkeypatch: pytest.MonkeyPatch,
    threads: int,
    cut: int,
    split: list[range],
) -> None:
    """Two workers, for any number of threads, any split of the frames, and where a run was taken up."""
    from pipeline.farm.cluster import connected
    from pipeline.farm.run import make_on
    from pipeline.farm.tasks import THREADS

    with connected(two_workers) as client:
        client.run(os.environ.update, {THREADS: str(threads)})
    if cut:
        with monkeypatch.context() as patched, pytest.raises(Ended):
            patched.setattr(stage, "run", ending_after(cut))
            batch.make("simulate")
    for frames in split:
        make_on(two_workers, [batch], frames=frames)
    make_on(two_workers, [batch])
    tiny.assert_same(batch.experiment, undisturbed)
