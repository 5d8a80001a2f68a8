"""pytest plugin `ringlet`: the fixture `golden` compares a test's pictures with golden ones.

    def test_my_style(golden):
        golden(Path("outputs/mine/frames/0010.png"), "mine", flip=0.01)
        golden.figures({"strands": 4000, "tip": [0.1, 0.2, 0.3]}, "mine", absolute=1e-3)

Golden files lie in golden/ beside the test's file (`--golden-dir` puts them elsewhere). Pictures of one renderer have
to be equal, those of another one within limits, beside which stand the figures. At the end of a run there is a page
of all comparisons (`--golden-page`); `ringlet approve "why"` takes the new pictures for golden ones. A golden
file that no test asked for fails a run of the whole folder. Works under pytest-xdist.
"""

import dataclasses
import json
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from pipeline.compare.gates import Limits
from pipeline.compare.golden import (
    Check,
    check_figures,
    check_picture,
    file_name,
    keep_picture,
    plain_name,
    unused,
    write_record,
)
from pipeline.compare.metrics import Metrics

PAGE = Path("outputs/images/index.html")  # under pytest's root folder
_CHECK, _FOLDER, _PARTIAL = "golden check", "golden folder", "golden_deselected"


class Golden:
    """What the fixture `golden` is."""

    def __init__(self, request: pytest.FixtureRequest) -> None:
        self._node = request.node
        self._folder = _golden_folder(request.config, request.node.path)
        self._new = _page(request.config).parent / "new" / _relative(request.config, request.node.path.parent)

    def __call__(
        self,
        picture: str | os.PathLike[str] | NDArray[np.uint8],
        name: str = "",
        *,
        limits: Limits | None = None,
        fingerprint: str | None = None,
        **changed: float,
    ) -> Metrics | None:
        """Fail the test unless a picture fits its golden one.

        picture: a PNG or EXR file, or pixels (H, W, 3) uint8 with, if there is one, the fingerprint of what drew them.
        name: of the golden file; the test's unless given. Limits by name: flip, ssim, blurred, luminance.
        """
        __tracebackhide__ = True
        limits = dataclasses.replace(limits or Limits(), **changed)
        source = picture if isinstance(picture, np.ndarray) else Path(picture)
        ending = source.suffix.lower() if isinstance(source, Path) else ".png"
        golden, new = self._files(name, ending)
        keep_picture(source, new, fingerprint)
        check = check_picture(golden, new, limits)
        metrics = check.metrics and Metrics(**check.metrics)
        print(f"{check.name}: {metrics or 'not measured'}")
        self._done(check)
        return metrics or None

    def figures(
        self, values: Mapping[str, Any], name: str = "", *, relative: float = 0.0, absolute: float = 0.0
    ) -> None:
        """Fail the test unless figures fit their golden ones; numbers with a point within the larger tolerance."""
        __tracebackhide__ = True
        golden, new = self._files(name, ".json")
        new.parent.mkdir(parents=True, exist_ok=True)
        new.write_text(json.dumps(values, indent=2) + "\n", "utf-8")
        self._done(check_figures(golden, new, relative, absolute))

    def _files(self, name: str, ending: str) -> tuple[Path, Path]:
        file = file_name(name or plain_name(self._node.name), ending)
        return self._folder / file, self._new / file

    def _done(self, check: Check) -> None:
        __tracebackhide__ = True
        check = dataclasses.replace(check, test=self._node.nodeid)
        self._node.user_properties.append((_CHECK, dataclasses.asdict(check)))
        if check.reasons:
            page = _page(self._node.config)
            pytest.fail(f"{check.name}: {'; '.join(check.reasons)}; see {page}", pytrace=False)


