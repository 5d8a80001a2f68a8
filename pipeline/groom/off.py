"""Meshes in OFF files: points and polygons; colours and normals behind them are passed over.

Own code, because meshio 5.3 refuses valid files: polygons that are no triangles, and comments behind what it expects.
Source: Geomview's manual, "OFF Files" (The Geometry Center, 1991 to 1996), the text form.
"""

from itertools import islice
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

_KINDS = ("OFF", "COFF", "NOFF", "CNOFF", "STOFF", "STCOFF", "STNOFF", "STCNOFF")


def read_off(path: Path) -> tuple[NDArray[np.float64], list[NDArray[np.int64]]]:
    """Points (V, 3) and runs of polygons (N, K); indices are not checked. Raises ValueError for a file that does not hold up."""
    text = path.read_bytes().decode(errors="replace")
    lines = (words for line in text.splitlines() if (words := line.partition("#")[0].split()))
    words = next(lines, [])
    if words and words[0] in _KINDS:
        words = words[1:] or next(lines, [])
    points_, faces = (int(word) for word in words[:2])
    if min(points_, faces) < 0:
        raise ValueError("fewer than no points or faces")
    points = [[float(word) for word in line[:3]] for line in islice(lines, points_)]
    if len(points) < max(points_, 1) or {len(point) for point in points} != {3}:
        raise ValueError("fewer points than it says, or not of three numbers")
    runs: list[list[list[int]]] = []
    for line in islice(lines, faces):
        size = int(line[0])
        face = [int(word) for word in line[1 : size + 1]] if size >= 0 else []
        if len(face) != size or any(abs(index) >= 1 << 31 for index in face):
            raise ValueError("a face of other points than it says")
        if not runs or len(runs[-1][0]) != size:
            runs.append([])
        runs[-1].append(face)
    if sum(map(len, runs)) < faces:
        raise ValueError("fewer faces than it says")
    return np.array(points), [np.array(run, np.int64).reshape(len(run), -1) for run in runs]
