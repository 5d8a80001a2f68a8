"""Stage 1, the groom: reads the config and what it names, writes groom.h5.

strands/points (S, P, 3) f32 [m]   rest shapes in the head's rest pose, equal spacing; any prefix is a valid groom
strands/normal (S, 3) f32          scalp normal at the root
strands/key (S,) u32
strands/held (S, P) u8             0 free, 1 held by the head, 2 by the hand
partings/...                       lines of the scalp that hair does not blend across (see cache/partings.py)
guides/strand (G,) u32             which strands are simulated, ascending
guides/offset (G, P) f32 [m]       distance that their points keep from the skin
head/points, triangles, normals, albedo, distance, origin, spacing     unless scene.head = "none"
head/placement (4,) f64            scale and offset [m] that lay the built-in head onto it
body/points (F, V, 3) f32 [m], pose (F, 4, 4)     the head in motion, where there is scene.body (see body.py)
"""

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline import cache
from pipeline.cache.partings import write_partings
from pipeline.config import Config, provenance
from pipeline.config.schema import Contact, Groom
from pipeline.groom.body import BodyFrame, body_frames
from pipeline.groom.guides import Choice, choose_guides, looked_at, shut_in
from pipeline.groom.head_field import Field
from pipeline.groom.heads import Head, make_head
from pipeline.groom.partings import partings_of
from pipeline.groom.procedural import Style
from pipeline.groom.swatch import swatch
from pipeline.progress import say, track
from pipeline.strands.held import read_held
from pipeline.strands.partings import Partings
from pipeline.strands.strands import Strands

_HELD_UP = 0.8  # part of its groomed distance from the skin that a guide keeps


def execute(config: Config, experiment: cache.Experiment, key: str) -> None:
    """Make the groom of a config. Raises InputError for a head or a groom file that cannot serve."""
    head = make_head(config)
    source = _source(config, head)
    with cache.create(experiment.groom, "groom", key, provenance(config, "groom")) as writer:
        if head is not None:
            _write_head(writer, head)
            _write_body(writer, body_frames(config, head))
        write_partings(writer, source.partings)
        points, roots, choice = _write_strands(writer, source, config.groom)
        more = shut_in(choice.strand, roots, source.partings)
        chosen = np.sort(np.concatenate([choice.strand, more]))
        writer.write("guides/strand", chosen)
        offset = contact_offset(
            config.simulate.contact, head.field if head else None, _guide_points(source, points, chosen)
        )
        writer.write("guides/offset", offset)
        writer.meta["report"] = (
            {"strands": source.count, "guides": len(chosen)} | choice.report | source.report
        )
    added = f", {len(more)} of them for hair that partings shut off from all others" if len(more) else ""
    say("groom", f"{source.count} strands, {len(chosen)} guides{added}; {choice}")


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


@dataclass(frozen=True)
class Source:
    """Where strands come from."""

    chunks: Iterable[Strands]
    count: int
    partings: Partings
    report: dict[str, object]
    strand: Callable[[int], Strands]
    """A single one of them."""


def _source(config: Config, head: Head | None) -> Source:
    if config.groom.source == "procedural" and head is not None:
        style = Style(config, head)
        chunks = _pinned(config, style.chunks())
        return Source(chunks, len(style.roots), style.partings, {}, lambda index: style.strands(index, 1))
    if config.groom.source == "swatch":
        strands, report = next(_pinned(config, [swatch(config)])), dict[str, Any]()
    else:
        from pipeline.groom.imported import load

        strands, report = load(config, head)
    partings = partings_of(config, head)
    return Source([strands], len(strands), partings, report, lambda index: strands[index : index + 1])


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
    writer: cache.Writer, source: Source, options: Groom
) -> tuple[NDArray[np.float32], NDArray[np.float32], Choice]:
    """Stream the strands to the file; returns points of the first ones, all roots, and the guides among the first.

    Guides are chosen while later strands are made.
    """
    columns: dict[str, cache.columns.ColumnWriter] = {}
    points: list[NDArray[np.float32]] = []
    roots: list[NDArray[np.float32]] = []
    kept = min(looked_at(options.guides), source.count)

    def chosen() -> Choice:
        return choose_guides(np.concatenate(points), options.guides, source.partings, options.guide_error)

    with ThreadPoolExecutor(1) as beside, track("groom", source.count, "strand") as bar:
        choice: Future[Choice] | None = None
        for strands in source.chunks:
            columns = columns or _columns(writer, strands.points.shape[1])
            for name, column in columns.items():
                column.append(getattr(strands, name))
            roots.append(strands.points[:, 0].copy())
            if choice is None:
                points.append(strands.points[:kept])
                kept -= len(points[-1])
                choice = None if kept else beside.submit(chosen)
            bar.advance(len(strands))
        assert choice is not None  # sources tell their count
        return np.concatenate(points), np.concatenate(roots), choice.result()


def _guide_points(
    source: Source, points: NDArray[np.float32], chosen: NDArray[np.uint32]
) -> NDArray[np.float32]:
    """Points (G, P, 3) of the guides; those beyond the first strands, of which all are kept, are made again."""
    beyond = [source.strand(int(index)).points for index in chosen[chosen >= len(points)]]
    return np.concatenate([points[chosen[chosen < len(points)]], *beyond])


def _columns(writer: cache.Writer, points: int) -> dict[str, "cache.columns.ColumnWriter"]:
    layout: dict[str, tuple[tuple[int, ...], type]] = {
        "points": ((points, 3), np.float32),
        "normal": ((3,), np.float32),
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
    writer.write("head/placement", np.array([head.scale, *head.offset]))


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
