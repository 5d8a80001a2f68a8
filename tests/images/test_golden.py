"""Each config of configs/ci, from groom to frames, against its golden picture and the figures of its guides.

New pictures are kept in outputs/images/new and a page of all differences in outputs/images/index.html;
`make approve WHY="..."` takes the new pictures for golden ones.
"""

import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from pipeline import cache
from pipeline.cli.main import call
from pipeline.compare import Limits, Pair, judge, measure
from pipeline.compare.folders import load_picture
from pipeline.compare.page import write_page

ROOT = Path(__file__).parents[2]
GOLDEN = Path(__file__).parent / "golden"
RESULTS = ROOT / "outputs" / "images"
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


def test_the_last_frame_equals_its_golden_picture(experiment: tuple[str, cache.Experiment]) -> None:
    style, folder = experiment
    newest = sorted(folder.frames.glob("*.png"))[-1]
    kept = RESULTS / "new" / f"{style}.png"
    kept.parent.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(newest, kept)
    golden = GOLDEN / f"{style}.png"
    assert golden.is_file(), 'no golden picture yet: look at the new one, then make approve WHY="..."'
    metrics = measure(load_picture(golden), load_picture(kept))
    same = fingerprint(golden) == fingerprint(kept)
    print(f"{style}: same fingerprint {same}, {metrics}")
    reasons = judge(metrics, same, Limits())
    if reasons:
        page = RESULTS / f"{style}.html"
        write_page(page, style, [Pair(style, golden, kept, metrics)], {style: reasons})
        pytest.fail(f"{'; '.join(reasons)}; see {page}")


def test_the_guides_end_where_the_golden_ones_did(experiment: tuple[str, cache.Experiment]) -> None:
    style, folder = experiment
    found = guide_figures(folder)
    (RESULTS / "new").mkdir(parents=True, exist_ok=True)
    (RESULTS / "new" / f"{style}.json").write_text(json.dumps(found, indent=2) + "\n")
    golden = GOLDEN / f"{style}.json"
    assert golden.is_file(), 'no golden figures yet: make approve WHY="..."'
    expected = json.loads(golden.read_text())
    drift = np.abs(np.subtract(found["tip_mean"], expected["tip_mean"])).max()
    spread = abs(found["tip_spread"] / expected["tip_spread"] - 1)
    print(f"{style}: mean tip off by {1e3 * drift:.4f} mm, spread by {spread:.2e}")
    assert found["guides"] == expected["guides"]
    assert drift < 1e-3
    assert spread < 0.02


def test_every_golden_file_belongs_to_a_config() -> None:
    files = {path.name for path in GOLDEN.iterdir()} - {"REASONS.md"}
    used = {f"{style}.{ending}" for style in STYLES for ending in ("png", "json")}
    assert files - used == set(), "remove golden files that no config uses"


def fingerprint(path: Path) -> str:
    """What the pixels depend on besides the config, as the renderer wrote it into the picture."""
    with Image.open(path) as image:
        return str(image.info["ringlet.fingerprint"])


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
