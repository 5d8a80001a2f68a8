"""What make reads: a stamp for each stage, changed only when its key is, and the rules of one config."""

from pathlib import Path

from pipeline.batch.stages import Batch
from pipeline.cache import Experiment, replacing
from pipeline.config import STAGES, Loaded
from pipeline.config.load import named_files

_RULES = """\
# Rules of {config}, written by `ringlet keys`; made again whenever one of these files changes.
{folder}/targets.mk: {files}
{files}:

{stamps} &:
	@$(RINGLET) keys {config}

{groom}: {keys}/groom.key
	@$(RINGLET) groom {config}

{guides}: {groom} {keys}/simulate.key
	@$(RINGLET) simulate {config}

{strands}: {groom} {keys}/interpolate.key
	@$(RINGLET) interpolate {config}

{frames} &: {guides} {strands} {keys}/render.key
	@$(RINGLET) render {config}

{folder}: {frames}

# Every file appears whole, so nothing has to be thrown away when another one fails.
.PRECIOUS: {groom} {guides} {strands} {frames}
"""


def write_stamps(config: Path, loaded: Loaded, experiment: Experiment) -> None:
    """Write keys/<stage>.key where it changed, and targets.mk."""
    batch = Batch(loaded.config, experiment)
    for stage, key in batch.keys.items():
        stamp = _stamp(experiment, stage)
        if not stamp.exists() or stamp.read_text() != key:
            _write(stamp, key)
    rules = _RULES.format(
        config=_escaped(config),
        folder=_escaped(experiment.folder),
        files=" ".join(_escaped(file) for file in _sources(loaded)),
        keys=_escaped(experiment.folder / "keys"),
        stamps=" ".join(_escaped(_stamp(experiment, stage)) for stage in STAGES),
        groom=_escaped(experiment.groom),
        guides=_escaped(experiment.guides),
        strands=_escaped(experiment.strands),
        frames=" ".join(_escaped(frame) for frame in batch.outputs("render")),
    )
    _write(experiment.folder / "targets.mk", rules)


def _stamp(experiment: Experiment, stage: str) -> Path:
    return experiment.folder / "keys" / f"{stage}.key"


def _sources(loaded: Loaded) -> list[Path]:
    """List the config, what it extends and the files that it names."""
    return [*loaded.files, *(path for paths in named_files(loaded.config).values() for path in paths)]


def _write(path: Path, text: str) -> None:
    with replacing(path) as temporary:
        temporary.write_text(text)


def _escaped(path: Path) -> str:
    """Quote what make would take for its own syntax."""
    return str(path).replace("$", "$$").replace("#", "\\#").replace(" ", "\\ ").replace(":", "\\:")
