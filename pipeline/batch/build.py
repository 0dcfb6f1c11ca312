"""A batch: list the inputs, plan those that are not done, put the data set together.

A run that finds everything as it was reads no input and writes nothing; what changed is seen by path, size and time,
and then by content. What it keeps and how: ``journal``, ``plans``, ``folder``.
"""

from __future__ import annotations

import contextlib
import itertools
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from importlib.metadata import version
from pathlib import Path

import msgspec

from houseexpo.errors import ConfigError
from pipeline.algorithm import plan_level
from pipeline.batch import disk
from pipeline.batch.assemble import DataSet, Parts, assemble
from pipeline.batch.entry import Entry, identity, ordered
from pipeline.batch.files import files_of, look_same
from pipeline.batch.folder import Folder, Others
from pipeline.batch.job import Job, Plan, Settings, not_yet, work
from pipeline.batch.journal import Journal
from pipeline.batch.listing import Listing
from pipeline.batch.lock import locked
from pipeline.batch.plans import DamagedPlanError, Plans
from pipeline.batch.recipe import recipe, versions
from pipeline.config_file import BuildConfig
from pipeline.corrections import check_ids, corrected_input
from pipeline.executors.local import Failure, Limits, run
from pipeline.overrides import Override
from pipeline.rejection import Reason, Rejection

Progress = Callable[[str, int, int], None]
"""Called with what is being done, how much of it is done, and of how much."""

_REASONS: Mapping[str, tuple[Reason, str]] = {
    "timeout": (Reason.TIMEOUT, "raise limits.seconds, or simplify the mesh"),
    "memory": (Reason.OUT_OF_MEMORY, "raise limits.memory_gb, or simplify the mesh"),
    "died": (Reason.INTERNAL, "a library crashes on it: please report it"),
    "raised": (Reason.INTERNAL, "this is a fault of the program: please report it"),
}


def _unheard(entry: Entry) -> None:
    """Leave unsaid what came of an input."""


def build(
    config: BuildConfig,
    out: Path,
    *,
    overrides: Mapping[str, Override],
    workers: int,
    progress: Progress,
    plan: Plan = plan_level,
    others: Others = Others.REFUSE,
    rehash: bool = False,
    ended: Callable[[Entry], None] = _unheard,
) -> DataSet:
    """Build a data set folder; what an earlier run has done is not done again.

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
    rehash
        Read every input to see whether it changed, however it looks.
    ended
        Called with what came of each input that was at work.

    Raises
    ------
    ConfigError
        Where a source is none, the folder holds something else, or another build is at work in it.
    """
    listing, folder = Listing(config), Folder(out)
    listing.check()
    folder.check(config.digest(), others)
    if overrides and config.build.limit is None and others is not Others.ADD:  # else not all of the ids are known
        check_ids(overrides, (item for _, item in listing))
    folder.build.mkdir(parents=True, exist_ok=True)
    with locked(folder.build / "lock"):
        folder.check(config.digest(), others)  # again: the build that held the lock may have changed it
        with contextlib.closing(Journal(folder.build / "journal.jsonl")) as journal:
            beside = _beside(journal, listing, folder, others)
            folder.start(config.digest())
            plans = Plans(folder.build / "plans")
            batch = _Batch(listing, journal, plans, overrides, rehash, beside, ended)
            stamp = {"generator": "houseexpo", "version": version("houseexpo"), "parameters_sha256": config.digest()}
            settings = Settings(
                config.planning, config.build.seed, overrides, stamp, versions(), plan, plans, config.build.min_quality
            )
            return replace(batch.run(settings, folder, workers, progress), ignored=listing.ignored())


