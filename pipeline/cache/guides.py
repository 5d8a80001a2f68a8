"""guides.h5: the guides of every frame as temporal VTKHDF PolyData, which ParaView opens as an animation.

Topology is stored once. Points holds the frames one after the other, a chunk for each, so that a frame is
read and verified without its neighbours. Layout: VTKHDF 2.0, "PolyData", group Steps. Next to it:

    pose (F, 4, 4) float64          head rest -> world
    diagnostics/<name> (F,) float64
    before/points (F (N-1) G P, 3) float32 [m], before/pose (F (N-1), 4, 4): where a simulation keeps N > 1 states of a
    frame, those on the way to it, the earliest first
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pipeline.cache.columns import Column, Damaged
from pipeline.cache.store import Reader, Writer, create, open

KIND = "guides"
_TOPOLOGIES = ("Vertices", "Lines", "Polygons", "Strips")


class GuidesWriter:
    """Appends frames to guides.h5; `create_guides` makes one."""

    def __init__(self, writer: Writer, guides: int, points: int, fps: float) -> None:
        self.meta = writer.meta
        self._writer, self._shape, self._fps = writer, (guides, points, 3), fps
        self._frames = 0
        self._points = writer.stream("VTKHDF/Points", (3,), np.float32, chunk_rows=guides * points)
        self._pose = writer.stream("pose", (4, 4), np.float64)
        self._diagnostics: dict[str, Any] = {}
        writer.meta |= {"guides": guides, "points": points, "fps": fps}
        _set_type(writer)

    def append(
        self,
        points: ArrayLike,
        pose: ArrayLike,
        diagnostics: Mapping[str, float] | None = None,
        before: Sequence[tuple[ArrayLike, ArrayLike]] = (),
    ) -> None:
        """Append one frame: points (G, P, 3) float32 [m] in world space, pose (4, 4), figures of the frame.

        `before` are points and poses on the way to it. Every frame must name the same diagnostics and have as many
        states before it; raises ValueError for those and for wrong shapes.
        """
        frame = self._checked(points)
        figures = diagnostics or {}
        if self._frames == 0:
            self._diagnostics = {
                name: self._writer.stream(f"diagnostics/{name}", (), np.float64) for name in figures
            }
            self._states(1 + len(before))
        if len(before) != self._writer.meta.get("states", 1) - 1:
            raise ValueError(
                f"guides: a frame has {len(before)} states before it, the first has another number"
            )
        if figures.keys() != self._diagnostics.keys():
            raise ValueError(f"guides: expected the diagnostics {', '.join(self._diagnostics)}")
        self._points.append(frame.reshape(-1, 3))
        self._pose.append(np.asarray(pose, np.float64)[None])
        for state, state_pose in before:
            self._before_points.append(self._checked(state).reshape(-1, 3))
            self._before_pose.append(np.asarray(state_pose, np.float64)[None])
        for name, value in figures.items():
            self._diagnostics[name].append([float(value)])
        self._frames += 1

    def finish(self) -> None:
        """Write topology and steps, now that the number of frames is known."""
        guides, points, _ = self._shape
        self._writer.meta["frames"] = self._frames
        self._write("NumberOfPoints", [guides * points])
        for name in _TOPOLOGIES:
            cells = guides if name == "Lines" else 0
            self._write(f"{name}/NumberOfCells", [cells])
            self._write(f"{name}/NumberOfConnectivityIds", [cells * points])
            self._write(f"{name}/Offsets", np.arange(cells + 1) * points)
            self._write(f"{name}/Connectivity", np.arange(cells * points))
        frames = self._frames
        self._writer.write("VTKHDF/Steps/Values", np.arange(frames) / self._fps)
        self._write("Steps/PointOffsets", np.arange(frames) * guides * points)
        self._write("Steps/PartOffsets", np.zeros(frames))
        self._write("Steps/NumberOfParts", np.ones(frames))
        self._write("Steps/CellOffsets", np.zeros((frames, len(_TOPOLOGIES))))
        self._write("Steps/ConnectivityIdOffsets", np.zeros((frames, len(_TOPOLOGIES))))
        self._writer.file["VTKHDF"].require_group("Steps").attrs["NSteps"] = frames

    def _checked(self, points: ArrayLike) -> NDArray[np.float32]:
        frame = np.asarray(points, np.float32)
        if frame.shape != self._shape:
            raise ValueError(f"guides: expected a frame of shape {self._shape}, got {frame.shape}")
        return frame

    def _states(self, count: int) -> None:
        """Prepare for frames of `count` states; a file of one state each is none the wiser."""
        if count == 1:
            return
        rows = self._shape[0] * self._shape[1]
        self._writer.meta["states"] = count
        self._before_points = self._writer.stream("before/points", (3,), np.float32, chunk_rows=rows)
        self._before_pose = self._writer.stream("before/pose", (4, 4), np.float64)

    def _write(self, name: str, values: ArrayLike) -> None:
        self._writer.write(f"VTKHDF/{name}", np.asarray(values).astype(np.int64))


def _set_type(writer: Writer) -> None:
    group = writer.file.require_group("VTKHDF")
    group.attrs["Version"] = (2, 0)
    group.attrs["Type"] = np.bytes_("PolyData")


class GuidesReader:
    """The guides of a finished simulation, frame by frame."""

    def __init__(self, reader: Reader) -> None:
        self.key, self.meta, self.provenance = reader.key, reader.meta, reader.provenance
        self.guides, self.points = int(reader.meta["guides"]), int(reader.meta["points"])
        self.frames, self.fps = int(reader.meta["frames"]), float(reader.meta["fps"])
        self._points, self._pose = reader["VTKHDF/Points"], reader["pose"]
        if len(self._points) != self.frames * self.guides * self.points or len(self._pose) != self.frames:
            raise Damaged(reader.path, "the number of frames does not fit the points")
        self.states = int(reader.meta.get("states", 1))
        if self.states > 1:
            self._before_points, self._before_pose = reader["before/points"], reader["before/pose"]
            if len(self._before_pose) != self.frames * (self.states - 1):
                raise Damaged(reader.path, "the number of states does not fit the frames")
        self.diagnostics: dict[str, NDArray[np.float64]] = {
            name.removeprefix("diagnostics/"): reader[name][:]
            for name in reader.names
            if name.startswith("diagnostics/")
        }

    def frame(self, index: int) -> NDArray[np.float32]:
        """Points (G, P, 3) float32 [m] of a frame, counted from 0; raises IndexError, or Damaged."""
        return self._rows(self._points, range(self.frames)[index])

    def pose(self, index: int) -> NDArray[np.float64]:
        """Head rest -> world (4, 4) float64 of a frame."""
        return self._pose[index]

    def state(self, index: int, back: int) -> tuple[NDArray[np.float32], NDArray[np.float64]]:
        """Points and pose of a frame's state `back` states before the frame itself; raises IndexError, or Damaged."""
        if back == 0:
            return self.frame(index), self.pose(index)
        if not 0 < back < self.states:
            raise IndexError(f"{back} states before a frame of {self.states}")
        at = (range(self.frames)[index] + 1) * (self.states - 1) - back
        return self._rows(self._before_points, at), self._before_pose[at]

    def _rows(self, column: Column, frame: int) -> NDArray[np.float32]:
        size = self.guides * self.points
        return column[frame * size : (frame + 1) * size].reshape(self.guides, self.points, 3)


@contextmanager
def create_guides(
    path: Path, key: str, provenance: dict[str, Any] | None = None, *, guides: int, points: int, fps: float
) -> Iterator[GuidesWriter]:
    """Write guides.h5, as `create` does: whole or not at all."""
    with create(path, KIND, key, provenance) as writer:
        frames = GuidesWriter(writer, guides, points, fps)
        yield frames
        frames.finish()


@contextmanager
def open_guides(path: Path) -> Iterator[GuidesReader]:
    """Open guides.h5; raises Missing or Damaged, as `open` does."""
    with open(path, KIND) as reader:
        yield GuidesReader(reader)
