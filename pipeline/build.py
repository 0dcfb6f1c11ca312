"""A batch: list the inputs, plan those that are not done, put the data set together."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import asdict
from functools import cache, partial
from importlib.metadata import version
from pathlib import Path

import msgspec

import houseexpo
import pipeline
from houseexpo.errors import ConfigError
from pipeline.algorithm import plan_level
from pipeline.assemble import DataSet, assemble
from pipeline.config_file import BuildConfig
from pipeline.corrections import check_ids, corrected_input
from pipeline.executors.local import Failure, Limits, run
from pipeline.job import Finished, Job, Plan, Refused, Settings, work
from pipeline.overrides import Override
from pipeline.rejection import Reason, Rejection
from pipeline.sources import find, is_path
from pipeline.store import Others, Store
from pipeline.values import Input

Progress = Callable[[str, int, int], None]
"""Called with what is being done, how much of it is done, and of how much."""

_REASONS: Mapping[str, tuple[Reason, str]] = {
    "timeout": (Reason.TIMEOUT, "raise limits.seconds, or simplify the mesh"),
    "memory": (Reason.OUT_OF_MEMORY, "raise limits.memory_gb, or simplify the mesh"),
    "killed": (Reason.OUT_OF_MEMORY, "most often the machine ran out of memory: use fewer workers"),
    "died": (Reason.INTERNAL, "a library crashes on it: please report it"),
    "raised": (Reason.INTERNAL, "this is a fault of the program: please report it"),
}


def build(
    config: BuildConfig,
    out: Path,
    *,
    overrides: Mapping[str, Override],
    workers: int,
    progress: Progress,
    plan: Plan = plan_level,
    others: Others = Others.REFUSE,
) -> DataSet:
    """Build a data set folder; what an earlier run with the same parameters has done is not done again.

    Parameters
    ----------
    config, overrides
        What goes in, with which parameters, and what a person decided otherwise.
    out
        The folder; new, empty, or an earlier build with the same parameters.
    workers
        Processes; the data set does not depend on how many.
    plan
        Turns a level into a plan.
    others
        What becomes of plans of other sources that the folder holds.

    Raises
    ------
    ConfigError
        Where a source is none, or the folder holds something else.
    """
    listed = list_sources(config)
    if config.build.limit is None and others is not Others.ADD:  # else not all of the ids are known
        check_ids(overrides, listed)
    origin = {corrected_input(item, overrides): source for item, source in listed.items()}
    keys = {item: _key(item, config, overrides) for item in origin}
    sources: dict[str, list[str]] = {source: [] for source in dict.fromkeys(origin.values())}
    for item, key in keys.items():
        sources[origin[item]].append(key)
    store = Store.open(out, config.digest(), sources, others)
    stamp = {"generator": "houseexpo", "version": version("houseexpo"), "parameters_sha256": config.digest()}
    settings = Settings(config.planning, config.build.seed, overrides, stamp, plan, config.build.min_quality)
    known = {item: store.known(key) for item, key in keys.items()}
    jobs = [Job(item, entry.content if entry else "") for item, entry in known.items()]
    limits = Limits(config.limits.seconds, int(config.limits.memory_gb * 2**30))
    results = run(partial(work, settings), jobs, workers=workers, limits=limits, preload=[__name__])
    for count, (job, result) in enumerate(results, start=1):
        if result is not None:
            store.done(keys[job.item], _failed(job, result) if isinstance(result, Failure) else result)
        progress("planning", count, len(jobs))
    progress("putting together", 0, 1)
    data_set = assemble(store, config, overrides)
    progress("putting together", 1, 1)
    return data_set


def list_inputs(config: BuildConfig) -> list[Input]:
    """List what the sources hold, sorted by id, each once, up to the limit."""
    return list(list_sources(config))


def list_sources(config: BuildConfig) -> dict[Input, str]:
    """Return what ``list_inputs`` lists, and the source of each: the path in full, or ``procedural:COUNT``.

    Raises
    ------
    ConfigError
        Where a source does not exist, or is none.
    """
    options = config.build
    if not options.sources:
        raise ConfigError("no SOURCE: name one, or a --config whose [build] has sources")
    chosen = {
        "up": options.up,
        "units": options.units,
        "scale": f"{options.scale:g}",
        "storey_height": "" if options.storey_height is None else f"{options.storey_height:g}",
        "furniture": "yes" if options.furniture else "no",
        "seed": str(options.seed),
        "model_path": options.model_path,
    }
    found: dict[Input, str] = {}
    for source in options.sources:
        for item in find(source, **chosen):
            found.setdefault(item, str(Path(source).resolve()) if is_path(source) else source)
    return dict(sorted(found.items(), key=lambda pair: (pair[0].id, pair[0].path))[: options.limit])


def _failed(job: Job, failure: Failure) -> Finished:
    """Return a failure as the input's outcome; it is tried again in the next run, since no content is known of it."""
    reason, advice = _REASONS[failure.kind]
    return Finished("", 0.0, (Refused.of(job.item.id, Rejection("executor", reason, failure.detail, advice)),))


def _key(item: Input, config: BuildConfig, overrides: Mapping[str, Override]) -> str:
    """Return what stands for an input and all that its outcomes depend on but its content, as a hash."""
    own = {name: asdict(override) for name, override in overrides.items() if name.startswith(item.id)}
    parts = (item.id, item.reader, item.path, item.key, item.options, config.digest(), own, _code())
    return hashlib.sha256(msgspec.json.encode(parts)).hexdigest()


@cache
def _code() -> str:
    """Return a hash of the program itself: what another version of it has done is not relied on."""
    digest = hashlib.sha256()
    for package in (houseexpo, pipeline):
        for file in sorted(Path(package.__path__[0]).rglob("*.py")):
            digest.update(file.read_bytes())
    return digest.hexdigest()
