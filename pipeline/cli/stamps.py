"""What make reads: a stamp for each stage, changed only when its key is, and the rules of one config."""

import hashlib
import json
import os
import time
from collections.abc import Iterable, Sequence
from pathlib import Path

from pipeline.batch.stages import Batch
from pipeline.batch.sweep import batch_of
from pipeline.cache import Experiment, replacing
from pipeline.config import STAGES, Loaded
from pipeline.config.load import named_files
from pipeline.config.sweep import load_sweep

_RULES = """\
# Rules of {config}, written by `ringlet keys`; made again whenever one of these files changes.
equals := =
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

{frames} {report} &: {guides} {strands} {keys}/render.key
	@$(RINGLET) render {config} $(if $(WORKERS),--workers $(WORKERS))

{folder}: {frames} {report}

.PHONY: {folder}/sweep
{sweep}
# Every file appears whole, so nothing has to be thrown away when another one fails.
.PRECIOUS: {groom} {guides} {strands} {frames} {report}
"""

_SWEEP = """\
{folder}/sweep: {products}

{products} &: {stamp}
	@$(RINGLET) sweep {config} $(if $(WORKERS),--workers $(WORKERS))

.PRECIOUS: {products}
"""

_NO_SWEEP = """\
{folder}/sweep:
	@$(RINGLET) sweep {config}
"""


def write_stamps(config: Path, loaded: Loaded, experiment: Experiment) -> None:
    """Write keys/<stage>.key where it changed, for a sweep also keys/sweep.key, and targets.mk."""
    batch = Batch(loaded.config, experiment)
    runs = load_sweep(config).runs if loaded.config.sweep else ()
    batches = [batch_of(run, experiment.folder.parent) for run in runs]
    keys = batch.keys | ({"sweep": _together(batches)} if batches else {})
    products = [path for each in (batch, *batches) for stage in STAGES for path in each.outputs(stage)]
    _settle([*products, experiment.report, *(_stamp(experiment, stage) for stage in keys)])
    for stage, key in keys.items():
        stamp = _stamp(experiment, stage)
        if not stamp.exists() or stamp.read_text() != key:
            _write(stamp, key)
    sources = dict.fromkeys(
        path for each in (loaded, *(run.loaded for run in runs)) for path in _sources(each)
    )
    swept = [path for each in batches for stage in STAGES for path in each.outputs(stage)]
    rules = _RULES.format(
        config=_escaped(config),
        folder=_escaped(experiment.folder),
        files=_listed(sources),
        keys=_escaped(experiment.folder / "keys"),
        stamps=_listed(_stamp(experiment, stage) for stage in keys),
        groom=_escaped(experiment.groom),
        guides=_escaped(experiment.guides),
        strands=_escaped(experiment.strands),
        report=_escaped(experiment.report),
        frames=_listed(batch.outputs("render")),
        sweep=(_SWEEP if batches else _NO_SWEEP).format(
            config=_escaped(config),
            folder=_escaped(experiment.folder),
            stamp=_escaped(_stamp(experiment, "sweep")),
            products=_listed(
                [*swept, *(experiment.folder / f"sweep.{kind}" for kind in ("json", "csv", "html"))]
            ),
        ),
    )
    _write(experiment.folder / "keys" / "sources", "".join(map(_signature, sources)))
    _write(experiment.folder / "targets.mk", rules)


def _settle(paths: Iterable[Path]) -> None:
    """Take files from the future, made before the clock went back, into the present: no edit would be newer than they are."""
    now = time.time()
    for path in paths:
        if path.exists() and path.stat().st_mtime > now:
            os.utime(path, (now - 1, now - 1))


def _signature(path: Path) -> str:
    """What `stat -c '%.9Y %s %n'` says of a file, a line."""
    status = path.stat()
    seconds, rest = divmod(status.st_mtime_ns, 10**9)
    return f"{seconds}.{rest:09d} {status.st_size} {path}\n"


def _together(batches: Sequence[Batch]) -> str:
    """The key of all experiments of a sweep."""
    text = json.dumps([[batch.experiment.folder.name, batch.keys] for batch in batches], sort_keys=True)
    return hashlib.blake2b(text.encode(), digest_size=16).hexdigest()


def _stamp(experiment: Experiment, stage: str) -> Path:
    return experiment.folder / "keys" / f"{stage}.key"


def _sources(loaded: Loaded) -> list[Path]:
    """List the config, what it extends and the files that it names."""
    return [*loaded.files, *(path for paths in named_files(loaded.config).values() for path in paths)]


def _write(path: Path, text: str) -> None:
    with replacing(path) as temporary:
        temporary.write_text(text)


def _listed(paths: Iterable[Path]) -> str:
    return " ".join(_escaped(path) for path in paths)


def _escaped(path: Path) -> str:
    """Quote what make would take for its own syntax."""
    return (
        str(path)
        .replace("$", "$$")
        .replace("#", "\\#")
        .replace(" ", "\\ ")
        .replace(":", "\\:")
        .replace("=", "$(equals)")
    )
