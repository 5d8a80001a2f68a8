"""Each config of configs/ci, from groom to frames, against its golden picture and the figures of its guides.

All comparisons are shown in outputs/images/index.html; `make approve WHY="..."` takes the new pictures for golden ones.
"""

from pathlib import Path
from typing import Any

import pytest

from pipeline import cache
from pipeline.cli.main import call
from pipeline.compare.pytest_plugin import Golden

ROOT = Path(__file__).parents[2]
STYLES = sorted(path.stem for path in (ROOT / "configs" / "ci").glob("*.toml"))


@pytest.fixture(scope="session")
def outputs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("outputs")


@pytest.fixture(scope="module", params=STYLES)
def experiment(request: pytest.FixtureRequest, outputs: Path) -> tuple[str, cache.Experiment]:
    """A CI config, rendered once."""
    style = request.param
    code = call(["run", str(ROOT / "configs" / "ci" / f"{style}.toml"), "--outputs", str(outputs)])
    assert code == 0
    return style, cache.Experiment(outputs / f"ci-{style}")


def test_the_last_frame_equals_its_golden_picture(
    experiment: tuple[str, cache.Experiment], golden: Golden
) -> None:
    style, folder = experiment
    golden(sorted(folder.frames.glob("*.png"))[-1], style)


def test_the_guides_end_where_the_golden_ones_did(
    experiment: tuple[str, cache.Experiment], golden: Golden
) -> None:
    style, folder = experiment
    golden.figures(guide_figures(folder), style, absolute=1e-3)


def guide_figures(folder: cache.Experiment) -> dict[str, Any]:
    """Where the tips of the guides are in the last frame [m]."""
    with cache.open_guides(folder.guides) as guides:
        tips = guides.frame(guides.frames - 1)[:, -1].astype(float)
        count = guides.guides
    return {
        "guides": count,
        "tip_mean": tips.mean(axis=0).round(7).tolist(),
        "tip_spread": round(float(tips.std()), 7),
    }
