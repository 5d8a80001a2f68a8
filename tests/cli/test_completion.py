"""The shells' completion scripts: bash's is run; those of the other shells name every command."""

import shutil
import subprocess
from pathlib import Path

import pytest

from pipeline.cli.main import app, call

COMPLETE = """
source "$1"; shift
COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); COMP_LINE="$*"; COMP_POINT=${#COMP_LINE}
"$(complete -p ringlet | sed -E 's/.*-F ([^ ]+) .*/\\1/')" ringlet "${COMP_WORDS[-1]}" "${COMP_WORDS[-2]}"
printf '%s\\n' "${COMPREPLY[@]}"
"""


@pytest.fixture
def script(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Path:
    assert call(["completion", "bash"]) == 0
    path = tmp_path / "ringlet.bash"
    path.write_text(capsys.readouterr().out)
    return path


def completed(script: Path, *words: str, cwd: Path | None = None) -> set[str]:
    """What bash offers for the last of these words."""
    command = ["bash", "--norc", "-c", COMPLETE, "bash", str(script), *words]
    result = subprocess.run(command, capture_output=True, text=True, check=True, cwd=cwd)
    assert result.stderr == ""
    return set(result.stdout.split())


@pytest.mark.skipif(shutil.which("bash") is None, reason="no bash")
def test_bash_completes_commands_options_values_and_files(script: Path, tmp_path: Path) -> None:
    assert completed(script, "ringlet", "st") == {"status"}
    assert {"run", "groom", "doctor", "completion"} <= completed(script, "ringlet", "")
    assert completed(script, "ringlet", "run", "--fo") == {"--force"}
    assert {"--frames", "--outputs", "--set"} <= completed(script, "ringlet", "render", "--")
    assert completed(script, "ringlet", "run", "--log-format", "j") == {"json"}
    assert completed(script, "ringlet", "bench", "interpolation") == {"interpolation-error"}
    (tmp_path / "curly.toml").touch()
    assert completed(script, "ringlet", "run", "cur", cwd=tmp_path) == {"curly.toml"}


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_every_command_is_known_to_every_shell(shell: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert call(["completion", shell]) == 0
    text = capsys.readouterr().out
    commands = [name for name in app if not name.startswith("-")]
    assert len(commands) > 15
    assert [name for name in commands if name not in text] == []
    if shutil.which(shell):
        checked = subprocess.run([shell, "-n"], input=text, capture_output=True, text=True)
        assert (checked.returncode, checked.stderr) == (0, "")


def test_an_unknown_shell_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert call(["completion", "tcsh"]) == 2
    assert "bash" in capsys.readouterr().err
