"""Stage 3, the binding of all strands to the guides: reads groom.h5, writes strands.h5.

Points of strands are never stored: whoever needs them expands them, frame by frame and chunk by chunk
(`pipeline.strands.expand`).
"""

from collections.abc import Iterator
from dataclasses import fields

import numpy as np

from pipeline import cache
from pipeline.cache.expansion import distance_field
from pipeline.cache.partings import read_partings
from pipeline.config import Config, provenance
from pipeline.interpolate.bind import CHUNK, Groom, bind
from pipeline.interpolate.copies import Roots
from pipeline.progress import say
from pipeline.strands.expand import Binding
from pipeline.strands.follow import GuideSet, shape_of
from pipeline.strands.partings import Neighbours


def execute(config: Config, experiment: cache.Experiment, key: str) -> None:
    """Bind the strands of groom.h5, and copies of them up to the count asked for, and write strands.h5.

    Raises Missing or Damaged (InputErrors).
    """
    with (
        cache.open(experiment.groom, kind="groom") as reader,
        cache.create(experiment.strands, "strands", key, provenance(config, "interpolate")) as writer,
    ):
        groom = read_groom(reader)
        count = write(writer, bind(groom, config.interpolate, config.seed))
        copies = max(0, count - len(groom))
        writer.meta |= {"strands": count, "copies": copies, "guides": len(groom.guides.strand)}
    say(
        "interpolate",
        f"{count:,} strands ({copies:,} of them copies) follow {len(groom.guides.strand):,} guides",
    )


def read_groom(reader: cache.Reader) -> Groom:
    """What binding needs of an open groom.h5; its points stay in the file."""
    points = reader["strands/points"]
    root = np.concatenate([points[a : a + CHUNK][:, 0] for a in range(0, points.shape[0], CHUNK)])
    strand, partings = reader["guides/strand"][:], read_partings(reader)
    guides = GuideSet(
        roots=Neighbours(root[strand].astype(np.float64), partings),
        shape=shape_of(points[strand]),
        strand=strand,
    )
    return Groom(
        rows=lambda a, b: points[a:b],
        roots=Roots(root.astype(np.float64), partings, distance_field(reader)),
        key=reader["strands/key"][:],
        guides=guides,
    )


def write(writer: cache.Writer, chunks: Iterator[Binding]) -> int:
    """Write the columns of a binding, a chunk at a time; returns the number of strands."""
    columns = {}
    count = 0
    for chunk in chunks:
        for field in fields(Binding):
            rows = getattr(chunk, field.name)
            if count == 0:
                columns[field.name] = writer.stream(f"strands/{field.name}", rows.shape[1:], rows.dtype)
            columns[field.name].append(rows)
        count += len(chunk)
    return count