@pytest.fixture
def golden(request: pytest.FixtureRequest) -> Golden:
    """Compare pictures, and figures, with golden ones."""
    return Golden(request)


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options of golden pictures."""
    group = parser.getgroup("golden", "golden pictures (ringlet)")
    group.addoption(
        "--golden-dir", metavar="DIR", help="folder of golden pictures (golden/ beside each test's file)"
    )
    group.addoption(
        "--golden-page", metavar="FILE", help=f"the page of all comparisons ({PAGE} in the root folder)"
    )


def pytest_configure(config: pytest.Config) -> None:
    """Begin to gather what the tests compare."""
    if config.pluginmanager.has_plugin("golden session"):
        return
    config.pluginmanager.register(_Session(config), "golden session")


class _Session:
    """Gathers the checks of all processes and ends the run: page, record, unused golden files."""

    def __init__(self, config: pytest.Config) -> None:
        self.config = config
        self.checks: dict[tuple[str, str], Check] = {}
        self.folders: dict[str, bool] = {}  # golden folder -> all its tests told what they use
        self.partial = False
        self.unused: list[str] = []

    @property
    def worker(self) -> bool:
        return hasattr(self.config, "workerinput")

    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        for item in items:
            if "golden" in getattr(item, "fixturenames", ()):
                item.user_properties.append((_FOLDER, str(_golden_folder(self.config, item.path))))

    def pytest_deselected(self, items: list[pytest.Item]) -> None:
        self.partial = self.partial or bool(items)

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.when != "call" and report.passed:
            return
        found = [
            value for name, value in report.user_properties if name == _CHECK and isinstance(value, dict)
        ]
        for value in found:
            check = Check(**value)
            self.checks[check.golden, check.test] = check
        for name, folder in report.user_properties:
            if name == _FOLDER:
                known = report.passed or any(value["reasons"] for value in found)
                self.folders[str(folder)] = self.folders.get(str(folder), True) and known

    @pytest.hookimpl(optionalhook=True)
    def pytest_testnodedown(self, node: Any, error: object) -> None:
        self.partial = (
            self.partial or error is not None or getattr(node, "workeroutput", {}).get(_PARTIAL, False)
        )

    @pytest.hookimpl(trylast=True)
    def pytest_sessionfinish(self, session: pytest.Session, exitstatus: int) -> None:
        if self.worker:
            vars(self.config)["workeroutput"][_PARTIAL] = self.partial
            return
        if self._whole(exitstatus):
            self.unused = [*self._unused()]
        if self.unused and exitstatus == pytest.ExitCode.OK:
            session.exitstatus = pytest.ExitCode.TESTS_FAILED
        if self.checks:
            self._write()

    def pytest_terminal_summary(self, terminalreporter: Any) -> None:
        for path in self.unused:
            terminalreporter.write_line(f"golden: no test uses {path}; remove it", red=True)
        if any(check.reasons for check in self.checks.values()):
            terminalreporter.write_line(f"golden: look at {_page(self.config)}, then: ringlet approve WHY")

    def _whole(self, exitstatus: int) -> bool:
        """Whether the run was long enough to tell which golden files are unused."""
        stopped = exitstatus not in (pytest.ExitCode.OK, pytest.ExitCode.TESTS_FAILED)
        narrow = any(self.config.getoption(name, None) for name in ("maxfail", "lf", "ignore", "ignore_glob"))
        return not (self.partial or stopped or narrow) and all(map(os.path.isdir, self.config.args))

    def _unused(self) -> Iterator[str]:
        used: dict[str, set[str]] = {folder: set() for folder, known in self.folders.items() if known}
        for check in self.checks.values():
            used.setdefault(str(Path(check.golden).parent), set()).add(check.name)
        for folder, names in sorted(used.items()):
            if self.folders.get(folder):
                yield from (str(Path(folder) / name) for name in unused(Path(folder), names))

    def _write(self) -> None:
        from pipeline.compare.page import comparison_page

        page, checks = _page(self.config), [self.checks[key] for key in sorted(self.checks)]
        write_record(page.parent, checks)
        pairs = [check.pair() for check in checks if not check.name.endswith(".json")]
        figures = [check for check in checks if check.name.endswith(".json") and check.reasons]
        notes = [f"{check.test}: {'; '.join(check.reasons)}" for check in figures]
        notes += [f"no test uses {path}" for path in self.unused]
        page.write_text(comparison_page("Golden pictures", pairs, notes), "utf-8")


def _page(config: pytest.Config) -> Path:
    given = config.getoption("--golden-page")
    return Path(given).absolute() if given else config.rootpath / PAGE


def _golden_folder(config: pytest.Config, test: Path) -> Path:
    given = config.getoption("--golden-dir")
    return Path(given).absolute() / _relative(config, test.parent) if given else test.parent / "golden"


def _relative(config: pytest.Config, folder: Path) -> Path:
    """A folder of tests under the root folder, as it is mirrored elsewhere."""
    return (
        folder.relative_to(config.rootpath) if folder.is_relative_to(config.rootpath) else Path(folder.name)
    )
