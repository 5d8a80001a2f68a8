"""What this machine lets the process have: memory within every limit that is set on it, disk, and who says so."""

import resource
import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from pipeline.errors import InputError

GB = 1e9
_ADDRESSES_GB = {"groom": 0.75, "simulate": 0.3, "interpolate": 0.4, "render": 1.2}
"""What libraries map beyond what they use, which counts where addresses are limited (`ulimit -v`)."""
_BARE_START_GB = 0.5  # of addresses: interpreter and config
_LESS = {
    "groom": "groom.strands or groom.points",
    "simulate": "groom.guides or groom.points",
    "interpolate": "interpolate.strands",
    "render": "render.strands, render.size or render.samples",
}


@dataclass(frozen=True)
class Room:
    """Free memory [bytes], and what would end first."""

    free: float
    limit: str


def memory(stage: str = "groom", proc: Path = Path("/proc"), cgroups: Path = Path("/sys/fs/cgroup")) -> Room:
    """The least of what the machine has free and what the limits leave, for a stage."""
    return min(_rooms(stage, proc, cgroups), key=lambda room: room.free)


def disk(folder: Path) -> Room:
    """Room on the file system that `folder` is on or will be made on."""
    there = folder.absolute()
    while not there.exists():
        there = there.parent
    return Room(shutil.disk_usage(there).free, str(there))


def shortage(stage: str, need_gb: float) -> str | None:
    """Why a stage that is planned to need so much would be ended half way by the kernel, and what helps; or None."""
    room = memory(stage)
    if need_gb * GB <= room.free:
        return None
    return (
        f"{stage} needs {need_gb:.2f} GB of memory and {max(room.free, 0) / GB:.2f} GB are free ({room.limit}); "
        f"lower {_LESS[stage]}, give it more memory, or say --force to try it all the same"
    )


def refuse_bare_start() -> None:
    """Raise InputError when not even the config could be read within the limit on addresses."""
    most = resource.getrlimit(resource.RLIMIT_AS)[0]
    if most != resource.RLIM_INFINITY and most < _BARE_START_GB * GB:
        raise InputError(
            f"ringlet: addresses are limited to {most / GB:.2f} GB (ulimit -v); {_BARE_START_GB} GB are the least"
        )


def _rooms(stage: str, proc: Path, cgroups: Path) -> Iterator[Room]:
    lines = (proc / "meminfo").read_text().splitlines()
    free = next(int(line.split()[1]) * 1024 for line in lines if line.startswith("MemAvailable"))
    yield Room(free, "what the machine has free")
    most = resource.getrlimit(resource.RLIMIT_AS)[0]
    if most != resource.RLIM_INFINITY:
        yield Room(
            most - _ADDRESSES_GB[stage] * GB, f"addresses are limited to {most / GB:.2f} GB, ulimit -v"
        )
    yield from _cgroup_rooms(proc, cgroups)


def _cgroup_rooms(proc: Path, cgroups: Path) -> Iterator[Room]:
    """Of this process's control group and all above it, versions 1 and 2; file cache that can go counts as free."""
    try:
        entries = [line.split(":", 2) for line in (proc / "self/cgroup").read_text().splitlines()]
    except OSError:
        return
    for _, controllers, path in entries:
        if controllers == "":
            mount, names = cgroups, ("memory.max", "memory.current", "inactive_file")
        elif "memory" in controllers.split(","):
            mount = cgroups / "memory"
            names = ("memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file")
        else:
            continue
        inner = mount / path.lstrip("/")
        for folder in (inner, *inner.parents):
            if folder.is_relative_to(mount) and (room := _cgroup_room(folder, *names)):
                yield room


def _cgroup_room(folder: Path, limit: str, usage: str, idle: str) -> Room | None:
    try:
        most = (folder / limit).read_text().strip()
        used = int((folder / usage).read_text())
        stat = dict(line.split() for line in (folder / "memory.stat").read_text().splitlines())
    except (OSError, ValueError):
        return None
    if most == "max" or int(most) >= 1 << 60:
        return None
    return Room(int(most) - used + int(stat.get(idle, 0)), f"{folder / limit} is {int(most) / GB:.2f} GB")
