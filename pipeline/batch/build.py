"""Build a data set folder: list the inputs, plan those that no earlier run has done, and assemble the plans.

A run that finds everything as it was reads no input and writes nothing; what changed is seen by path, size and time,
and then by content. What it keeps and how: ``journal``, ``plan_store``, ``data_set_folder``.
"""

from __future__ import annotations

import contextlib
import tempfile
import threading
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import msgspec

from houseexpo.corrections import Override
from houseexpo.errors import ConfigError
from pipeline.batch import disk
from pipeline.batch.assemble import (
    AssemblyParts,
    BuildResult,
    Rights,
    assemble,
    common_rights,
    load_while_workers_start,
    names_without_folders,
    rights_by_source,
    stated_licences,
)
from pipeline.batch.data_set_folder import DataSetFolder, ExistingPlansPolicy
from pipeline.batch.disk import lock_folder
from pipeline.batch.entry import Entry, sort_entries
from pipeline.batch.job import Plan
from pipeline.batch.journal import Journal
from pipeline.batch.listing import Listing
from pipeline.batch.plan_store import DamagedPlanError, PlanStore
from pipeline.batch.planning import Planning, Progress, ignore_outcome
from pipeline.batch.result_store import BUILD, FolderStore, Store
from pipeline.config_file import BuildConfig
from pipeline.executors import local
from pipeline.executors.local import Executor
from pipeline.overrides import check_override_ids, settle_override_ids

__all__ = ["Progress", "build", "refuse_unlisted_sources"]

_JOURNAL = "journal.jsonl"


def build(
    config: BuildConfig,
    out: Path,
    *,
    overrides: Mapping[str, Override],
    workers: int,
    progress: Progress,
    plan: Plan | None = None,
    others: ExistingPlansPolicy = ExistingPlansPolicy.REFUSE,
    rehash: bool = False,
    ended: Callable[[Entry], None] = ignore_outcome,
    execute: Executor | None = None,
    known: Iterable[Entry] = (),
) -> BuildResult:
    """Build a data set folder; inputs that an earlier run has done are not planned again.

    Parameters
    ----------
    config, overrides
        What goes in, with which parameters, and what a person decided otherwise.
    out
        The folder; new, empty, or an earlier build with the same parameters.
    workers
        Processes; the data set does not depend on how many.
    plan
        Turns a level into plans; Algorithm 1 by default, with pictures of its stages where the settings keep them.
    others
        What becomes of plans of other sources that the folder holds.
    rehash
        Read every input to see whether it changed, however it looks.
    ended
        Called with what came of each input that was at work.
    execute
        Does the work; by default ``workers`` processes of this machine.
    known
        What came of inputs that were planned elsewhere; their plans are in the folder's store.

    Raises
    ------
    ConfigError
        Where a source is not valid, the folder lies in a source or holds something else, or another build uses it.
    """
    listing, folder = Listing(config), DataSetFolder(out)
    listing.check()
    listing.check_apart(out)
    folder.check(config, others)
    overrides = settle_override_ids(overrides or {}, (item for _, item in listing) if overrides else ())
    if (
        overrides and config.build.limit is None and others is not ExistingPlansPolicy.ADD
    ):  # else not all of the ids are known
        check_override_ids(overrides, (item for _, item in listing))
    folder.build.mkdir(parents=True, exist_ok=True)
    with lock_folder(folder.build / "lock"):
        folder.check(config, others)  # again: the build that held the lock may have changed it
        with contextlib.closing(Journal(folder.build / _JOURNAL)) as journal:
            beside = _unlisted_sources(journal, listing, folder, others)
            folder.start(config)
            for entry in known:
                if journal.get(entry.input) != entry:
                    journal.put(entry)
            plans = PlanStore(FolderStore(out.absolute()))
            planned = threading.Event()

            def note(entry: Entry) -> None:
                planned.set()
                ended(entry)

            begins = partial(load_while_workers_start, planned)
            planning = Planning(listing, journal, plans, overrides, rehash, ended=note, begins=begins)
            own = Rights(config.build.licence, config.build.credit)
            rights = rights_by_source(folder, dict.fromkeys(listing.sources, own), beside)
            batch = _Batch(planning, journal, beside, common_rights(rights))
            data_set = batch.run(plan, folder, execute or partial(local.run, workers=workers), progress)
            return replace(
                data_set,
                ignored=listing.count_ignored(),
                links=listing.links_left_out(),
                passed_over=listing.passed_over,
                licences=stated_licences(rights),
                sources=listing.sources,
                overrides=overrides,
            )


