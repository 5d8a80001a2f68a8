"""Files that appear whole or not at all, whatever happens to the process, the disk or the power.

A file is written as `x.h5.tmp.<host>.<pid>`, flushed to the disk and renamed. A process that is killed
leaves its temporary file; the next run on the same host removes it.
"""

import errno
import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from pipeline.errors import InputError

_NOT_OURS = (errno.EROFS, errno.EACCES, errno.EPERM)
_NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Lend a temporary path; what was written there takes the place of `path` when the block succeeds.

    When the block fails, `path` is as it was and the temporary file is gone. A full disk is an InputError.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f"{path.name}.tmp.{socket.gethostname()}.{os.getpid()}")
    temporary.unlink(missing_ok=True)  # of a process of our number that is no more, as containers bring forth
    try:
        yield temporary
        sync(temporary)
        temporary.replace(path)
        sync(path.parent)
    except OSError as error:
        if no_room(error):
            raise disk_full(path) from error
        raise
    finally:
        temporary.unlink(missing_ok=True)


@contextmanager
def where_writable() -> Iterator[None]:
    """Leave out what only spares later runs some work, in a folder that may be read and not written."""
    try:
        yield
    except OSError as error:
        if error.errno not in _NOT_OURS:
            raise


def sync(path: Path) -> None:
    """Wait until a file or the names in a folder are on the disk."""
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def no_room(error: BaseException) -> bool:
    """Whether an error means that the disk, the quota or the allowed file size is used up."""
    return isinstance(error, OSError) and error.errno in _NO_ROOM


def disk_full(path: Path) -> InputError:
    """Say which file had no room, and what helps."""
    return InputError(
        f"{path}: no room on the disk for this file; nothing was lost: "
        "free some space (`ringlet plan` tells how much is needed) and run the same command again"
    )


def stale_files(folder: Path) -> list[Path]:
    """The temporary files of processes of this host that are no more."""
    return [path for path in folder.glob(f"*.tmp.{socket.gethostname()}.*") if not _alive(path)]


def remove_stale(folder: Path) -> list[Path]:
    """Remove these files; return their paths."""
    stale = stale_files(folder)
    for path in stale:
        path.unlink(missing_ok=True)
    return stale


def _alive(temporary: Path) -> bool:
    pid = temporary.name.rpartition(".")[2]
    if not pid.isdigit():
        return True
    try:
        os.kill(int(pid), 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True
