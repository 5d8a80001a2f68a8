"""Runs that are killed or stopped at random moments of every stage: nothing damaged, nothing lost, the same output.

tests/faults/kill.py does the same for as long as one likes.
"""

import signal
from pathlib import Path

import pytest
from kill import campaign

from pipeline import cache


@pytest.mark.parametrize(
    ("number", "kills", "seed"),
    [(signal.SIGKILL, 4, 11), (signal.SIGINT, 2, 3), (signal.SIGTERM, 2, 5)],
    ids=["SIGKILL", "SIGINT", "SIGTERM"],
)
def test_whatever_ends_a_run_the_next_one_goes_on(
    undisturbed: cache.Experiment, tmp_path: Path, number: signal.Signals, kills: int, seed: int
) -> None:
    found = campaign(undisturbed, tmp_path, kills, seed, number)
    print(
        f"{found.kills} x {number.name}, {found.while_writing} while writing; {found.checked_files} files whole"
    )
    assert found.kills == kills
    assert found.damaged == []
    assert found.wrong_ends == []
    assert found.compared > 0
