"""Values that vary over the scalp: formulas, images and painted arrays, each where it should be."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image
from shipped_configs import shipped

from pipeline.config.formula import VARIABLES
from pipeline.config.schema import Lengths, VariedFraction, VariedLength
from pipeline.errors import InputError
from pipeline.groom.heads import Head
from pipeline.groom.procedural import Style
from pipeline.groom.style.fields import Scalp, noise, varied
from pipeline.strands.spacing import arc_length

COUNT = 500


@pytest.fixture(scope="module")
def scalp(mannequin: Head) -> Scalp:
    style = Style(shipped("default", strands=COUNT, style={}), mannequin)
    return Scalp(1, np.arange(COUNT), style.roots, mannequin, style.terrain)


def formula(text: str, at: Scalp) -> NDArray[np.float64]:
    return varied(VariedLength(formula=text), at)


@pytest.mark.parametrize("name", VARIABLES)
def test_every_variable_has_a_value_at_every_root(scalp: Scalp, name: str) -> None:
    value = scalp.variable(name)
    print(f"{name}: {value.min():.3f} to {value.max():.3f}; {VARIABLES[name]}")
    assert value.shape == (COUNT,)
    assert np.isfinite(value).all()
    assert name == "parting" or np.ptp(value) > 0.05
    if name in ("height", "front", "u", "v", "random"):
        assert value.min() > -0.05
        assert value.max() < 1.05


def test_a_formula_is_its_arithmetic(scalp: Scalp) -> None:
    h, y = scalp.variable("height"), scalp.root[:, 1]
    for text, wanted in (
        ("0.1", np.full(COUNT, 0.1)),
        (
            "0.02 + 0.05 * smoothstep(0, 1, height)",
            0.02 + 0.05 * np.clip(h, 0, 1) ** 2 * (3 - 2 * np.clip(h, 0, 1)),
        ),
        ("max(y, 0) / 2 + abs(y) ** 2", np.maximum(y, 0) / 2 + y**2),
        ("mix(0.1, 0.3, random)", 0.1 + 0.2 * scalp.variable("random")),
    ):
        assert np.abs(formula(text, scalp) - wanted).max() < 1e-15, text


def test_values_are_scaled_to_their_range_and_kept_to_what_is_allowed(scalp: Scalp) -> None:
    ranged = varied(VariedLength.model_validate({"formula": "height", "from": "2 cm", "to": "20 cm"}), scalp)
    assert np.abs(ranged - (0.02 + 0.18 * scalp.variable("height"))).max() < 1e-15
    assert formula("y", scalp).min() == 0
    assert varied(VariedFraction(formula="2 * height"), scalp).max() == 1


@pytest.mark.parametrize("text", ["1 / 0", "sqrt(-1)", "9 ** 9 ** 9", "y / (y - y)"])
def test_a_formula_without_a_value_is_refused(scalp: Scalp, text: str) -> None:
    with pytest.raises(InputError, match=r"has no value at 500 roots"):
        formula(text, scalp)


def test_noise_is_smooth_and_has_its_scale() -> None:
    line = np.column_stack([np.linspace(0, 1, 20_001), np.full(20_001, 0.3), np.full(20_001, 0.7)])
    fine, coarse = (noise(line, scale, 1) for scale in (0.01, 0.05))
    crossings = [int((np.diff(np.sign(value)) != 0).sum()) for value in (fine, coarse)]
    step = np.abs(np.diff(fine)).max()
    print(f"signs change {crossings[0]} and {crossings[1]} times on a metre; largest step {step:.4f} of 2")
    assert -1 <= fine.min() < -0.3 < 0.3 < fine.max() <= 1
    assert 3 < crossings[0] / crossings[1] < 7
    assert step < 0.02


def test_an_image_is_looked_up_by_texture_coordinates(scalp: Scalp, tmp_path: Path) -> None:
    uv = scalp.head.uv(scalp.root)
    across = np.tile(np.linspace(0, 255, 256), (64, 1))
    for name, picture, wanted in (
        ("u", across.astype(np.uint8), uv[:, 0]),
        ("v", across.T[::-1].astype(np.uint8), uv[:, 1]),
        ("deep", (257 * across).astype(np.uint16), uv[:, 0]),
    ):
        Image.fromarray(picture).save(tmp_path / f"{name}.png")
        found = varied(VariedFraction(map=str(tmp_path / f"{name}.png")), scalp)
        error = np.abs(found - wanted).max()
        print(f"{name}: off by {error:.4f}")
        assert error < 0.01


def test_what_is_no_image_is_refused(scalp: Scalp, tmp_path: Path) -> None:
    (tmp_path / "no.png").write_text("no")
    with pytest.raises(InputError, match=r"no\.png: cannot be read as an image"):
        varied(VariedFraction(map=str(tmp_path / "no.png")), scalp)


def test_a_painted_array_is_blended_from_the_points_of_the_skin(scalp: Scalp) -> None:
    painted = replace(scalp.head, arrays={"tall": scalp.head.skin.points[:, 1]})
    found = varied(VariedLength(array="tall"), replace(scalp, head=painted))
    error = np.abs(found - np.maximum(scalp.root[:, 1], 0)).max()
    print(f"height painted on the mesh and read at the roots: off by {1000 * error:.2f} mm")
    assert error < 1.5e-3
    with pytest.raises(InputError, match='no painted array "thick" on the points of this mesh; it has tall'):
        varied(VariedLength(array="thick"), replace(scalp, head=painted))
    with pytest.raises(InputError, match="it has none"):
        varied(VariedLength(array="thick"), scalp)


def test_lengths_by_a_formula_reach_the_strands(mannequin: Head) -> None:
    config = shipped("default", strands=COUNT)
    length = VariedLength.model_validate({"formula": "height", "from": "3 cm", "to": "9 cm"})

    style = {"combing": config.groom.style["combing"], "cut": Lengths(op="length", length=length)}
    made = Style(shipped("default", strands=COUNT, style=style), mannequin)
    wanted = 0.03 + 0.06 * (made.roots[:, 1] + 0.067) / 0.198
    found = arc_length(made.stack.strands(np.arange(COUNT)).points)[:, -1]
    print(
        f"lengths {found.min():.3f} to {found.max():.3f} m, off by {100 * np.abs(found / wanted - 1).max():.2f} %"
    )
    assert np.abs(found / wanted - 1).max() < 0.01
