"""What the gates of the image regression let through and what they catch, on rendered hair.

Gate 1 catches everything, as it asks for equal pixels. Gate 2 has to tell another renderer from another picture: the
limits lie between what another OpenGL, another instruction set or other samples at the edges of the head do, and the
smallest changes of a groom that matter.
"""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from pipeline.cli.main import call
from pipeline.compare import Limits, Metrics, judge, load_picture, measure, renderer_of

ROOT = Path(__file__).parents[2]
SMALL = (
    "simulate.frames=1",
    "simulate.settle=0",
    "groom.strands=3000",
    "render.size=[256, 256]",
    "render.grid=48",
)

Render = Callable[..., Path]


@pytest.fixture(scope="module")
def render(tmp_path_factory: pytest.TempPathFactory) -> Render:
    """Render one frame of curly hair with other settings, here or in a process with another environment."""
    outputs = tmp_path_factory.mktemp("gates")

    def frame(name: str, *settings: str, **environment: str) -> Path:
        chosen = [part for setting in (*SMALL, *settings) for part in ("-s", setting)]
        command = [
            "run",
            str(ROOT / "configs" / "ci" / "curly.toml"),
            "--outputs",
            str(outputs / name),
            *chosen,
        ]
        if environment:
            process = [sys.executable, "-m", "pipeline", *command]
            subprocess.run(process, check=True, cwd=ROOT, env=os.environ | environment, capture_output=True)
        else:
            assert call(command) == 0
        return outputs / name / "ci-curly" / "frames" / "0001.png"

    return frame


@pytest.fixture(scope="module")
def reference(render: Render) -> Path:
    return render("reference")


def figures(reference: Path, picture: Path, what: str) -> Metrics:
    found = measure(load_picture(reference), load_picture(picture))
    print(
        f"{what}: FLIP {found.flip:.5f}, SSIM {found.ssim:.5f}, blurred {found.blurred:.5f}, {found.luminance:+.5f}"
    )
    return found


@pytest.mark.parametrize(
    ("what", "setting"),
    [
        ("1 % of the strands dropped", "groom.strands=2970"),
        ("curls 3 % wider", "groom.style.waves.radius=9.785 mm"),
        ("colour 4 % darker", "render.hair.melanin=0.728"),
        ("highlights 10 % wider", "render.hair.roughness=0.33"),
    ],
)
def test_both_gates_catch_a_change_of_the_hair(
    render: Render, reference: Path, what: str, setting: str
) -> None:
    metrics = figures(reference, render("changed", setting), what)
    assert judge(metrics, exact=True) != []
    assert judge(metrics, exact=False, limits=Limits()) != []


@pytest.mark.parametrize("environment", [{"GALLIUM_DRIVER": "softpipe"}, {"RINGLET_KERNELS": "portable"}])
def test_gate_2_accepts_another_renderer(
    render: Render, reference: Path, environment: dict[str, str]
) -> None:
    """Another rasteriser of Mesa, which differs more than two of its versions do, and another instruction set."""
    picture = render(*environment.values(), **environment)
    if renderer_of(picture) == renderer_of(reference):
        pytest.skip(f"{environment} changes nothing here")
    metrics = figures(reference, picture, str(environment))
    assert judge(metrics, exact=False, limits=Limits()) == []


def test_gate_2_accepts_other_samples_at_the_edges(render: Render, reference: Path) -> None:
    metrics = figures(reference, render("sampled", "render.samples=3"), "3 x 3 samples instead of 2 x 2")
    assert metrics.changed > 0
    assert judge(metrics, exact=False, limits=Limits()) == []
