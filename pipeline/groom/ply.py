"""Meshes in PLY files, text or binary: points, polygons, texture coordinates and numbers on the points.

Numbers of a text are taken as doubles one after the other, so that both kinds are rows of memory. Rows with lists come
in runs of one shape; most files are a single run.
Own code, because libraries get valid files wrong (test_mesh_files.py): meshio 5.3 reads bytes of binary files as signed
and unscaled (a colour of 255 is -1), and loses all numbers where faces have other numbers; VTK 9 loses the faces behind
an element that is neither.
Source: Turk, "The PLY Polygon File Format" (1994).
"""

import warnings
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Rows = NDArray[Any]

_BYTES = {"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4"}
_BITS = {"int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4"}
_KINDS = _BYTES | _BITS | {"float": "f4", "double": "f8", "float32": "f4", "float64": "f8"}
_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_TEXTURE = (("u", "v"), ("s", "t"), ("texture_u", "texture_v"))
_FIRST_RUN = 64  # rows that are looked at first; twice as many each time that all are alike


@dataclass(frozen=True)
class Ply:
    """What a file has on points and faces; indices are not checked."""

    points: NDArray[np.float64]
    """(V, 3)"""
    polygons: list[NDArray[np.int64]]
    """(N, K) each: runs of polygons of K points."""
    uv: NDArray[np.float32] | None
    """(V, 2) texture coordinates; points on seams are there more than once."""
    numbers: dict[str, Rows]
    """(V,) by name, of the file's own types."""


@dataclass(frozen=True)
class _Property:
    name: str
    kind: str
    count: str = ""
    """Kind of the number before a list; empty of a single number."""


@dataclass
class _Element:
    name: str
    rows: int
    properties: list[_Property] = field(default_factory=list)


def read_ply(path: Path) -> Ply:
    """Read a file. Raises ValueError for one that does not hold up."""
    data = path.read_bytes()
    order, elements, at = _header(data)
    if not order:
        data, at = _text_numbers(data[at:]), 0
    found: dict[str, list[Rows]] = {}
    for element in elements:
        if element.properties:
            found[element.name] = list(_runs(data, at, order, element))
            at += sum(run.nbytes for run in found[element.name])
    if not found.get("vertex"):
        raise ValueError("no points")
    vertex = np.concatenate(found["vertex"])
    kinds = {p.name: p.kind for e in elements if e.name == "vertex" for p in e.properties if not p.count}
    if not {"x", "y", "z"} <= kinds.keys():
        raise ValueError("points without x, y and z")
    points = np.stack([vertex[axis].astype(np.float64) for axis in "xyz"], axis=1)
    numbers = {n: _as_kind(vertex[n], kind) for n, kind in kinds.items() if n not in ("x", "y", "z")}
    uv = next((_pair(numbers, *names) for names in _TEXTURE if numbers.keys() >= set(names)), None)
    return _with_corners(Ply(points, [], uv, numbers), found.get("face", []))


def _header(data: bytes) -> tuple[str, list[_Element], int]:
    """Order of bytes (empty: text), elements, and where their rows begin."""
    end = data.find(b"end_header")
    begin = data.find(b"\n", end) + 1
    if not data.startswith(b"ply") or end < 0 or begin == 0:
        raise ValueError("no header of a PLY file")
    order, elements = None, list[_Element]()
    for line in data[:end].decode(errors="replace").splitlines()[1:]:
        match line.split():
            case ["format", kind, *_] if kind in _ORDERS:
                order = _ORDERS[kind]
            case ["element", name, rows] if rows.isdecimal():
                elements.append(_Element(name, int(rows)))
            case ["property", "list", count, kind, name] if elements and {count, kind} <= _KINDS.keys():
                elements[-1].properties.append(_Property(name, _KINDS[kind], _KINDS[count]))
            case ["property", kind, name] if elements and kind in _KINDS:
                elements[-1].properties.append(_Property(name, _KINDS[kind]))
            case ["comment" | "obj_info", *_] | []:
                pass
            case _:
                raise ValueError(f"a line of the header cannot be read: {line[:60]}")
    names = [(e.name, p.name) for e in elements for p in e.properties]
    if order is None or len(set(names)) < len(names):
        raise ValueError("no format, or two properties of one name")
    return order, elements, begin


