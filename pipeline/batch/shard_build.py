"""Build a data set in shards: run one shard, list the inputs that are left, and assemble the plans of all shards."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

from houseexpo.corrections import Override
from houseexpo.errors import ConfigError, HouseExpoError
from pipeline.batch.assemble import BuildResult
from pipeline.batch.build import build, refuse_unlisted_sources
from pipeline.batch.entry import Entry
from pipeline.batch.job import Plan
from pipeline.batch.listing import Listing, absolute_source
from pipeline.batch.plan_store import DamagedPlanError, PlanStore, stored_names
from pipeline.batch.planning import Planning, Progress, ignore_outcome
from pipeline.batch.result_store import FolderStore, Store, is_url, open_store
from pipeline.batch.shards import CommonSettings, Shard, ShardJournal, read_common_settings, shard_number
from pipeline.config_file import BuildConfig
from pipeline.executors.local import Executor, Failure, Item, Limits, Result
from pipeline.overrides import check_override_ids, settle_override_ids


@dataclass(frozen=True)
class ShardResult:
    """The outcome of a shard: the number of its inputs, and the ids that are not done, with the reason."""

    shard: Shard
    inputs: int
    not_done: Mapping[str, str]


def begin_shards(config: BuildConfig, out: str, shards: int, overrides: Mapping[str, Override]) -> CommonSettings:
    """Begin or continue a build in shards; every shard calls this.

    Raises
    ------
    ConfigError
        Where a source is none, or ``out`` lies in one or holds something else, plans of other sources, or shards of
        another build.
    """
    listing = Listing(config)
    listing.check()
    if not is_url(out):
        listing.check_apart(Path(out))
    overrides = settle_override_ids(overrides, (item for _, item in listing) if overrides else ())
    if overrides and config.build.limit is None:
        check_override_ids(overrides, (item for _, item in listing))
    sources = tuple(map(absolute_source, config.build.sources))
    begun = CommonSettings(shards, replace(config, build=replace(config.build, sources=sources)), dict(overrides))
    store = open_store(out)
    if read_common_settings(store) is None:
        refuse_unlisted_sources(listing, store)
    begun.write(store)
    return begun


def build_shard(
    begun: CommonSettings,
    out: str,
    shard: Shard,
    *,
    execute: Executor,
    progress: Progress,
    plan: Plan | None = None,
    rehash: bool = False,
    ended: Callable[[Entry], None] = ignore_outcome,
) -> ShardResult:
    """Do the unfinished inputs of one shard; only its plans and its journal in ``out`` are written.

    ``ended`` hears what came of each input that was at work.
    """
    store = open_store(out)
    with store.hold_with_shards():
        journal = ShardJournal(store, shard)
        planning = Planning(Listing(begun.config), journal, PlanStore(store), begun.overrides, rehash, shard, ended)
        try:
            planning.run(plan, execute, progress)
        finally:
            journal.sync()
    left = {refused.id: refused.detail for entry in planning.unfinished.values() for refused in entry.refused}
    return ShardResult(shard, len(planning.listed), left)


def require_common_settings(out: str) -> CommonSettings:
    """Return what the shards at ``out`` have in common; raise ConfigError if none has begun."""
    begun = read_common_settings(open_store(out))
    if begun is None:
        raise ConfigError(f"{out}: expected a build in shards, found none; begin one: houseexpo build ... --shard 0/16")
    return begun


def unfinished_inputs(begun: CommonSettings, out: str) -> dict[int, list[str]]:
    """Return the ids of the inputs that are not done, by the number of their shard."""
    store = open_store(out)
    planning = Planning(Listing(begun.config), ShardJournal(store, None), PlanStore(store), begun.overrides)
    left: dict[int, list[str]] = {}
    for job in planning.jobs():
        left.setdefault(shard_number(job.item.id, begun.shards), []).append(job.item.id)
    return dict(sorted(left.items()))


class DamagedShardsError(HouseExpoError):
    """Stored plans are damaged; ``left`` has the ids of their inputs by shard, as of ``unfinished_inputs``."""

    def __init__(self, left: dict[int, list[str]]) -> None:
        super().__init__(f"plans of {', '.join(id_ for ids in left.values() for id_ in ids)} are damaged")
        self.left = left


@contextmanager
def assemble_shards(
    begun: CommonSettings, out: str, progress: Progress, *, partial: bool = False
) -> Iterator[BuildResult]:
    """Yield the data set that the shards' plans make; what is not done by now is counted apart, and not planned.

    It lies in a folder of this machine; ``out`` holds it when this is left.

    Raises
    ------
    DamagedShardsError
        Stored plans are damaged, and it is not ``partial``. Nothing is written, and the store forgets these plans, so
        that their shards make them again.
    """
    store = open_store(out)
    entries = list(ShardJournal(store, None).entries())
    with store.workplace([place for entry in entries for kept in entry.plans for place in stored_names(kept)]) as root:
        if _forget_damaged(entries, FolderStore(root), store) and not partial:
            raise DamagedShardsError(unfinished_inputs(begun, out))
        yield build(
            begun.config,
            root,
            overrides=begun.overrides,
            workers=0,
            progress=progress,
            execute=_leave,
            known=entries,
        )


def _forget_damaged(entries: Iterable[Entry], copy: Store, store: Store) -> bool:
    """Remove from a store the plans that are damaged in a copy of it; tell whether there were any."""
    plans, any_damaged = PlanStore(copy), False
    for entry in entries:
        for kept in entry.plans:
            try:
                plans.get(kept)
                plans.picture(kept)
            except DamagedPlanError:
                any_damaged = True
                for place in stored_names(kept):
                    store.remove(place)
    return any_damaged


def _leave(
    function: Callable[[Item], Result],  # noqa: ARG001 - an executor's arguments
    items: Iterable[Item],
    *,
    limits: Limits,  # noqa: ARG001
    preload: Sequence[str],  # noqa: ARG001
) -> Iterator[tuple[Item, Result | Failure]]:
    """Do nothing: the executor for inputs that a shard has to do."""
    for item in items:
        yield item, Failure("untried", "its shard has not done it")
