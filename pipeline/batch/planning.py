"""Find the inputs that are not done and plan them in an executor; used by builds, shards and the list of what is left.

An input is done if it is recorded with the same recipe, its plans are stored, and its files look unchanged.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from importlib.metadata import version
from operator import attrgetter
from typing import TYPE_CHECKING, Protocol

import msgspec
import numpy as np

from houseexpo.corrections import Override
from houseexpo.floorplan import FloorPlan
from pipeline.batch import WORKER_MODULES
from pipeline.batch.entry import Entry
from pipeline.batch.file_records import InputFiles
from pipeline.batch.job import MORE_MEMORY, Job, JobSettings, Plan, PlanWithPicture, make_plans, not_yet, run_job
from pipeline.batch.listing import Listing
from pipeline.batch.plan_store import PlanStore
from pipeline.batch.recipe import library_versions, recipe_digest
from pipeline.batch.shards import Shard
from pipeline.config import PipelineConfig
from pipeline.config_file import LimitsConfig
from pipeline.executors.local import Executor, Failure, Limits
from pipeline.overrides import correct_input, overrides_by_input
from pipeline.rejection import Reason, Rejection
from pipeline.timing import time_stages
from pipeline.values import Level, RejectedLevel

if TYPE_CHECKING:
    from pipeline.algorithm import StageResult


Progress = Callable[[str, int, int], None]
"""Called with what is being done, how much of it is done, and of how much."""

WHOLE = Shard(0, 1)


def ignore_outcome(entry: Entry) -> None:
    """Ignore the outcome of an input."""


_REASONS: Mapping[str, tuple[Reason, str]] = {
    "timeout": (Reason.TIMEOUT, "allow more with --seconds (limits.seconds in a manifest), or simplify the mesh"),
    "memory": (Reason.OUT_OF_MEMORY, MORE_MEMORY),
    "died": (Reason.INTERNAL, "a library crashes on it: please report it"),
    "raised": (Reason.INTERNAL, "this is a fault of the program: please report it"),
}


class OutcomeStore(Protocol):
    """What is known of inputs: a journal."""

    def get(self, name: str) -> Entry | None:
        """Return the last entry of an input."""
        ...

    def put(self, entry: Entry) -> None:
        """Note an entry."""
        ...


@dataclass
class Planning:
    """The inputs of a shard, and what is known of them.

    ``begins`` is called when the first of them is about to be planned, with whether there are several; ``ended`` hears
    what came of each that was at work; ``listed`` are those that were come across, ``unfinished`` those that a
    transient fault kept from being done.
    """

    listing: Listing
    known: OutcomeStore
    plans: PlanStore
    overrides: Mapping[str, Override]
    rehash: bool = False
    shard: Shard = WHOLE
    ended: Callable[[Entry], None] = ignore_outcome
    begins: Callable[[bool], None] = lambda _: None
    listed: set[str] = field(default_factory=set)
    unfinished: dict[str, Entry] = field(default_factory=dict)

    def run(self, plan: Plan | None, execute: Executor, progress: Progress) -> None:
        """Plan the inputs that are not done; ``plan`` is Algorithm 1 where it is None."""
        self.listed.clear()
        self.unfinished.clear()
        config = self.listing.config
        limits = Limits(config.limits.seconds, int(min(max(config.limits.memory_gb * 2**30, 1), 2**62)))
        jobs = self.jobs()
        first = list(itertools.islice(jobs, 2))
        total, open_jobs = -(-self.listing.total() // self.shard.count), 0

        def hand_over() -> Iterator[Job]:
            nonlocal open_jobs
            for job in itertools.chain(first, jobs):
                open_jobs += 1
                yield job

        if first:  # else all is done, and no worker need start
            self.begins(len(first) > 1)
            function = partial(run_job, self._settings(plan))
            for job, result in execute(function, hand_over(), limits=limits, preload=WORKER_MODULES):
                self._finish(_entry_of_failure(job, result) if isinstance(result, Failure) else result)
                open_jobs -= 1
                progress("planning", min(len(self.listed) - open_jobs, total), total)
        progress("planning", len(self.listed), len(self.listed))

    def jobs(self) -> Iterator[Job]:
        """Yield the jobs to do; inputs that are done and unchanged are only noted as listed."""
        config = self.listing.config
        pictured = config.build.keep_stages
        overrides = overrides_by_input(self.overrides)
        for source, listed in self.listing:
            if not self.shard.holds(listed.id):
                continue
            name = self.listing.identity(listed)
            if name in self.listed:
                continue
            self.listed.add(name)
            own = overrides.get(listed.id, {})
            item = correct_input(listed, own)
            how = recipe_digest(self.listing.public(item), config, own)
            entry = self.known.get(name)
            if (
                entry is None
                or entry.recipe != _recipe_within(entry, how, config.limits)
                or not all(self.plans.stands(kept, pictured=pictured) for kept in entry.plans)
            ):
                yield Job(name, item, source, how, own)
            elif self.rehash or not InputFiles(item).look_like(entry.files):
                yield Job(name, item, source, how, own, entry)
            elif entry.gone or entry.source != source:
                self.known.put(msgspec.structs.replace(entry, source=source, gone=False))

    def _settings(self, plan: Plan | None) -> JobSettings:
        config = self.listing.config
        usual = make_plans_with_pictures if config.build.keep_stages else make_plans
        stamp = {"generator": "houseexpo", "version": version("houseexpo"), "parameters_sha256": config.digest()}
        return JobSettings(
            config.planning,
            config.build.seed,
            stamp,
            library_versions(),
            plan or usual,
            self.plans,
            config.build.min_quality,
            config.build.furnished,
            self.listing.mirrors,
        )

    def _finish(self, entry: Entry) -> None:
        self.ended(entry)
        if entry.transient:
            self.unfinished[entry.input] = entry
        else:
            recipe = _recipe_within(entry, entry.recipe, self.listing.config.limits)
            self.known.put(msgspec.structs.replace(entry, recipe=recipe))


def _recipe_within(entry: Entry, recipe: str, limits: LimitsConfig) -> str:
    """Return the recipe of an outcome: what exceeded a limit depends on the limits too, and is redone with others."""
    if not any(refused.reason in {Reason.TIMEOUT, Reason.OUT_OF_MEMORY} for refused in entry.refused):
        return recipe
    return f"{recipe.partition(' ')[0]} within {limits.seconds:g} s, {limits.memory_gb:g} GiB"


def _entry_of_failure(job: Job, failure: Failure) -> Entry:
    """Return the outcome of an input whose worker died."""
    if failure.kind == "killed":
        return job.refusal(not_yet(f"{failure.detail}; most often memory ran out: use fewer workers"), transient=True)
    if failure.kind == "untried":
        return job.refusal(not_yet(failure.detail), transient=True)
    reason, advice = _REASONS[failure.kind]
    entry = job.refusal(Rejection("executor", reason, failure.detail, advice))
    return msgspec.structs.replace(
        entry, files=InputFiles(job.item).described_unread(), versions=dict(library_versions())
    )


def make_plans_with_pictures(
    level: Level, config: PipelineConfig, rng: np.random.Generator
) -> Sequence[PlanWithPicture | RejectedLevel]:
    """Plan a level as ``make_plans`` does; each plan comes with the sheet that ``houseexpo inspect`` draws of it.

    How pictures are drawn shows in no plan, so it is no part of ``job``, whose code is part of a plan's recipe.
    """
    from pipeline.algorithm import run_stages

    seen = list(time_stages(run_stages(level, config, rng), attrgetter("stage")))
    return list(time_stages(_outcomes(seen, level), lambda _: "pictures"))


def _outcomes(seen: Sequence[StageResult], level: Level) -> Iterator[PlanWithPicture | RejectedLevel]:
    from pipeline.pictures import compose_sheet, results_of_building

    for result in seen:
        if isinstance(result.value, RejectedLevel):
            yield result.value
        elif isinstance(result.value, FloorPlan):
            own = results_of_building(seen, level.id, result.id)
            yield PlanWithPicture(result.value, compose_sheet(own, level.frame))
