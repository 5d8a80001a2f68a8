import os
import resource
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from second_process import first_words, wants

from pipeline import cache
from pipeline.cache.atomic import remove_stale
from pipeline.errors import InputError

WRITE_FOREVER = """
import sys
from pathlib import Path
import numpy as np
from pipeline import cache
points = np.random.default_rng(0).normal(size=(20_000, 16, 3)).astype(np.float32)
for number in range(1_000_000):
    with cache.create(Path(sys.argv[1]), kind="groom", key=str(number)) as writer:
        writer.write("strands/points", points)
    print(number, flush=True)
"""

WRITE_BEYOND_LIMIT = """
import atexit, resource, sys
from pathlib import Path
import numpy as np
from pipeline import cache
from pipeline.errors import InputError
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[2]), resource.RLIM_INFINITY))
atexit.register(resource.setrlimit, resource.RLIMIT_FSIZE, (-1, -1))  # coverage writes a file of its own
try:
    with cache.create(Path(sys.argv[1]), kind="groom", key="new") as writer:
        writer.write("strands/points", np.random.default_rng(0).normal(size=(20_000, 16, 3)))
except InputError as error:
    print(error)
    sys.exit(2)
"""


def temporary_files(folder: Path) -> list[Path]:
    return list(folder.glob("*.tmp.*"))


def test_a_failed_write_leaves_what_was_there(tmp_path: Path) -> None:
    path = tmp_path / "groom.h5"
    with cache.create(path, kind="groom", key="old") as writer:
        writer.write("a", np.arange(3))
    with pytest.raises(RuntimeError, match="half way"), cache.create(path, kind="groom", key="new") as writer:
        writer.write("a", np.arange(5))
        raise RuntimeError("half way")
    with cache.open(path) as reader:
        assert reader.key == "old"
    assert temporary_files(tmp_path) == []


def test_kill_9_leaves_whole_files_or_none(tmp_path: Path) -> None:
    path = tmp_path / "groom.h5"
    whole = 0
    for delay in (0.0, 0.004, 0.013, 0.029, 0.05):
        process = subprocess.Popen(
            [sys.executable, "-c", WRITE_FOREVER, str(path)], stdout=subprocess.PIPE, text=True
        )
        assert process.stdout is not None
        if delay:
            process.stdout.readline()
        time.sleep(delay)
        process.send_signal(signal.SIGKILL)
        process.wait()
        process.stdout.close()
        if path.exists():
            with cache.open(path) as reader:
                reader.verify()
            whole += 1
    left = len(temporary_files(tmp_path))
    remove_stale(tmp_path)
    print(f"5 kills: {whole} whole files, {left} temporary files left and removed by the next run")
    assert whole >= 4
    assert temporary_files(tmp_path) == []


def test_temporary_files_of_living_processes_and_other_hosts_stay(tmp_path: Path) -> None:
    host = socket.gethostname()
    alive = tmp_path / f"groom.h5.tmp.{host}.{os.getpid()}"
    foreign = tmp_path / "groom.h5.tmp.elsewhere.1"
    dead = tmp_path / f"groom.h5.tmp.{host}.{_dead_process()}"
    for path in (alive, foreign, dead):
        path.touch()
    assert remove_stale(tmp_path) == [dead]
    assert sorted(tmp_path.iterdir()) == sorted([alive, foreign])


@pytest.mark.parametrize("limit", [0, 3000, 100_000, 1_000_000])
def test_full_disk_is_one_message_and_nothing_is_lost(tmp_path: Path, limit: int) -> None:
    path = tmp_path / "groom.h5"
    with cache.create(path, kind="groom", key="old") as writer:
        writer.write("a", np.arange(3))
    result = subprocess.run(
        [sys.executable, "-c", WRITE_BEYOND_LIMIT, str(path), str(limit)], capture_output=True, text=True
    )
    assert result.returncode == 2, result.stderr
    assert "no room on the disk" in result.stdout
    assert result.stdout.count("\n") == 1
    assert result.stderr == ""
    assert temporary_files(tmp_path) == []
    with cache.open(path) as reader:
        assert reader.key == "old"


def test_a_really_full_disk_is_told_too() -> None:
    """A file system of 1 MiB, where mounting one is allowed; the limit on file size above stands in elsewhere."""
    folder = Path("/dev/shm") if Path("/dev/shm").is_dir() else None
    if folder is None or os.geteuid() != 0:
        pytest.skip("mounting a small file system needs root")
    mount = folder / f"ringlet-test-{os.getpid()}"
    mount.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", "size=1m", "tmpfs", str(mount)]
    if subprocess.run(command, capture_output=True).returncode != 0:
        mount.rmdir()
        pytest.skip("mounting a small file system is not allowed here")
    try:
        points = np.random.default_rng(0).normal(size=(20_000, 16, 3))
        with (
            pytest.raises(InputError, match="no room on the disk"),
            cache.create(mount / "groom.h5", kind="groom", key="") as writer,
        ):
            writer.write("strands/points", points)
        assert list(mount.iterdir()) == []
    finally:
        subprocess.run(["umount", str(mount)], check=True)
        mount.rmdir()


def test_a_second_process_waits_for_the_first_and_says_so(tmp_path: Path) -> None:
    with cache.Experiment(tmp_path).working_on("groom"):
        process = wants("cache.Experiment(folder).working_on('groom')", tmp_path)
        assert f"waiting for process {os.getpid()}" in first_words(process)
    assert process.communicate(timeout=30)[0] == "in\n"


def _dead_process() -> int:
    process = subprocess.Popen(["true"])
    process.wait()
    return process.pid


def test_limits_of_this_process_are_untouched() -> None:
    assert resource.getrlimit(resource.RLIMIT_FSIZE)[0] == resource.RLIM_INFINITY
