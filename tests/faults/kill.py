"""Kill runs at random moments of every stage, and see whether anything is damaged, lost or different afterwards.

    python tests/faults/kill.py --kills 50 [--seed 7] [--signal KILL|INT|TERM] [--folder DIR]

Half of the moments are anywhere in a stage, the other half while a file is being written. After each one every file
that is there has to be whole; every tenth time, and at the end, the run is finished and compared with one that nobody
disturbed. Prints one JSON object; exit code 1 when a file was damaged or a byte differs.
"""

import argparse
import json
import random
import signal
import sys
import tempfile
import time
from dataclasses import asdict, dataclass, field
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
import tiny

from pipeline import cache

STAGES = ("groom", "simulate", "interpolate", "render")
_COMPARED_EVERY = 10
_NEVER_S = 120.0
_LATE = 20  # signals that may come too late: how long a stage takes depends on what else the machine does


@dataclass
class Found:
    """What a campaign has found."""

    kills: int = 0
    too_late: int = 0
    """Times that the run was over before the signal."""
    in_stage: dict[str, int] = field(default_factory=dict)
    while_writing: int = 0
    """Kills that left a temporary file."""
    checked_files: int = 0
    damaged: list[str] = field(default_factory=list)
    wrong_ends: list[str] = field(default_factory=list)
    """Exit codes and messages that a stopped run should not have."""
    compared: int = 0


def campaign(
    undisturbed: cache.Experiment, folder: Path, kills: int, seed: int, number: signal.Signals
) -> Found:
    """Disturb one experiment again and again; raises AssertionError when its output differs."""
    rng = random.Random(seed)
    seconds = tiny.stage_seconds(undisturbed)
    victim = cache.Experiment(folder / "victim" / tiny.NAME)
    found = Found()
    while found.kills < kills and found.too_late < kills + _LATE:
        stage = STAGES[(seed + found.kills + found.too_late) % len(STAGES)]
        tiny.discard(victim, stage)
        if not _disturb(victim, stage, seconds[stage], rng, number, found):
            found.too_late += 1
            seconds[stage] *= 0.6  # the undisturbed run was slower
            continue
        found.kills += 1
        found.in_stage[stage] = found.in_stage.get(stage, 0) + 1
        found.while_writing += bool(tiny.leftovers(victim))
        found.damaged += tiny.damaged(victim)
        found.checked_files += sum(path.suffix in (".h5", ".png") for path in victim.folder.rglob("*"))
        if found.kills % _COMPARED_EVERY == 0 or found.kills == kills:
            tiny.assert_same(tiny.run(folder / "victim"), undisturbed)
            found.compared += 1
    return found


def _disturb(
    victim: cache.Experiment,
    stage: str,
    seconds: float,
    rng: random.Random,
    number: signal.Signals,
    found: Found,
) -> bool:
    """Start a run and send the signal in this stage; False when it was too late."""
    process = tiny.start(victim.folder.parent)
    assert process.stderr is not None
    for line in process.stderr:
        if line.startswith(f"{stage}: start"):
            break
    if rng.random() < 0.5:
        time.sleep(rng.uniform(0, seconds))
    else:
        _wait_for_a_write(victim, process.poll)
        time.sleep(rng.uniform(0, 0.02))
    process.send_signal(number)
    _, said = process.communicate(timeout=_NEVER_S)
    if process.returncode == 0:
        return False
    if number is signal.SIGKILL:
        right = process.returncode == -signal.SIGKILL
    else:
        last = said.splitlines()[-1] if said else ""
        right = process.returncode == 128 + number and last.startswith(f"ringlet: stopped by {number.name}")
        right = right and "Traceback" not in said and "Exception" not in said
    if not right:
        found.wrong_ends.append(f"{stage}: exit code {process.returncode}: {said}")
    return True


def _wait_for_a_write(victim: cache.Experiment, ended: object) -> None:
    end = time.monotonic() + _NEVER_S
    assert callable(ended)
    while time.monotonic() < end and ended() is None and not tiny.leftovers(victim):
        time.sleep(0.001)


def main() -> int:
    """Run a campaign and print what it found."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--kills", type=int, default=50)
    parser.add_argument("--seed", type=int, default=7)
    parser.add_argument("--signal", choices=("KILL", "INT", "TERM", "HUP"), default="KILL")
    parser.add_argument("--folder", type=Path)
    wanted = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        number = signal.Signals[f"SIG{wanted.signal}"]
        folder = wanted.folder or Path(scratch)
        undisturbed = tiny.run(folder / "undisturbed")
        found = campaign(undisturbed, folder, wanted.kills, wanted.seed, number)
    print(json.dumps(asdict(found), indent=2))
    return 1 if found.damaged or found.wrong_ends or found.kills < wanted.kills else 0


if __name__ == "__main__":
    sys.exit(main())
