"""Stage 1, the groom: reads the config and what it names, writes groom.h5.

strands/points (S, P, 3) f32 [m]   rest shapes in the head's rest pose, equal spacing; any prefix is a valid groom
strands/normal (S, 3) f32          scalp normal at the root
strands/side (S,) i8, key (S,) u32
strands/held (S, P) u8             0 free, 1 held by the head, 2 by the hand
guides/strand (G,) u32             which strands are simulated, ascending
guides/offset (G, P) f32 [m]       distance that their points keep from the skin
head/points, triangles, normals, albedo, distance, origin, spacing     unless scene.head = "none"
body/points (F, V, 3) f32 [m], pose (F, 4, 4)     the head in motion, where there is scene.body (see body.py)
"""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pipeline import cache
from pipeline.config import Config, provenance
from pipeline.config.schema import Contact
from pipeline.groom.body import BodyFrame, body_frames
from pipeline.groom.guides import choose_guides, looked_at
from pipeline.groom.head_field import Field
from pipeline.groom.heads import Head, make_head
from pipeline.groom.procedural import Style
from pipeline.groom.swatch import swatch
from pipeline.progress import say, track
from pipeline.strands.held import read_held
from pipeline.strands.strands import Strands

_HELD_UP = 0.8  # part of its groomed distance from the skin that a guide keeps


def execute(config: Config, experiment: cache.Experiment, key: str) -> None:
    """Make the groom of a config. Raises InputError for a head or a groom file that cannot serve."""
    head = make_head(config)
    chunks, count, report = _source(config, head)
    with cache.create(experiment.groom, "groom", key, provenance(config, "groom")) as writer:
        if head is not None:
            _write_head(writer, head)
            _write_body(writer, body_frames(config, head))
        points, side = _write_strands(writer, chunks, count, looked_at(config.groom.guides))
        chosen = choose_guides(points, side, config.groom.guides)
        writer.write("guides/strand", chosen)
        writer.write(
            "guides/offset",
            contact_offset(config.simulate.contact, head.field if head else None, points[chosen]),
        )
        writer.meta["report"] = {"strands": count, "guides": len(chosen)} | report
    say("groom", f"{count} strands, {len(chosen)} guides")


def contact_offset(contact: Contact, field: Field | None, guides: NDArray[np.float32]) -> NDArray[np.float32]:
    """Distance [m] that guide points (G, P, 3) keep from the skin of distance `field`, (G, P).

    It is most of the groomed distance, up to `contact.layer`: the hair below holds a guide up. Points groomed below
    the skin are to come out of it to `contact.offset`. From point to point, and from the held root on, it changes at
    most half as fast as the strand is long: what cannot be reached without stretching has no solution.
    """
    if field is None:
        return np.full(guides.shape[:2], contact.offset, np.float32)
    groomed = field.distance(guides.reshape(-1, 3)).reshape(guides.shape[:2])
    offset = np.clip(_HELD_UP * groomed, 0, max(contact.layer, contact.offset))
    offset = np.where(groomed > 0, offset, contact.offset)
    offset[:, :2] = groomed[:, :2]
    step = 0.5 * np.linalg.norm(np.diff(guides, axis=1), axis=2).mean(axis=1)
    last = guides.shape[1] - 1
    for j in range(1, last + 1):
        offset[:, j] = np.minimum(offset[:, j], offset[:, j - 1] + step)
    for j in range(last - 1, 1, -1):
        offset[:, j] = np.minimum(offset[:, j], offset[:, j + 1] + step)
    return offset.astype(np.float32)


def _source(config: Config, head: Head | None) -> tuple[Iterable[Strands], int, dict[str, object]]:
    """The strands in chunks, their number, and what there is to report."""
    if config.groom.source == "swatch":
        return _pinned(config, [swatch(config)]), config.groom.strands, {}
    if config.groom.source == "procedural" and head is not None:
        style = Style(config, head)
        return _pinned(config, style.chunks()), len(style.roots), {}
    from pipeline.groom.imported import load

    strands, report = load(config, head)
    return [strands], len(strands), report


def _pinned(config: Config, chunks: Iterable[Strands]) -> Iterator[Strands]:
    """The chunks with points held as the file of pins says, if there is one."""
    if config.groom.pins is None:
        yield from chunks
        return
    held = read_held(Path(config.groom.pins), config.groom.strands, config.groom.points)
    begin = 0
    for strands in chunks:
        yield replace(strands, held=held[begin : begin + len(strands)])
        begin += len(strands)


def _write_strands(
    writer: cache.Writer, chunks: Iterable[Strands], count: int, kept: int
) -> tuple[NDArray[np.float32], NDArray[np.int8]]:
    """Stream the strands to the file; returns points and sides of the first `kept`, to choose guides from."""
    columns: dict[str, cache.columns.ColumnWriter] = {}
    points: list[NDArray[np.float32]] = []
    sides: list[NDArray[np.int8]] = []
    with track("groom", count, "strand") as bar:
        for strands in chunks:
            columns = columns or _columns(writer, strands.points.shape[1])
            for name, column in columns.items():
                column.append(getattr(strands, name))
            points.append(strands.points[:kept])
            sides.append(strands.side[:kept])
            kept -= len(points[-1])
            bar.advance(len(strands))
    return np.concatenate(points), np.concatenate(sides)


def _columns(writer: cache.Writer, points: int) -> dict[str, "cache.columns.ColumnWriter"]:
    layout: dict[str, tuple[tuple[int, ...], type]] = {
        "points": ((points, 3), np.float32),
        "normal": ((3,), np.float32),
        "side": ((), np.int8),
        "key": ((), np.uint32),
        "held": ((points,), np.uint8),
    }
    return {name: writer.stream(f"strands/{name}", shape, kind) for name, (shape, kind) in layout.items()}


def _write_head(writer: cache.Writer, head: Head) -> None:
    for name in ("points", "triangles", "normals", "albedo"):
        writer.write(f"head/{name}", getattr(head.skin, name))
    writer.write("head/distance", head.field.values)
    writer.write("head/origin", head.field.origin)
    writer.write("head/spacing", np.array([head.field.spacing]))


def _write_body(writer: cache.Writer, frames: Iterable[BodyFrame]) -> None:
    columns: dict[str, cache.columns.ColumnWriter] = {}
    count = 0
    for frame in frames:
        count += 1
        if not columns:
            columns["points"] = writer.stream("body/points", frame.points.shape, np.float32, chunk_rows=1)
            columns["pose"] = writer.stream("body/pose", (4, 4), np.float64)
        columns["points"].append(frame.points[None])
        columns["pose"].append(frame.pose[None])
    if count:
        say("groom", f"the head moves and deforms over {count} meshes")
