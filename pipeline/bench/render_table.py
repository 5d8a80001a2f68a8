"""What frames cost in all: strands, geometries, threads and chunks, and a whole run from nothing.

Every row is measured in a process of its own, so that its peak of memory is its own.
"""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pipeline.bench import command

_COUNTS = (10_000, 30_000, 100_000, 300_000, 1_000_000)
_SPLIT = 100_000


@dataclass(frozen=True)
class Row:
    """A figure of rendering; the picture's digest is equal where the frame is the same."""

    what: str
    seconds: float
    peak_rss_gb: float
    picture: str


def table(config: Path | None, most: int = _COUNTS[-1]) -> dict[str, Any]:
    """Measure frames of up to `most` strands, the same frame in other ways, and where given all stages of a config.

    Returns rows, exponent (slope of log(time) over log(strands): 1 is linear) and equal, whether the frames that should
    be the same are.
    """
    counts = [count for count in _COUNTS if count <= most]
    rows = [_row(f"{count:,} strands", "--strands", count) for count in counts]
    slope = (
        np.polyfit(np.log(counts), np.log([row.seconds for row in rows]), 1)[0] if len(counts) > 1 else 1.0
    )
    split = min(_SPLIT, most)
    same = [row for row in rows if row.what == f"{split:,} strands"]
    same.append(_row(f"{split:,} strands, 1 thread", "--strands", split, "--threads", 1))
    same.append(_row(f"{split:,} strands, chunks of 5,000", "--strands", split, "--chunk", 5000))
    tubes = _row(f"{split:,} strands as tubes", "--strands", split, "--geometry", "tubes", "--frames", 1)
    rows += [*same[-2:], tubes]
    if config is not None:
        rows.append(_whole(config))
    return {
        "rows": [asdict(row) for row in rows],
        "exponent": round(float(slope), 3),
        "equal": len({row.picture for row in same}) == 1,
    }


def _row(what: str, *options: object) -> Row:
    found = command.figures("render", *options)
    return Row(what, found["seconds_per_frame"], found["peak_rss_gb"], found["picture"])


def _whole(config: Path) -> Row:
    """All stages of a config, from nothing to its frames."""
    run = command.timed("run", config)
    return Row(f"{config.name}, all stages", round(run.seconds, 1), run.peak_gb, "")
