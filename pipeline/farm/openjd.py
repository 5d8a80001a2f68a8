"""A run as a job of a render farm: a template of Open Job Description, specification 2023-09.

Steps are the stages, each after those that it needs; frames are the tasks of the last one, in chunks (extension
TASK_CHUNKING). Parameters: config, outputs folder, first and last frame, frames of a task, and the command. Of a sweep,
stages of equal keys are one step, every experiment has a step of frames, and the last step puts them side by side.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pipeline.config import NEEDS, STAGES, Config, stage_keys
from pipeline.config.sweep import Swept

FRAMES_PER_TASK = 8


def template(
    config: Config, file: Path, outputs: Path, folder: Path, settings: Sequence[str] = ()
) -> dict[str, Any]:
    """The template, to be kept in a folder, of a config that was read from `file` with some overrides.

    Paths inside that folder are defaults of the template; others it may not name, so that they have to be given.
    """
    shared = _shared(settings)
    frames = _frames("{{Param.FirstFrame}}-{{Param.LastFrame}}")
    steps = [
        _step(stage, [stage, *shared], NEEDS[stage], frames if stage == "render" else None)
        for stage in STAGES
    ]
    return _job(config.name, _parameters(config, file, outputs, folder), steps)


def sweep_template(
    swept: Swept, file: Path, outputs: Path, folder: Path, settings: Sequence[str] = ()
) -> dict[str, Any]:
    """The template of all experiments of a sweep; as `template`, but for first and last frame."""
    shared = ["sweep", *_shared(settings)]
    steps: dict[str, dict[str, Any]] = {}  # by key
    for number, run in enumerate(swept.runs, start=1):
        config = run.loaded.config
        keys = stage_keys(config)
        for stage in STAGES:
            key = f"{keys[stage]} {number if stage == 'render' else ''}"
            if key not in steps:
                arguments = [*shared, "--only", run.name, "--until", stage]
                frames = _frames(f"1-{config.simulate.frames}") if stage == "render" else None
                needs = [steps[f"{keys[before]} "]["name"] for before in NEEDS[stage]]
                steps[key] = _step(f"{stage} {number}", arguments, needs, frames) | {"description": run.name}
    rendered = [step["name"] for step in steps.values() if "parameterSpace" in step]
    table = _step("table", shared, rendered, None)
    parameters = _parameters(swept.base.config, file, outputs, folder)
    kept = [each for each in parameters if each["name"] not in ("FirstFrame", "LastFrame")]
    return _job(swept.base.config.name, kept, [*steps.values(), table])


def _shared(settings: Sequence[str]) -> list[str]:
    """Arguments of every step."""
    return [
        "{{Param.Config}}",
        "--outputs",
        "{{Param.Outputs}}",
        *(word for setting in settings for word in ("-s", setting)),
    ]


def _job(name: str, parameters: list[dict[str, Any]], steps: list[dict[str, Any]]) -> dict[str, Any]:
    return {
        "specificationVersion": "jobtemplate-2023-09",
        "extensions": ["TASK_CHUNKING"],
        "name": f"ringlet {name}",
        "parameterDefinitions": parameters,
        "steps": steps,
    }


def _inside(folder: Path, path: Path) -> dict[str, str]:
    """The default of a path parameter, which may not lead out of the template's folder."""
    folder, path = folder.resolve(), path.resolve()
    return {"default": str(path.relative_to(folder))} if path.is_relative_to(folder) else {}


def _parameters(config: Config, file: Path, outputs: Path, folder: Path) -> list[dict[str, Any]]:
    frames = config.simulate.frames
    return [
        {
            "name": "Config",
            "type": "PATH",
            "objectType": "FILE",
            "dataFlow": "IN",
            **_inside(folder, file),
            "description": "The config; what it extends and names has to be where it says.",
        },
        {
            "name": "Outputs",
            "type": "PATH",
            "objectType": "DIRECTORY",
            "dataFlow": "INOUT",
            **_inside(folder, outputs),
            "description": "The folder for results, which all machines share.",
        },
        {"name": "FirstFrame", "type": "INT", "minValue": 1, "maxValue": frames, "default": 1},
        {"name": "LastFrame", "type": "INT", "minValue": 1, "maxValue": frames, "default": frames},
        {"name": "FramesPerTask", "type": "INT", "minValue": 1, "default": min(FRAMES_PER_TASK, frames)},
        {
            "name": "Ringlet",
            "type": "STRING",
            "default": "ringlet",
            "description": "The command, where it is not on the path.",
        },
    ]


def _frames(numbers: str) -> dict[str, Any]:
    """Tasks of so many frames each."""
    chunks = {"defaultTaskCount": "{{Param.FramesPerTask}}", "rangeConstraint": "CONTIGUOUS"}
    frames = {"name": "Frames", "type": "CHUNK[INT]", "range": numbers, "chunks": chunks}
    return {"taskParameterDefinitions": [frames]}


def _step(
    name: str, arguments: Sequence[str], needs: Sequence[str], frames: dict[str, Any] | None
) -> dict[str, Any]:
    step: dict[str, Any] = {"name": name}
    if needs:
        step["dependencies"] = [{"dependsOn": other} for other in needs]
    if frames:
        step["parameterSpace"] = frames
        arguments = [*arguments, "--frames", "{{Task.Param.Frames}}"]
    step["script"] = {"actions": {"onRun": {"command": "{{Param.Ringlet}}", "args": [*arguments]}}}
    return step
