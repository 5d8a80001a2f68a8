"""A groom in OpenUSD is as old as the youngest of its layers."""

import os
import struct
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pipeline.config import load, stage_keys
from pipeline.config.usd_layers import layers_of

TEXT = (
    b'#usda 1.0\n(\n    subLayers = [@./below.usda@]\n)\ndef "hair" (references = @@@in/far.usd@@@</a>) {}\n'
)


def layered(folder: Path) -> Path:
    (folder / "in").mkdir()
    (folder / "groom.usda").write_bytes(TEXT)
    (folder / "below.usda").write_bytes(b"#usda 1.0\n( subLayers = [@groom.usda@, @not_there.usda@] )\n")
    (folder / "in/far.usd").write_bytes(crate([b"", b"Xform", b"../deep.usdc", b"a" * 300]))
    (folder / "deep.usdc").write_bytes(crate([b"visibility"]))
    return folder / "groom.usda"


def crate(words: list[bytes]) -> bytes:
    """The part of a binary layer that names are in, its words packed as literals."""
    text = b"\0".join(words) + b"\0"
    more = len(text) - 15
    block = bytes([0, 0xF0]) + b"\xff" * (more // 255) + bytes([more % 255]) + text
    tokens = struct.pack("<QQQ", len(words), len(text), len(block)) + block
    toc = struct.pack("<Q16sqq", 1, b"TOKENS", 88, len(tokens))
    return b"PXR-USDC".ljust(16, b"\0") + struct.pack("<q", 32) + bytes(8) + toc.ljust(56, b"\0") + tokens


def test_a_change_of_any_layer_makes_the_groom_stale(tmp_path: Path) -> None:
    groom = layered(tmp_path)
    config = tmp_path / "c.toml"
    config.write_text(f'name = "c"\n[groom]\nsource = "{groom.name}"\n')
    found = [path.relative_to(tmp_path.resolve()).as_posix() for path in layers_of(groom)]
    print(f"{groom.name} is made of {found} too")
    assert found == ["below.usda", "deep.usdc", "in/far.usd"]
    keys = [stage_keys(load(config, []).config)["groom"]]
    for name in found:
        path = tmp_path / name
        path.write_bytes(path.read_bytes() + b"\n")
        os.utime(path, ns=(1, len(keys)))
        keys.append(stage_keys(load(config, []).config)["groom"])
    assert len(set(keys)) == len(keys)


def test_binary_layers_that_the_library_wrote_are_understood(tmp_path: Path) -> None:
    Usd = pytest.importorskip("pxr.Usd")
    UsdGeom = pytest.importorskip("pxr.UsdGeom")
    (tmp_path / "below.usda").write_bytes(b"#usda 1.0\n")
    stage = Usd.Stage.CreateNew(str(tmp_path / "top.usdc"))
    stage.GetRootLayer().subLayerPaths.append("below.usda")
    for k in range(400):
        UsdGeom.Xform.Define(stage, f"/hair/strand_{k}")
    stage.Save()
    assert layers_of(tmp_path / "top.usdc") == ((tmp_path / "below.usda").resolve(),)


@given(data=st.data())
@settings(max_examples=300, deadline=None)
def test_damaged_layers_name_what_is_there_or_nothing(
    data: st.DataObject, tmp_path_factory: pytest.TempPathFactory
) -> None:
    folder = tmp_path_factory.getbasetemp()
    whole = bytearray(data.draw(st.sampled_from([TEXT, crate([b"x.usda", b"y" * 40, b"z"])])))
    for _ in range(data.draw(st.integers(1, 4))):
        whole[data.draw(st.integers(0, len(whole) - 1))] = data.draw(st.integers(0, 255))
    path = folder / f"damaged.{data.draw(st.sampled_from(['usda', 'usdc', 'usd']))}"
    path.write_bytes(whole[: data.draw(st.integers(0, len(whole)))])
    assert all(layer.is_file() for layer in layers_of(path))
