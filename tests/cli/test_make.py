"""What make runs, and what it leaves alone: the rules of the Makefile with stages that take no time."""

import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import fake_ringlet
import pytest
from small_configs import SWATCH

ROOT = Path(__file__).parents[2]

SOURCES = ("requirements.lock", "pyproject.toml", ".ci/environment", "pipeline/kernels/CMakeLists.txt")
BUILT = (".venv/.complete", "build/kernels/.built", "pipeline/errors.py")

BASE = SWATCH + "[simulate]\nframes = 3\n[render]\nsamples = 1\n"


class Project:
    """A folder with our Makefile and its own configs; `make` returns the stages that ran."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        if (folder / "Makefile").exists():
            return
        shutil.copy(ROOT / "Makefile", folder)
        for name in (*SOURCES, *BUILT):
            path = folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.touch()
        (folder / "configs" / "ci").mkdir(parents=True)
        self.write("default", BASE)
        self.write("curly", 'extends = "default.toml"\nseed = 2\n')
        self.write("ci/small", 'extends = "../default.toml"\nname = "ci-small"\n')

    def write(self, name: str, text: str) -> None:
        path = self.folder / "configs" / f"{name}.toml"
        path.write_text(text)

    def run(self, *arguments: str) -> subprocess.CompletedProcess[str]:
        log = self.folder / "log"
        log.write_text("")
        environment = os.environ | {"RINGLET_TEST_LOG": str(log), "PYTHONPATH": str(ROOT)}
        environment = {key: value for key, value in environment.items() if not key.startswith("MAKE")}
        command = ["make", *arguments, f"RINGLET={sys.executable} {fake_ringlet.__file__}"]
        return subprocess.run(command, cwd=self.folder, env=environment, capture_output=True, text=True)

    def make(self, *arguments: str) -> list[str]:
        result = self.run(*arguments)
        assert result.returncode == 0, result.stderr
        return [line for line in self.log() if line != "keys"]

    def log(self) -> list[str]:
        return (self.folder / "log").read_text().splitlines()

    def frame(self, number: int, name: str = "default") -> Path:
        return self.folder / "outputs" / name / "frames" / f"{number:04d}.png"


ALL = ["groom", "simulate", "interpolate", "render 1 2 3"]


@pytest.fixture
def project(tmp_path: Path) -> Project:
    return Project(tmp_path)


@pytest.fixture(scope="module")
def rendered_once(tmp_path_factory: pytest.TempPathFactory) -> Path:
    project = Project(tmp_path_factory.mktemp("rendered"))
    assert project.make("render") == ALL
    return project.folder


@pytest.fixture
def rendered(rendered_once: Path, tmp_path: Path) -> Project:
    """A project after its first `make render`; the times of its files are kept."""
    shutil.copytree(rendered_once, tmp_path / "copy")
    return Project(tmp_path / "copy")


def test_a_second_make_starts_no_python_and_says_that_nothing_is_to_be_done(rendered: Project) -> None:
    start = time.perf_counter()
    result = rendered.run("render")
    print(f"second make render: {time.perf_counter() - start:.3f} s")
    assert rendered.log() == []
    assert "Nothing to be done for 'render'" in result.stdout


def test_editing_the_render_reruns_only_the_render(rendered: Project) -> None:
    rendered.write("default", BASE.replace("samples = 1", "samples = 2"))
    assert rendered.make("render") == ["render 1 2 3"]
    assert rendered.make("render") == []


def test_editing_a_light_reruns_only_the_render(rendered: Project) -> None:
    rendered.write("default", BASE + "[[scene.lights]]\ndirection = [0, 1, 0]\n")
    assert rendered.make("render") == ["render 1 2 3"]


def test_editing_a_comment_reruns_nothing(rendered: Project) -> None:
    rendered.write("default", "# a remark\n" + BASE)
    assert rendered.make("render") == []
    assert rendered.run("render").stdout == "make: Nothing to be done for 'render'.\n"


def test_editing_the_program_asks_for_new_keys_and_reruns_only_what_uses_it(rendered: Project) -> None:
    (rendered.folder / "pipeline/errors.py").touch()
    assert rendered.make("render") == []
    assert rendered.log() == ["keys"]


def test_editing_the_simulation_reruns_what_follows_from_it(rendered: Project) -> None:
    rendered.write("default", BASE.replace("[simulate]", "[simulate]\ntheta = 0.7"))
    assert rendered.make("render") == ["simulate", "render 1 2 3"]


def test_a_clock_that_went_back_hides_no_edit(rendered: Project) -> None:
    """All that was made is of tomorrow; make, which compares times, would take no edit of today for newer."""
    tomorrow = time.time() + 86400
    for path in (rendered.folder / "outputs").rglob("*"):
        os.utime(path, (tomorrow, tomorrow))
    rendered.write("default", BASE.replace("samples = 1", "samples = 2"))
    assert rendered.make("render") == ["render 1 2 3"]
    assert rendered.make("render") == []
    assert rendered.log() == []
    rendered.frame(2).unlink()
    assert rendered.make("render") == ["render 2"]
    assert rendered.make("render") == []
    assert rendered.log() == []


def test_a_clock_that_went_back_alone_reruns_nothing(rendered: Project) -> None:
    for path in (rendered.folder / "outputs").rglob("*"):
        os.utime(path, (time.time() + 86400,) * 2)
    assert rendered.make("render") == []
    assert rendered.make("render") == []
    assert rendered.log() == []


@pytest.mark.parametrize("age", [0, 10 * 365 * 86400], ids=["same time", "older"])
def test_another_file_in_the_place_of_the_config_is_an_edit(rendered: Project, age: int) -> None:
    """As `mv` and `cp -p` leave it: with a time at which make looks in vain."""
    config = rendered.folder / "configs" / "default.toml"
    then = config.stat().st_mtime - age
    rendered.write("default", BASE.replace("samples = 1", "samples = 2 # finer"))
    os.utime(config, (then, then))
    assert rendered.make("render") == ["render 1 2 3"]
    assert rendered.make("render") == []
    assert rendered.log() == []


def test_deleting_one_picture_remakes_only_that_picture(rendered: Project) -> None:
    rendered.frame(2).unlink()
    assert rendered.make("render") == ["render 2"]
    assert rendered.make("render") == []


def test_a_damaged_picture_is_remade_when_asked_for(rendered: Project) -> None:
    data = rendered.frame(3).read_bytes()
    rendered.frame(3).write_bytes(data[:-3])
    rendered.frame(1).unlink()
    assert rendered.make("render") == ["render 1 3"]


def test_an_old_time_with_the_right_content_is_verified_once(rendered: Project) -> None:
    for path in (rendered.folder / "outputs").rglob("*.h5"):
        os.utime(path, (1, 1))
    assert rendered.make("render") == []
    assert rendered.log() == []
    rendered_now = rendered.run("render")
    assert "Nothing to be done" in rendered_now.stdout


def test_a_deleted_stage_is_remade_and_what_follows_is_verified(rendered: Project) -> None:
    (rendered.folder / "outputs/default/groom.h5").unlink()
    assert rendered.make("render") == ["groom"]
    assert "Nothing to be done" in rendered.run("render").stdout


def test_every_config_is_a_target_by_name_and_by_folder(project: Project) -> None:
    assert project.make("curly") == ALL
    assert project.make("outputs/curly") == []
    assert project.make("outputs/ci-small") == ALL
    project.write("new", 'extends = "curly.toml"\nseed = 9\n')
    assert project.make("new") == ALL
    assert project.frame(3, "new").exists()
    assert project.make("render", "CONFIG=configs/new.toml") == []


def test_editing_a_parent_reaches_the_child(project: Project) -> None:
    project.make("curly")
    project.write("default", BASE.replace("samples = 1", "samples = 2"))
    assert project.make("curly") == ["render 1 2 3"]


def test_several_experiments_at_once(project: Project) -> None:
    ran = project.make("-j4", "render", "curly", "ci-small")
    # default and ci-small differ in nothing but their names: all but the frames, which tell them, is made once
    assert sorted(ran) == sorted(ALL * 2 + ["render 1 2 3"])
    assert project.make("-j4", "render", "curly", "ci-small") == []


def test_more_frames_rerun_what_depends_on_their_number(rendered: Project) -> None:
    rendered.write("default", BASE.replace("frames = 3", "frames = 4"))
    assert rendered.make("render") == ["simulate", "render 1 2 3 4"]


SWEEP = BASE + '[sweep]\n"simulate.theta" = [0.6, 0.7]\n"render.exposure" = [1.0, 2.0]\n'


def test_a_sweep_makes_shared_stages_once_and_then_nothing(project: Project) -> None:
    project.write("default", SWEEP)
    ran = project.make("sweep")
    assert sorted(ran) == sorted(["groom", "interpolate", *2 * ["simulate"], *4 * ["render 1 2 3"]])
    assert project.make("sweep") == []
    assert "Nothing to be done for 'sweep'" in project.run("sweep").stdout
    project.frame(2, "default@theta=0.7,exposure=2.0").unlink()
    assert project.make("sweep") == ["render 2"]
    project.write("default", SWEEP.replace("[1.0, 2.0]", "[1.0, 3.0]"))
    assert project.make("sweep") == ["render 1 2 3", "render 1 2 3"]
    project.write("default", SWEEP.replace("[1.0, 2.0]", "[3.0, 1.0] # in another order"))
    assert project.make("sweep") == []
    assert project.make("render") == ["render 1 2 3"]  # the config without its sweep shares what it can


def test_a_config_without_a_sweep_says_so(project: Project) -> None:
    result = project.run("sweep")
    assert result.returncode == 2
    assert "configs/default.toml: sweep: has to be set" in result.stderr


def test_nothing_to_do_for_twenty_configs_and_a_sweep_of_twenty_takes_no_time(project: Project) -> None:
    names = [f"config{number}" for number in range(20)]
    for number, name in enumerate(names):
        project.write(name, f'extends = "default.toml"\nseed = {number}\n')
    seeds = ", ".join(str(number) for number in range(20))
    project.write("many", f'extends = "default.toml"\n[sweep]\nseed = [{seeds}]\n')
    project.make("-j2", *names)
    project.make("sweep", "CONFIG=configs/many.toml")
    for goals in (names, ["sweep", "CONFIG=configs/many.toml"]):
        best = float("inf")
        for _ in range(3):
            before = os.times()
            assert project.make(*goals) == []
            after = os.times()
            best = min(
                best,
                after.children_user + after.children_system - before.children_user - before.children_system,
            )
        print(f"nothing to do for {goals[0]} and so on: {best:.3f} s of processor time")
        assert best < 0.5


def test_a_wrong_config_stops_make_with_our_message(project: Project) -> None:
    project.write("default", BASE.replace("samples", "smaples"))
    result = project.run("render")
    assert result.returncode == 2
    assert "configs/default.toml:8: render.smaples: unknown key; did you mean 'samples'?" in result.stderr
    assert "Traceback" not in result.stderr


def test_other_targets_read_no_config(project: Project) -> None:
    project.write("default", "not toml")
    assert project.run("help").returncode == 0
    assert project.log() == []
