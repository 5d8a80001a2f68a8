"""How fast a head of hair is groomed: the whole stage, from the head's mesh to groom.h5."""

from pathlib import Path
from typing import Any

from pipeline.bench.command import timed


def bench(config: Path, strands: int) -> dict[str, Any]:
    """Groom so many strands of a config by all of its operators.

    Returns seconds of the stage, microseconds_per_strand, peak_rss_gb of the process and seconds_in_all, from its start.
    """
    run = timed("groom", config, "-s", f"groom.strands={strands}")
    (seconds,) = run.ends("groom")
    return {
        "seconds": round(seconds, 2),
        "microseconds_per_strand": round(1e6 * seconds / strands, 2),
        "peak_rss_gb": run.peak_gb,
        "seconds_in_all": round(run.seconds, 2),
    }
