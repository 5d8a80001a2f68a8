"""`make env` on machines that lack something: it says what to run, and leaves nothing half-made."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[2] / ".ci/environment"


class Machine:
    """A machine whose user, sudo and apt-get are ours to choose."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.program("id", "echo 1000")
        self.program("sudo", "exit 1")
        self.program("apt-get", f'echo "$@" >>{folder}/apt.log')

    def program(self, name: str, body: str) -> Path:
        path = self.folder / "bin" / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(f"#!/bin/sh\n{body}\n")
        path.chmod(0o755)
        return path

    def environment(self, **variables: str) -> subprocess.CompletedProcess[str]:
        path = f"{self.folder / 'bin'}:{os.environ['PATH']}"
        variables = {"PYTHON": sys.executable} | variables
        return subprocess.run(
            [SCRIPT, self.folder / "venv"],
            cwd=SCRIPT.parents[1],
            env=os.environ | {"PATH": path, "CI": ""} | variables,
            capture_output=True,
            text=True,
        )


@pytest.fixture
def machine(tmp_path: Path) -> Machine:
    return Machine(tmp_path)


@pytest.mark.parametrize("works", [True, False])
def test_continuous_integration_tries_to_bring_a_browser_and_goes_on_without(
    machine: Machine, works: bool
) -> None:
    machine.program("sudo", 'shift; exec "$@"')
    machine.program("apt-get", f'echo "$@" >>{machine.folder}/apt.log; exit {0 if works else 1}')
    for name in ("env", "rm"):
        (machine.folder / "bin" / name).symlink_to(shutil.which(name) or name)
    python = machine.program("half-python", f'[ "$1" = -c ] && exec {sys.executable} "$@"; exit 7')
    only = {"PATH": str(machine.folder / "bin"), "PYTHON": str(python), "CXX": "true"}
    result = machine.environment(CI="true", **only)
    log = (machine.folder / "apt.log").read_text().splitlines()
    if any("libegl1" in line or "python3-dev" in line for line in log):
        pytest.skip("this machine lacks OpenGL or the headers of Python")
    assert log == ["update -qq", "install -y -qq chromium"][: 2 if works else 1]
    assert ("will not be tested in a browser" in result.stdout) != works
    assert result.returncode == 7  # from making the environment, which comes next
    (machine.folder / "apt.log").unlink()
    machine.environment(CI="", **only)
    assert not (machine.folder / "apt.log").exists()


def test_without_permission_the_exact_line_is_printed(machine: Machine) -> None:
    result = machine.environment(CXX="no-such-compiler")
    print(result.stderr)
    assert result.returncode != 0
    assert "sudo apt-get install -y g++" in result.stderr
    assert not (machine.folder / "apt.log").exists()
    assert not (machine.folder / "venv").exists()


def test_with_permission_the_packages_are_installed(machine: Machine) -> None:
    machine.program("sudo", 'shift; exec "$@"')
    machine.program("apt-get", f'echo "$@" >>{machine.folder}/apt.log; [ "$1" = update ]')
    result = machine.environment(CXX="no-such-compiler")
    assert (machine.folder / "apt.log").read_text().splitlines() == ["update -qq", "install -y g++ -qq"]
    assert result.returncode != 0
    assert "that failed. Run this, then the same command again" in result.stderr
    assert not (machine.folder / "venv").exists()


def test_an_old_python_is_refused(machine: Machine) -> None:
    old = machine.program("old-python", "exit 1")
    result = machine.environment(PYTHON=str(old))
    assert result.returncode != 0
    assert "Python 3.11 or newer is needed" in result.stderr


def test_a_failed_installation_leaves_no_environment(machine: Machine) -> None:
    python = machine.program(
        "half-python",
        f'[ "$1" = -c ] && exec {sys.executable} "$@"\n'
        'mkdir -p "$3/bin" && printf "#!/bin/sh\\nexit 7\\n" >"$3/bin/python" && chmod +x "$3/bin/python"',
    )
    result = machine.environment(PYTHON=str(python), CXX="true")
    if "sudo apt-get install" in result.stderr:
        pytest.skip("this machine lacks OpenGL or the headers of Python")
    assert result.returncode == 7
    assert not (machine.folder / "venv").exists()
