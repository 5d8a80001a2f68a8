"""Named tiny strands: every one is (P, 3) float64 [m], root first, at equal spacing; and what every test leaves as it was."""

import os
import shutil
import signal
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from named_strands import helix
from numpy.typing import NDArray

from pipeline import kernels

Points = NDArray[np.float64]


@pytest.fixture(autouse=True, scope="session")
def _interruptible() -> None:
    """Programs that tests start hear Ctrl-C, also where a shell started the tests in the background, deaf to it."""
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(autouse=True)
def _threads() -> Iterator[None]:
    """Every test leaves the number of threads as it found it."""
    count = kernels.threads()
    yield
    kernels.set_threads(count)


@pytest.fixture(scope="session")
def chromium() -> Iterator[Any]:
    """A headless browser, the system's; skips where there is none."""
    sync_api = pytest.importorskip("playwright.sync_api", reason="pages are tested with playwright")
    program = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if program is None:
        pytest.skip("pages are tested in Chromium, which is not installed: apt-get install chromium")
    with sync_api.sync_playwright() as playwright:
        sandbox = ["--no-sandbox"] if os.geteuid() == 0 else []
        browser = playwright.chromium.launch(executable_path=program, args=sandbox)
        yield browser
        browser.close()


@pytest.fixture
def visit(chromium: Any) -> Iterator[Callable[[Path], Any]]:
    """Open a page from disk; at the end: no error on its console, no request for anything but what lies beside it."""
    said: list[str] = []
    asked: list[str] = []
    page = chromium.new_page(viewport={"width": 1280, "height": 900})
    page.on("console", lambda message: said.append(f"{message.type}: {message.text}"))
    page.on("pageerror", lambda error: said.append(str(error)))
    page.on("dialog", lambda dialog: (said.append(f"dialog: {dialog.message}"), dialog.dismiss()))
    page.on("request", lambda request: asked.append(request.url))

    def go(path: Path) -> Any:
        page.goto(path.as_uri())
        return page

    yield go
    page.close()
    assert said == []
    assert [url for url in asked if not url.startswith(("file:", "data:"))] == []


@pytest.fixture
def straight() -> Points:
    """25 cm along x."""
    return np.linspace([0.0, 0, 0], [0.25, 0, 0], 32)


@pytest.fixture
def circle() -> Points:
    """Three quarters of a circle of 4 cm radius."""
    angle = np.linspace(0, 1.5 * np.pi, 32)
    return 0.04 * np.stack([np.sin(angle), 1 - np.cos(angle), 0 * angle], axis=-1)


@pytest.fixture
def curl() -> Points:
    """A helix of 1 cm radius and 2 cm pitch."""
    return helix(0.01, 0.02, 0.25, 32)


@pytest.fixture
def kinked(curl: Points) -> Points:
    """The curl, shaken by a tenth of its spacing: no symmetry left, spacing no longer equal."""
    spacing = float(np.linalg.norm(curl[1] - curl[0]))
    return curl + np.random.default_rng(7).normal(size=curl.shape) * spacing / 10


@pytest.fixture
def short() -> Points:
    """5 points on 5 mm: the shortest strand with one interior point for the 5-point torsion."""
    return helix(0.002, 0.004, 0.005, 5)
