"""Partings in groom.h5: whoever binds strands to guides asks them.

partings/points (N, 2) f64     chart points of all lines, line by line
partings/count (L,) i64        how many of them each line has
partings/center (3,) f64 [m], axes (3, 3) f64     the chart; see `pipeline.strands.chart`
"""

import numpy as np

from pipeline.cache.columns import Damaged
from pipeline.cache.store import Reader, Writer
from pipeline.strands.chart import Chart
from pipeline.strands.partings import Partings


def write_partings(writer: Writer, partings: Partings) -> None:
    """Store partings and their chart."""
    writer.write("partings/points", np.concatenate([np.zeros((0, 2)), *partings.lines]))
    writer.write("partings/count", np.array([len(line) for line in partings.lines], np.int64))
    writer.write("partings/center", partings.chart.center)
    writer.write("partings/axes", partings.chart.axes)


def read_partings(reader: Reader) -> Partings:
    """The partings of groom.h5; raises Damaged."""
    points, count = reader["partings/points"][:], reader["partings/count"][:]
    if count.sum() != len(points) or (count < 2).any():
        raise Damaged(reader.path, "the lines of its partings do not fit their points")
    lines = np.split(points, np.cumsum(count)[:-1]) if len(count) else []
    return Partings(Chart(reader["partings/center"][:], reader["partings/axes"][:]), tuple(lines))
