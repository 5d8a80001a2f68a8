"""The pytest plugin in a project of a user: what passes, what fails, what is approved, what is left over."""

import json
from pathlib import Path
from typing import Any

import pytest

from pipeline.compare.golden import approve, check_figures, file_name, plain_name
from pipeline.errors import InputError

# What runs inside pytester forgets the modules that it loaded; these do not survive being loaded twice.
for name in ("flip_evaluator", "skimage.metrics", "scipy.ndimage", "PIL.Image"):
    pytest.importorskip(name)

pytest_plugins = ["pytester"]

TEST = """\
import numpy as np
import pytest

def pixels(value, dot=0):
    found = np.full((40, 60, 3), value, np.uint8)
    found[5, 5] += np.uint8(dot)
    return found

def test_grey(golden):
    golden(pixels({value}, {dot}), "grey", fingerprint="{renderer}")

@pytest.mark.parametrize("tone", [10, 20])
def test_tones(golden, tone):
    golden(pixels(tone), fingerprint="{renderer}")

def test_figures(golden):
    golden.figures({{"strands": {strands}, "tip": [0.1, {tip}]}}, "tips", absolute=1e-3)
"""
FIRST: dict[str, Any] = {"value": 90, "dot": 0, "renderer": "x; y", "strands": 4, "tip": 0.2}
GOLDEN = ["grey.png", "test_tones-10.png", "test_tones-20.png", "tips.json"]


class Project:
    """A user's tests in a folder of their own."""

    def __init__(self, pytester: pytest.Pytester) -> None:
        self.pytester = pytester
        self.folder = pytester.mkdir("tests")
        self.golden = self.folder / "golden"
        self.results = pytester.path / "outputs" / "images"

    def run(self, *arguments: str, **values: Any) -> dict[str, int]:
        """Run the tests; the number of failed and passed ones, and of golden files left over."""
        (self.folder / "test_it.py").write_text(TEST.format(**{**FIRST, **values}))
        plugin = ("-p", "pipeline.compare.pytest_plugin")
        plugin += ("-p", "no:cacheprovider", "-p", "no:hypothesispytest", "-p", "no:pytest_cov")
        result = self.pytester.runpytest_inprocess(*plugin, *arguments)
        self.text = result.stdout.str()
        counts = {key: value for key, value in result.parseoutcomes().items() if key in ("failed", "passed")}
        counts["unused"] = self.text.count("no test uses")
        assert (result.ret == 0) == (counts.get("failed", 0) == counts["unused"] == 0)
        return counts

    def approved(self) -> None:
        self.run()
        approve(self.results, "first ones")


@pytest.fixture
def project(pytester: pytest.Pytester) -> Project:
    return Project(pytester)


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_new_pictures_fail_until_they_are_approved(project: Project) -> None:
    assert project.run() == {"failed": 4, "unused": 0}
    assert "no golden picture yet" in project.text
    taken, count = approve(project.results, "first\n ones")
    assert (sorted(taken), count) == (GOLDEN, 4)
    assert project.run() == {"passed": 4, "unused": 0}
    assert names(project.golden) == ["REASONS.md", *GOLDEN]
    assert (project.golden / "REASONS.md").read_text().endswith(": first ones\n")


def test_one_renderer_is_held_to_the_pixel_another_one_to_limits(project: Project) -> None:
    project.approved()
    assert project.run(dot=1) == {"failed": 1, "passed": 3, "unused": 0}
    assert "of the pixels differ" in project.text
    assert project.run(dot=1, renderer="z") == {"passed": 4, "unused": 0}
    assert project.run(value=95, renderer="z") == {"failed": 1, "passed": 3, "unused": 0}
    page = (project.results / "index.html").read_text()
    assert "FLIP" in page
    assert "x; y" not in page  # shown part by part
    assert "<td>z</td>" in page


def test_figures_fail_beyond_their_tolerance(project: Project) -> None:
    project.approved()
    assert project.run(tip=0.2009) == {"passed": 4, "unused": 0}
    assert project.run(tip=0.2011) == {"failed": 1, "passed": 3, "unused": 0}
    assert "tip[1]: 0.2 became 0.2011" in project.text
    assert project.run(strands=5) == {"failed": 1, "passed": 3, "unused": 0}


