"""What is inside a file of the cache."""

from pathlib import Path
from typing import Any

from pipeline import cache


def contents(path: Path) -> dict[str, Any]:
    """Describe a file after verifying all of it; a damaged one is {"valid": False, "problem": ...}.

    Raises InputError when there is no such file.
    """
    found: dict[str, Any] = dict.fromkeys(("kind", "key", "strands", "points", "frames"))
    try:
        found |= _picture(path) if path.suffix in (".png", ".exr") else _columns(path)
    except cache.Damaged as error:
        return found | {"valid": False, "problem": str(error)}
    return found | {"valid": True}


def _picture(path: Path) -> dict[str, Any]:
    key, provenance = cache.picture_record(path)
    return {"kind": "frame", "key": key, "frames": 1, "provenance": _short(provenance)}


def _columns(path: Path) -> dict[str, Any]:
    with cache.open(path) as reader:
        reader.verify()
        shapes = {name: reader[name].shape for name in reader.names}
        return {
            "kind": reader.kind,
            "key": reader.key,
            **_counts(shapes, reader.meta),
            "columns": {name: f"{shape} {reader[name].dtype}" for name, shape in shapes.items()},
            "provenance": _short(reader.provenance),
        }


def _counts(shapes: dict[str, tuple[int, ...]], meta: dict[str, Any]) -> dict[str, int | None]:
    """Count strands, points of a strand and frames, as far as this kind of file has them."""
    if "strands/points" in shapes:
        strands, points, _ = shapes["strands/points"]
        return {"strands": strands, "points": points}
    if "strands/parent" in shapes:
        return {"strands": shapes["strands/parent"][0]}
    return {"strands": meta.get("guides"), "points": meta.get("points"), "frames": meta.get("frames")}


def _short(provenance: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in provenance.items() if name not in ("inputs", "config")}