def _text_numbers(text: bytes) -> bytes:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            return np.fromstring(text.decode("ascii"), np.float64, sep=" ").tobytes()
        except Warning:
            raise ValueError("something that is no number among the numbers") from None


def _runs(data: bytes, at: int, order: str, element: _Element) -> Iterator[Rows]:
    """Rows of an element as records, in runs of one shape. A list's count is the field `#name`."""
    left = element.rows
    lists = ["#" + p.name for p in element.properties if p.count]
    while left:
        shape = _shape(data, at, order, element)
        room = min(left, (len(data) - at) // shape.itemsize)
        if room < (1 if lists else left):
            raise ValueError(f"ends within {element.name}")
        size = min(room, _FIRST_RUN) if lists else room
        while True:
            rows = np.frombuffer(data, shape, size, at)
            same = np.all([rows[name] == rows[name][0] for name in lists], axis=0) if lists else np.True_
            if size == room or not same.all():
                break
            size = min(room, 2 * size)
        rows = rows if same.all() else rows[: int(np.argmin(same))]
        yield rows
        left -= len(rows)
        at += rows.nbytes


def _shape(data: bytes, at: int, order: str, element: _Element) -> "np.dtype[np.void]":
    """How the row that begins at a byte lies in memory."""
    fields: list[tuple[Any, ...]] = []
    for each in element.properties:
        kind, counted = (order + each.kind, order + each.count) if order else ("<f8", "<f8")
        if not each.count:
            fields.append((each.name, kind))
            continue
        begin = at + np.dtype(fields).itemsize if fields else at
        if begin + np.dtype(counted).itemsize > len(data):
            raise ValueError(f"ends within {element.name}")
        count = np.frombuffer(data, counted, 1, begin)[0]
        if not 0 <= count <= len(data) or count != int(count):
            raise ValueError(f"a list of {count} numbers")
        fields += [("#" + each.name, counted), (each.name, kind, (int(count),))]
    return np.dtype(fields)


def _as_kind(column: Rows, kind: str) -> Rows:
    """The numbers as the file declares them, where they came as a text."""
    wanted = np.dtype(kind)
    if wanted.kind != "f":
        bounds = np.iinfo(wanted)
        if not ((column >= bounds.min) & (column <= bounds.max)).all():
            raise ValueError(f"a number that is not among those of {wanted.name}")
    return np.ascontiguousarray(column, wanted)


def _pair(numbers: dict[str, Rows], u: str, v: str) -> NDArray[np.float32]:
    return np.stack([numbers[u], numbers[v]], axis=1).astype(np.float32)


def _with_corners(ply: Ply, runs: list[Rows]) -> Ply:
    """The file with its polygons; with points of seams once for each pair of coordinates that corners give them."""
    polygons, corners = list[NDArray[np.int64]](), list[NDArray[np.float32]]()
    for run in runs:
        names = run.dtype.names or ()
        given = next((run[name] for name in ("vertex_indices", "vertex_index") if name in names), None)
        if given is None or given.ndim < 2:
            raise ValueError("faces without vertex_indices")
        if not (np.abs(given) < 2**31).all():
            raise ValueError("a face names a point that cannot be")
        polygons.append(given.astype(np.int64))
        if "texcoord" in names and run["texcoord"].shape[1:] == (2 * given.shape[1],):
            corners.append(run["texcoord"].astype(np.float32).reshape(-1, 2))
    flat = np.concatenate([np.zeros(0, np.int64), *(each.ravel() for each in polygons)])
    if not corners or sum(map(len, corners)) != len(flat) or flat.min() < 0 or flat.max() >= len(ply.points):
        return Ply(ply.points, polygons, ply.uv, ply.numbers)
    coordinates = np.concatenate(corners)
    key = np.column_stack([flat.astype(np.float64), coordinates])
    _, first, corner = np.unique(key, axis=0, return_index=True, return_inverse=True)
    at, split = 0, list[NDArray[np.int64]]()
    for each in polygons:
        split.append(corner.reshape(-1)[at : at + each.size].reshape(each.shape))
        at += each.size
    kept = flat[first]
    return Ply(ply.points[kept], split, coordinates[first], {n: a[kept] for n, a in ply.numbers.items()})
