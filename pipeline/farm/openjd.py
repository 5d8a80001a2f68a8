"""A run as a job of a render farm: a template of Open Job Description, specification 2023-09.

Steps are the stages, each after those that it needs; frames are the tasks of the last one, in chunks (extension
TASK_CHUNKING). Parameters: config, outputs folder, first and last frame, frames of a task, and the command.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pipeline.config import NEEDS, STAGES, Config

FRAMES_PER_TASK = 8


def template(
    config: Config, file: Path, outputs: Path, folder: Path, settings: Sequence[str] = ()
) -> dict[str, Any]:
    """The template, to be kept in a folder, of a config that was read from `file` with some overrides.

    Paths inside that folder are defaults of the template; others it may not name, so that they have to be given.
    """
    shared = ["{{Param.Config}}", "--outputs", "{{Param.Outputs}}"]
    shared += [word for setting in settings for word in ("-s", setting)]
    return {
        "specificationVersion": "jobtemplate-2023-09",
        "extensions": ["TASK_CHUNKING"],
        "name": f"ringlet {config.name}",
        "parameterDefinitions": _parameters(config, _inside(folder, file), _inside(folder, outputs)),
        "steps": [_step(stage, shared) for stage in STAGES],
    }


def _inside(folder: Path, path: Path) -> dict[str, str]:
    """The default of a path parameter, which may not lead out of the template's folder."""
    folder, path = folder.resolve(), path.resolve()
    return {"default": str(path.relative_to(folder))} if path.is_relative_to(folder) else {}


def _parameters(config: Config, file: dict[str, str], outputs: dict[str, str]) -> list[dict[str, Any]]:
    frames = config.simulate.frames
    return [
        {
            "name": "Config",
            "type": "PATH",
            "objectType": "FILE",
            "dataFlow": "IN",
            **file,
            "description": "The config; what it extends and names has to be where it says.",
        },
        {
            "name": "Outputs",
            "type": "PATH",
            "objectType": "DIRECTORY",
            "dataFlow": "INOUT",
            **outputs,
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


def _step(stage: str, arguments: list[str]) -> dict[str, Any]:
    step: dict[str, Any] = {"name": stage}
    if NEEDS[stage]:
        step["dependencies"] = [{"dependsOn": name} for name in NEEDS[stage]]
    arguments = [stage, *arguments]
    if stage == "render":
        arguments += ["--frames", "{{Task.Param.Frames}}"]
        step["parameterSpace"] = {
            "taskParameterDefinitions": [
                {
                    "name": "Frames",
                    "type": "CHUNK[INT]",
                    "range": "{{Param.FirstFrame}}-{{Param.LastFrame}}",
                    "chunks": {
                        "defaultTaskCount": "{{Param.FramesPerTask}}",
                        "rangeConstraint": "CONTIGUOUS",
                    },
                }
            ]
        }
    step["script"] = {"actions": {"onRun": {"command": "{{Param.Ringlet}}", "args": arguments}}}
    return step
