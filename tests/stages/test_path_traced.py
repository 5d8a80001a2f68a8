"""Our pictures against path-traced ones of the same strands, camera, lights and fibres."""

from pathlib import Path

import numpy as np
import pytest

from pipeline.validation.pictures import compare, load, render

PICTURES = Path(__file__).parents[2].parent / "shared/reference/pictures"


@pytest.mark.parametrize(
    ("name", "colour", "correlation"),
    [
        ("s1_brown", 0.07, 0.97),
        ("s1_black", 0.07, 0.97),
        ("s2_brown", 0.07, 0.97),
        ("s3_brown", 0.07, 0.97),
        ("s4_brown", 0.07, 0.97),
    ],
)
def test_hair_looks_like_path_traced_hair(name: str, colour: float, correlation: float) -> None:
    """Colour, place of light and shadow, and detail: between the denoised picture's, too soft, and the noisy one's."""
    if not (PICTURES / "scenes.json").is_file():
        pytest.skip("the shared path-traced pictures are not on this machine")
    pytest.importorskip("OpenEXR")
    reference = load(PICTURES, name)
    picture, covered = render(reference)
    hair = covered > 0.95
    noisy, smooth = (
        compare(
            picture,
            each[..., :3],
            hair,
            # What the reference covers is hair's alone where there is no body
            covered=None if reference.bodies else (covered, each[..., 3]),
        )
        for each in (reference.noisy, reference.smooth)
    )
    print(
        f"{name}: ratio {np.round(noisy.ratio, 3)}, correlation {noisy.correlation:.4f}, contrast "
        f"{smooth.contrast[1]:.2f} < {noisy.contrast[0]:.2f} < {noisy.contrast[1]:.2f}, 99th percentile "
        f"{noisy.highlights[0]:.2f} for {smooth.highlights[1]:.2f} and {noisy.highlights[1]:.2f}"
    )
    assert (np.abs(np.array(noisy.ratio) - 1) < colour).all()
    assert noisy.correlation > correlation
    assert 0.85 * min(smooth.highlights[1], noisy.highlights[1]) < noisy.highlights[0]
    assert noisy.highlights[0] < 1.15 * max(smooth.highlights[1], noisy.highlights[1])
    assert 0.85 * smooth.contrast[1] < noisy.contrast[0] < 1.15 * noisy.contrast[1]


def test_places_of_light_are_compared_by_what_hair_covers() -> None:
    """Open hair over black: as bright by its coverage, however much of each pixel it covers."""
    rng = np.random.default_rng(5)
    colour = np.repeat(np.repeat(rng.uniform(0.1, 1, (8, 8, 3)), 16, axis=0), 16, axis=1)
    sparse, dense = (
        rng.uniform(low, high, (128, 128)).astype(np.float32) for low, high in ((0.3, 0.6), (0.6, 0.99))
    )
    drawn = [(colour * cover[..., None]).astype(np.float32) for cover in (sparse, dense)]
    known, other = (
        compare(ours, drawn[1], dense > 0.95, covered=(sparse, dense)).correlation
        for ours in (drawn[0], drawn[0][::-1])
    )
    print(f"correlation {known:.4f}; upside down {other:.4f}")
    assert known > 0.99
    assert other < 0.5
