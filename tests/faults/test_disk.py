"""Disks that are full, limited or read-only: one message, exit code 2, nothing lost; with room again the run goes on."""

import resource
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import tiny

from pipeline import cache

Disk = tuple[Path, Callable[[str], None]]


def sizes(experiment: cache.Experiment) -> dict[str, int]:
    found = {name: getattr(experiment, name).stat().st_size for name in ("groom", "guides", "strands")}
    return found | {"frames": sum(path.stat().st_size for path in experiment.frames.iterdir())}


def refused(outputs: Path, *says: str) -> str:
    """Run in vain; returns the one line that says why."""
    process = tiny.start(outputs)
    _, error = process.communicate(timeout=120)
    assert process.returncode == 2, error
    assert "Traceback" not in error
    last = error.splitlines()[-1]
    assert any(words in last for words in says), last
    return last


def test_a_disk_that_fills_in_every_stage_loses_nothing(undisturbed: cache.Experiment, disk: Disk) -> None:
    outputs, remount = disk
    found = cache.Experiment(outputs / tiny.NAME)
    size = sizes(undisturbed)
    slack = 200_000  # diagnostics, log, and pages of 4 KiB that are not full
    told = []

    def fail(words: str, room: int) -> None:
        remount(f"size={room}")
        told.append(refused(outputs, "no room on the disk", "No space left on device"))
        assert words in told[-1]
        assert tiny.damaged(found) == []
        assert tiny.leftovers(found) == []

    fail("groom.h5", size["groom"] // 2)
    fail("guides", size["groom"] + size["guides"] // 2)
    remount(f"size={size['groom'] + 8 * size['guides']}")  # its segments are there until it is whole
    tiny.run(outputs, "--until", "simulate")
    used = shutil.disk_usage(outputs).used
    fail("strands.h5", used + size["strands"] // 2)
    remount(f"size={used + size['strands'] + slack}")
    tiny.run(outputs, "--until", "interpolate")
    fail(".png", shutil.disk_usage(outputs).used + size["frames"] // 2)
    print(*told, sep="\n")
    remount("size=64m")
    tiny.assert_same(tiny.run(outputs), undisturbed)


def test_a_limit_on_the_size_of_files_is_told_as_a_full_disk(
    undisturbed: cache.Experiment, tmp_path: Path
) -> None:
    found = cache.Experiment(tmp_path / tiny.NAME)
    found.folder.mkdir()
    shutil.copy(undisturbed.groom, found.groom)
    line = tiny.command(tmp_path)
    limit = sizes(undisturbed)["guides"] // 2
    result = subprocess.run(
        line,
        cwd=tiny.ROOT,
        capture_output=True,
        text=True,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, resource.RLIM_INFINITY)),
    )
    assert result.returncode == 2
    assert "no room on the disk" in result.stderr.splitlines()[-1]
    assert tiny.damaged(found) == []
    assert tiny.leftovers(found) == []
    tiny.assert_same(tiny.run(tmp_path), undisturbed)


def test_a_read_only_folder_is_told_and_what_is_there_can_be_used(
    undisturbed: cache.Experiment, disk: Disk
) -> None:
    outputs, remount = disk
    found = cache.Experiment(outputs / tiny.NAME)
    remount("size=64m")
    shutil.copytree(undisturbed.folder, found.folder)
    remount("ro")
    tiny.run(outputs)  # all is fresh: nothing has to be written
    tiny.run(outputs, verb="status")
    tiny.assert_same(found, undisturbed)
    remount("rw")
    found.strands.unlink()
    remount("ro")
    print(refused(outputs, "Read-only file system"))
    remount("rw")
    tiny.assert_same(tiny.run(outputs), undisturbed)