def test_golden_files_that_no_test_uses_fail_the_whole_run_and_no_smaller_one(project: Project) -> None:
    project.approved()
    (project.golden / "old.png").write_bytes((project.golden / "grey.png").read_bytes())
    assert project.run() == {"passed": 4, "unused": 1}
    assert "golden/old.png" in project.text
    assert "no test uses" in (project.results / "index.html").read_text()
    assert project.run("tests") == {"passed": 4, "unused": 1}
    for part in (["-k", "tones"], ["-x"], ["tests/test_it.py"], ["tests/test_it.py::test_grey"]):
        assert project.run(*part)["unused"] == 0
    (project.golden / "old.png").unlink()
    other = project.pytester.mkdir("other") / "test_more.py"
    other.write_text("def test_nothing(): pass")
    assert project.run("other")["unused"] == 0


def test_a_test_that_broke_before_it_compared_leaves_nothing_over(project: Project) -> None:
    project.approved()
    (project.folder / "test_more.py").write_text("def test_broken(golden): raise ValueError")
    (project.golden / "broken.png").touch()
    assert project.run() == {"failed": 1, "passed": 4, "unused": 0}


def test_workers_report_to_one_page(project: Project) -> None:
    pytest.importorskip("xdist")
    project.approved()
    (project.golden / "old.png").touch()
    workers = ("-p", "xdist", "-n", "2")
    assert project.run(*workers, value=95) == {"failed": 1, "passed": 3, "unused": 1}
    assert len(json.loads((project.results / "record.json").read_text())) == 4
    assert project.run(*workers, "-k", "tones") == {"passed": 2, "unused": 0}


def test_folder_and_page_can_be_elsewhere(project: Project, tmp_path: Path) -> None:
    options = (f"--golden-dir={tmp_path / 'kept'}", f"--golden-page={tmp_path / 'page' / 'all.html'}")
    assert project.run(*options)["failed"] == 4
    approve(tmp_path / "page", "first")
    assert project.run(*options) == {"passed": 4, "unused": 0}
    assert names(tmp_path / "kept" / "tests") == ["REASONS.md", *GOLDEN]
    assert not project.golden.exists()
    assert (tmp_path / "page" / "all.html").is_file()


def test_approving_takes_what_failed_and_nothing_else(project: Project) -> None:
    project.approved()
    before = (project.golden / "grey.png").read_bytes()
    project.run(value=95, tip=0.3)
    assert approve(project.results, "tips only", ["tips"])[0] == ["tips.json"]
    assert (project.golden / "grey.png").read_bytes() == before
    project.run(dot=1, renderer="z", tip=0.3)
    assert approve(project.results, "nothing failed")[0] == []
    assert approve(project.results, "another renderer", everything=True)[0] != []
    for reason, chosen, message in (
        (" ", [], "say why"),
        ("x", ["none"], "not in the last run: none"),
    ):
        with pytest.raises(InputError, match=message):
            approve(project.results, reason, chosen)
    with pytest.raises(InputError, match="run the tests first"):
        approve(project.folder, "why")
    (project.results / "record.json").write_text('[{"name": 1}]')
    with pytest.raises(InputError, match="not a record"):
        approve(project.results, "why")


def test_names_cannot_leave_the_folder() -> None:
    for name in ("../x", "a/b", ".hidden", "", "x" * 121, "a\n"):
        with pytest.raises(InputError, match="golden"):
            file_name(name, ".png")
    assert file_name(plain_name("test_it[../../x<b>]"), ".png") == "test_it-..-..-x-b.png"


def test_whole_numbers_words_and_shapes_have_to_be_equal(tmp_path: Path) -> None:
    golden, new = tmp_path / "a.json", tmp_path / "b.json"
    golden.write_text('{"n": 100, "x": 1.0, "name": "a", "list": [1.5, 2], "on": true}')
    for text, reason in (
        ('{"n": 101, "x": 1.0, "name": "a", "list": [1.5, 2], "on": true}', "n: 100 became 101"),
        ('{"n": 100, "x": 1.2, "name": "a", "list": [1.5, 2], "on": true}', "x: 1 became 1.2"),
        ('{"n": 100, "x": 1, "name": "b", "list": [1.5, 2], "on": true}', "name: 'a' became 'b'"),
        ('{"n": 100, "x": 1, "name": "a", "list": [1.5], "on": true}', r"list: \[1.5, 2\] became \[1.5\]"),
        ('{"n": 100, "x": NaN, "name": "a", "list": [1.5, 2], "on": true}', "x: 1 became nan"),
    ):
        new.write_text(text)
        check = check_figures(golden, new, relative=0.1, absolute=0.0)
        assert len(check.reasons) == 1
        with pytest.raises(AssertionError, match=reason):
            raise AssertionError(check.reasons[0])
    new.write_text('{"n": 100, "x": 1.09, "name": "a", "list": [1.4, 2], "on": true}')
    assert check_figures(golden, new, relative=0.1, absolute=0.0).reasons == []
