"""Segments: what a long simulation has done so far, so that it goes on where it was killed.

Every N frames the simulation leaves one file, `guides.segments/<first frame>.h5`, with these frames and a
checkpoint: whatever arrays it needs to go on exactly. Segments appear whole or not at all; one that is
damaged, or made from other inputs, is removed together with all later ones, and computed again.
"""

import shutil
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.cache.columns import Damaged
from pipeline.cache.guides import create_guides
from pipeline.cache.store import Reader, create, open
from pipeline.errors import InputError

KIND = "segment"


@dataclass(frozen=True)
class Frame:
    """One simulated frame: points (G, P, 3) float32 [m] in world space, pose (4, 4) float64, figures."""

    points: NDArray[np.float32]
    pose: NDArray[np.float64]
    diagnostics: Mapping[str, float] = field(default_factory=dict)
    before: Sequence[tuple[NDArray[np.float32], NDArray[np.float64]]] = ()
    """Points and pose of the states on the way to it, the earliest first, that are kept."""


class Segments:
    """The segments of one simulation, beside its guides.h5.

    segments = Segments(experiment.guides, key)
    done, checkpoint = segments.resume()              # (0, None) at the first start
    segments.append(frames, checkpoint)               # every N frames
    segments.merge(provenance, fps)                   # writes guides.h5, removes the segments
    """

    def __init__(self, guides_file: Path, key: str) -> None:
        self.guides_file, self.key = guides_file, key
        self.folder = guides_file.with_suffix(".segments")
        self._done = 0

    def resume(self) -> tuple[int, dict[str, NDArray[Any]] | None]:
        """Number of frames done and the checkpoint after them; removes what does not continue them whole."""
        self._done, checkpoint = 0, None
        for path in sorted(self.folder.glob("*.h5")):
            segment = self._whole(path) if path == self._path() else None
            if segment is None:
                path.unlink()
            else:
                count, checkpoint = segment
                self._done += count
        return self._done, checkpoint

    def count(self) -> int:
        """Number of frames that `resume` would find done; changes nothing."""
        done = 0
        while (segment := self._whole(self.folder / f"{done:08d}.h5")) and segment[0] > 0:
            done += segment[0]
        return done

    def append(self, frames: Sequence[Frame], checkpoint: Mapping[str, NDArray[Any]]) -> None:
        """Store the next frames and the state after the last of them, arrays of any shape; call `resume` first."""
        with create(self._path(), KIND, self.key) as writer:
            writer.write("points", np.stack([frame.points for frame in frames]), chunk_rows=1)
            writer.write("pose", np.stack([frame.pose for frame in frames]))
            if frames[0].before:
                points, poses = zip(*(state for frame in frames for state in frame.before), strict=True)
                writer.write("before/points", np.stack(points), chunk_rows=1)
                writer.write("before/pose", np.stack(poses))
            for name, array in checkpoint.items():
                writer.write(f"checkpoint/{name}", np.asarray(array)[None])
            writer.meta["count"] = len(frames)
            writer.meta["diagnostics"] = [dict(frame.diagnostics) for frame in frames]
        self._done += len(frames)

    def frames(self) -> Iterator[Frame]:
        """All frames stored so far, in order, one segment in memory at a time."""
        for path in sorted(self.folder.glob("*.h5")):
            with open(path, KIND) as reader:
                yield from _frames(reader)

    def merge(self, provenance: dict[str, Any], fps: float) -> None:
        """Write all frames into guides.h5, then remove the segments."""
        frames = self.frames()
        first = next(frames)
        guides, points, _ = first.points.shape
        with create_guides(
            self.guides_file, self.key, provenance, guides=guides, points=points, fps=fps
        ) as writer:
            for frame in chain([first], frames):
                writer.append(frame.points, frame.pose, frame.diagnostics, frame.before)
        self.remove()

    def remove(self) -> None:
        """Forget everything."""
        shutil.rmtree(self.folder, ignore_errors=True)

    def _path(self) -> Path:
        return self.folder / f"{self._done:08d}.h5"

    def _whole(self, path: Path) -> tuple[int, dict[str, NDArray[Any]]] | None:
        try:
            with open(path, KIND) as reader:
                if reader.key != self.key:
                    return None
                reader.verify()
                return int(reader.meta["count"]), _checkpoint(reader)
        except InputError:  # damaged, or not a segment: computed again
            return None


def _checkpoint(reader: Reader) -> dict[str, NDArray[Any]]:
    names = [name for name in reader.names if name.startswith("checkpoint/")]
    return {name.removeprefix("checkpoint/"): reader[name][0] for name in names}


def _frames(reader: Reader) -> Iterator[Frame]:
    points, poses, figures = reader["points"], reader["pose"][:], reader.meta["diagnostics"]
    if len(poses) != len(figures):
        raise Damaged(reader.path, "the number of frames does not fit the diagnostics")
    states, state_poses = (
        reader[f"before/{name}"] if "before/pose" in reader else () for name in ("points", "pose")
    )
    each = len(state_poses) // len(poses)
    for index, diagnostics in enumerate(figures):
        before = [(states[k], state_poses[k]) for k in range(index * each, (index + 1) * each)]
        yield Frame(points[index], poses[index], diagnostics, before)