@dataclass
class _Batch:
    """A build under its lock; ``beside`` are sources that it does not list and whose plans stay."""

    listing: Listing
    journal: Journal
    plans: Plans
    overrides: Mapping[str, Override]
    rehash: bool
    beside: list[str]
    ended: Callable[[Entry], None]
    listed: set[str] = field(default_factory=set)
    unfinished: dict[str, Entry] = field(default_factory=dict)

    def run(self, settings: Settings, folder: Folder, workers: int, progress: Progress) -> DataSet:
        """Plan what is not done, and put the data set together; a plan that was damaged since is made again."""
        self.plans.sweep()
        while True:
            self.listed.clear()
            self.unfinished.clear()
            self._plan(settings, workers, progress)
            self._forget()
            self.journal.sync()
            entries = ordered([*self.journal.current(), *self.unfinished.values()])
            sources = [*self.listing.sources, *self.beside]
            parts = Parts(folder, self.plans, entries, sources, self.listing.config, self.overrides)
            try:
                return assemble(parts, progress)
            except DamagedPlanError as damaged:
                self._mend(damaged, folder)

    def _plan(self, settings: Settings, workers: int, progress: Progress) -> None:
        config = self.listing.config
        limits = Limits(config.limits.seconds, int(min(config.limits.memory_gb * 2**30, 2**62)))
        total, count = self.listing.total(), 0
        jobs = self._jobs()
        first = next(jobs, None)
        if first is not None:  # else all is done, and no worker need start
            todo = itertools.chain([first], jobs)
            results = run(partial(work, settings), todo, workers=workers, limits=limits, preload=[__name__])
            for job, result in results:
                self._done(_failed(job, result) if isinstance(result, Failure) else result)
                count = max(count + 1, len(self.listed) - 8 * workers)
                progress("planning", count, total)
        progress("planning", len(self.listed), len(self.listed))

    def _jobs(self) -> Iterator[Job]:
        """Yield what is to be done; what is done and looks as it did is noted as listed."""
        config = self.listing.config
        for source, listed in self.listing:
            name = identity(listed)
            if name in self.listed:
                continue
            self.listed.add(name)
            item = corrected_input(listed, self.overrides)
            how = recipe(item, config, self.overrides)
            entry = self.journal.get(name)
            if entry is None or entry.recipe != how or not all(map(self.plans.stands, entry.plans)):
                yield Job(item, source, how)
            elif self.rehash or not look_same(item, entry.files):
                yield Job(item, source, how, entry)
            elif entry.gone or entry.source != source:
                self.journal.put(msgspec.structs.replace(entry, source=source, gone=False))

    def _done(self, entry: Entry) -> None:
        self.ended(entry)
        if entry.passing:
            self.unfinished[entry.input] = entry
        else:
            self.journal.put(entry)

    def _forget(self) -> None:
        """Note which inputs are listed no longer; what came of them stays known."""
        for source in set(self.journal.sources()) - set(self.beside):
            for name in list(self.journal.names(source)):
                entry = self.journal.get(name)
                if entry is not None and (name not in self.listed or name in self.unfinished):
                    self.journal.put(msgspec.structs.replace(entry, gone=True))

    def _mend(self, damaged: DamagedPlanError, folder: Folder) -> None:
        """Take a plan that the store has lost from ``json/``, or give up what no source lists any more."""
        kept = damaged.kept
        with contextlib.suppress(OSError, DamagedPlanError):
            self.plans.put(kept.id, kept.content, (folder.json / f"{kept.id}.json").read_bytes())
            self.plans.get(kept)
            return
        for source in self.beside:
            for name in list(self.journal.names(source)):
                entry = self.journal.get(name)
                if entry is not None and kept in entry.plans:
                    self.journal.put(msgspec.structs.replace(entry, gone=True))


def _beside(journal: Journal, listing: Listing, folder: Folder, others: Others) -> list[str]:
    """Return the sources whose plans stay although this build does not list them."""
    found = [source for source in journal.sources() if source not in listing.sources]
    if not found or others is Others.REPLACE:
        return []
    asked = {identity(item) for _, item in listing}
    beside = [source for source in found if not asked.issuperset(journal.names(source))]
    if beside and others is Others.REFUSE:
        raise ConfigError(
            f"{folder.root}: holds plans of other sources ({', '.join(map(disk.printable, beside))}); --add keeps them "
            "beside the new ones, --replace removes them, or choose another --out"
        )
    return beside


def _failed(job: Job, failure: Failure) -> Entry:
    """Return what came of an input whose worker could not say it."""
    if failure.kind == "killed":
        return job.refused(not_yet(f"{failure.detail}; most often memory ran out: use fewer workers"), passing=True)
    reason, advice = _REASONS[failure.kind]
    entry = job.refused(Rejection("executor", reason, failure.detail, advice))
    return msgspec.structs.replace(entry, files=files_of(job.item), versions=dict(versions()))
