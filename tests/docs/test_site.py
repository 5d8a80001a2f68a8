"""The documentation: the site builds without a warning, its whole configs are configs, its links lead somewhere, its examples hold."""

import doctest
import importlib
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from pipeline.config import load
from pipeline.errors import InputError

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]
SNIPPETS = [
    pytest.param(text, id=f"{page.stem}-{number}")
    for page in PAGES
    for number, text in enumerate(
        re.findall(r"^```toml\n((?:extends|name).*?)^```", page.read_text(), re.S | re.M), start=1
    )
]
_MODULES = [path for path in sorted((ROOT / "pipeline").rglob("*.py")) if ">>> " in path.read_text()]
_LINK = re.compile(r"\]\((?!https?:|mailto:)([^)#\s]*)(?:#[^)]*)?\)")


def test_the_site_builds_without_a_warning(tmp_path: Path) -> None:
    pytest.importorskip("sphinx", reason="the documentation's tools are not installed")
    command = [
        sys.executable,
        "-m",
        "sphinx",
        "-q",
        "-W",
        "--keep-going",
        "-b",
        "html",
        "-D",
        "plot_gallery=0",
    ]
    done = subprocess.run(
        [*command, "-d", tmp_path / "trees", "docs", tmp_path / "site"],
        cwd=ROOT, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "groom.style.NAME" in (tmp_path / "site" / "reference" / "options.html").read_text()


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_to_files_of_the_repository(page: Path) -> None:
    links = [link for link in _LINK.findall(page.read_text()) if link]
    made = ("examples_gallery/", "reference/options")  # by the build of the site
    lost = [link for link in links if not link.startswith(made) and not (page.parent / link).exists()]
    print(f"{page.name}: {len(links)} links")
    assert not lost


@pytest.mark.parametrize("text", SNIPPETS)
def test_a_config_in_the_documentation_is_one(text: str, tmp_path: Path) -> None:
    shutil.copytree(ROOT / "configs", tmp_path / "configs")
    path = tmp_path / "configs" / "snippet.toml"
    path.write_text(text)
    for value in re.findall(r'"([\w/.%]+\.(?:ply|vtp|abc|hair|csv|obj))"', text):
        (path.parent / value).parent.mkdir(parents=True, exist_ok=True)
        (path.parent / value).touch()
    try:
        load(path)
    except InputError as error:
        pytest.fail(str(error))


@pytest.mark.parametrize("path", _MODULES, ids=lambda path: path.stem)
def test_examples_in_docstrings_hold(path: Path) -> None:
    name = ".".join(path.relative_to(ROOT).with_suffix("").parts)
    found = doctest.testmod(importlib.import_module(name))
    print(f"{name}: {found.attempted} examples")
    assert found.attempted > 0
    assert found.failed == 0