@dataclass
class _Batch:
    """A build under its lock; ``beside`` are sources that it does not list and whose plans stay.

    ``rights`` is what all of the sources agree on.
    """

    planning: Planning
    journal: Journal
    beside: list[str]
    rights: Rights

    def run(self, plan: Plan | None, folder: DataSetFolder, execute: Executor, progress: Progress) -> BuildResult:
        """Plan what is not done, and put the data set together; a plan that was damaged since is made again."""
        planning = self.planning
        planning.plans.sweep()
        while True:
            planning.run(plan, execute, progress)
            self._forget()
            self.journal.sync()
            entries = sort_entries([*self.journal.current(), *planning.unfinished.values()])
            sources = [*planning.listing.sources, *self.beside]
            asked = planning.listing.config, planning.overrides
            parts = AssemblyParts(folder, planning.plans, entries, sources, *asked, self.rights)
            try:
                return assemble(parts, progress)
            except DamagedPlanError as damaged:
                self._mend(damaged, folder)

    def _forget(self) -> None:
        """Note which inputs are listed no longer; what came of them stays known."""
        for source in set(self.journal.sources()) - set(self.beside):
            for name in list(self.journal.names(source)):
                entry = self.journal.get(name)
                if entry is not None and (name not in self.planning.listed or name in self.planning.unfinished):
                    self.journal.put(msgspec.structs.replace(entry, gone=True))

    def _mend(self, damaged: DamagedPlanError, folder: DataSetFolder) -> None:
        """Take what the store has lost from the data set, or give it up where no source lists it any more.

        The picture of a plan's stages is given up before the plan.
        """
        kept, plans = damaged.kept, self.planning.plans
        with contextlib.suppress(OSError, DamagedPlanError):
            picture = (folder.stages / f"{kept.id}.png").read_bytes() if kept.stages is not None else b""
            plans.put(kept.id, kept.content, (folder.json / f"{kept.id}.json").read_bytes(), picture)
            plans.get(kept)
            plans.picture(kept)
            return
        bare = msgspec.structs.replace(kept, stages=None)
        for source in self.beside:
            for name in list(self.journal.names(source)):
                entry = self.journal.get(name)
                if entry is not None and kept in entry.plans:
                    left = [bare if each == kept else each for each in entry.plans]
                    self.journal.put(msgspec.structs.replace(entry, plans=left, gone=kept == bare))


def refuse_unlisted_sources(listing: Listing, store: Store) -> None:
    """Raise ConfigError if a store holds plans of sources that the shards do not list.

    That would be found when the shards are put together, after all the work.
    """
    try:
        lines = store.get(f"{BUILD}/{_JOURNAL}")
    except OSError:
        return
    with tempfile.TemporaryDirectory(prefix="houseexpo-") as scratch:
        file = Path(scratch) / _JOURNAL
        file.write_bytes(lines)
        with contextlib.closing(Journal(file)) as journal:
            beside = _of_others(journal, listing)
    if beside:
        raise _holds(store.name, beside, "shards have a place of their own; choose another --out")


def _unlisted_sources(
    journal: Journal, listing: Listing, folder: DataSetFolder, others: ExistingPlansPolicy
) -> list[str]:
    """Return the sources whose plans stay although this build does not list them."""
    if not journal.sources() and others is not ExistingPlansPolicy.REPLACE:
        _check_unknown(listing, folder)
    if others is ExistingPlansPolicy.REPLACE:
        return []
    beside = _of_others(journal, listing)
    if beside and others is ExistingPlansPolicy.REFUSE:
        advice = "--add keeps them beside the new ones, --replace removes them, or choose another --out"
        raise _holds(str(folder.root), beside, advice)
    return beside


def _of_others(journal: Journal, listing: Listing) -> list[str]:
    """Return the sources of which a journal knows an input that is not listed."""
    found = [source for source in journal.sources() if source not in listing.sources]
    asked = {listing.identity(item) for _, item in listing} if found else set()
    return [source for source in found if not asked.issuperset(journal.names(source))]


def _holds(place: str, sources: Iterable[str], advice: str) -> ConfigError:
    named = ", ".join(map(disk.printable, sources))
    return ConfigError(f"{place}: holds plans of other sources ({named}); {advice}")


def _check_unknown(listing: Listing, folder: DataSetFolder) -> None:
    """Raise ConfigError if no journal says where plans come from, and the manifest names sources of others."""
    manifest = folder.manifest()
    unknown = set(manifest.sources if manifest else ()).difference(names_without_folders(listing.sources))
    if unknown:
        raise ConfigError(
            f"{folder.root}: holds plans of other sources ({', '.join(sorted(unknown))}), and no journal that says "
            "which these are; --replace removes them, or choose another --out"
        )
