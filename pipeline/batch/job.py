"""Plan one input in a worker: read it, plan its levels, store the plans. Return an Entry; errors become outcomes."""

from __future__ import annotations

import hashlib
import time
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

import msgspec
import numpy as np

from houseexpo.corrections import Override
from houseexpo.errors import MissingDependencyError, find_transient_fault
from houseexpo.file_kinds import format_note
from houseexpo.floorplan import FloorPlan
from houseexpo.plan.json_codec import encode
from pipeline.batch.entry import Entry, Outcome, PlanRecord, StoredRejection, display_name
from pipeline.batch.file_records import InputFiles
from pipeline.batch.plan_store import PlanStore
from pipeline.config import PipelineConfig
from pipeline.geometry.areas import ignore_division_warnings
from pipeline.overrides import (
    LevelOverride,
    check_not_dropped,
    configure,
    correct_level,
    ids_without_level,
    level_without_walls,
)
from pipeline.png import draw_top_view
from pipeline.quality import check_quality
from pipeline.rejection import Reason, Rejection
from pipeline.sources import reader
from pipeline.sources.files import add_losses
from pipeline.timing import collect_times, time_stages
from pipeline.values import KEPT_FROM, MADE, Input, Level, RejectedLevel

if TYPE_CHECKING:  # how a source is fetched shows in no plan: it is no part of what a result depends on
    from pipeline.batch.mirror import Mirror


@dataclass(frozen=True, eq=False)
class PlanWithPicture:
    """A plan with a picture (PNG) of the stages that it went through."""

    plan: FloorPlan
    stages: bytes


Planned: TypeAlias = FloorPlan | PlanWithPicture | RejectedLevel
Plan = Callable[[Level, PipelineConfig, np.random.Generator], Sequence[Planned]]

_FURNITURE = 1  # its chance is another than that of the stages


def make_plans(level: Level, config: PipelineConfig, rng: np.random.Generator) -> Sequence[FloorPlan | RejectedLevel]:
    """Plan a level as the paper does; geometry's libraries are loaded where this runs, not where it is handed out."""
    from pipeline.algorithm import plan_level

    return plan_level(level, config, rng)


@dataclass(frozen=True)
class JobSettings:
    """What all jobs of a build share.

    ``stamp`` goes into every plan's provenance, ``plans`` is where they are kept, ``mirrors`` stand for sources in
    object stores.
    """

    config: PipelineConfig
    seed: int
    stamp: Mapping[str, str]
    versions: Mapping[str, str]
    plan: Plan
    plans: PlanStore
    min_quality: float = 0.0
    furnished: float = 0.0
    mirrors: Sequence[Mirror] = ()


@dataclass(frozen=True)
class Job:
    """One input, its name in the journal, its source, its recipe, and the overrides that are its own, by their ids.

    ``known`` is the entry that is still right if the files hold what they held.
    """

    name: str
    item: Input
    source: str
    recipe: str
    overrides: Mapping[str, Override] = field(default_factory=dict)
    known: Entry | None = None

    def refusal(self, rejection: Rejection, *, transient: bool = False) -> Entry:
        """Return the entry of an input that gives no plan for a reason outside of it."""
        refused = StoredRejection.of(self.item.id, rejection)
        return msgspec.structs.replace(self.entry([refused]), transient=transient)

    def entry(self, outcomes: Sequence[Outcome]) -> Entry:
        """Return the entry of what came of the input, without files, times and versions."""
        plans = [outcome for outcome in outcomes if isinstance(outcome, PlanRecord)]
        refused = [outcome for outcome in outcomes if isinstance(outcome, StoredRejection)]
        file = display_name(self.item, self.source)
        return Entry(self.name, self.source, self.recipe, [], 0.0, plans, refused, file=file)


def run_job(settings: JobSettings, job: Job) -> Entry:
    """Return the outcome of an input, or the earlier outcome if its files only look changed."""
    start, opened = time.perf_counter(), InputFiles(job.item)
    try:
        for mirror in settings.mirrors:
            mirror.mount()
        if job.known is not None and (files := opened.if_unchanged(job.known.files)) is not None:
            return msgspec.structs.replace(job.known, files=files, source=job.source, gone=False)
        with opened.recorded(), collect_times() as seconds, ignore_division_warnings():
            outcomes = list(_outcomes(job, settings))
    except OSError as error:  # a transient fault: it says nothing about the house
        return job.refusal(not_yet(error.strerror or str(error)), transient=True)
    return msgspec.structs.replace(
        job.entry(outcomes),
        files=opened.described(),
        seconds=round(time.perf_counter() - start, 4),
        versions=dict(settings.versions),
        stages={stage: round(value, 4) for stage, value in seconds.items()},
    )


def not_yet(what: str) -> Rejection:
    """Return the rejection of an input that a transient fault interrupted."""
    return Rejection("executor", Reason.NOT_YET, what, "build again when it has passed")


def level_rng(level: Level, seed: int) -> np.random.Generator:
    """Return a level's own source of chance: it depends on the seed and the id, not on what ran before."""
    return np.random.default_rng([seed, *hashlib.sha256(level.id.encode()).digest()])


def _outcomes(job: Job, settings: JobSettings) -> Iterator[Outcome]:
    """Yield an outcome for each level; what goes wrong outside of a level's stages is the whole input's.

    Raises OSError for a transient fault.
    """
    levels, note = list[str](), format_note(Path(job.item.path))
    try:
        for level in time_stages(reader(job.item.reader).read(job.item), lambda _: "source"):
            levels.append(level.id)
            if isinstance(level, RejectedLevel):
                _raise_transient(level.rejection)
                yield StoredRejection.of(level.id, level.rejection, InputFiles(job.item).own_sha256())
            else:
                told = replace(level, provenance={**level.provenance, "format": note}) if note else level
                yield from _of_level(told, job, settings)
    except Exception as error:  # noqa: BLE001 - one input's fault must not stop the batch
        yield from _of_unread(_as_rejection(error, job.item), job, settings)
    else:
        if not levels:
            nothing = Rejection("source", Reason.NO_LEVEL, "expected a level, found none", "look at it in a viewer")
            yield StoredRejection.of(job.item.id, nothing)
        for name in ids_without_level(job.overrides, levels) if levels else ():
            detail = f"expected the id of a level, found none of this id among {', '.join(levels)}"
            yield StoredRejection.of(name, Rejection("overrides", Reason.NO_SUCH_LEVEL, detail, "mend overrides.toml"))


def _of_level(level: Level, job: Job, settings: JobSettings) -> Iterator[Outcome]:
    """Yield what came of a level: an outcome for each of its buildings."""
    said = LevelOverride.of(level.id, job.overrides, level.content)
    try:
        check_not_dropped(said.own)
        level, found = _plan_level(level, said, settings)
        outcomes = [_of_building(each, level, said, settings) for each in found]
    except Exception as error:  # noqa: BLE001 - the other levels of the house go on
        rejection = _as_rejection(error, job.item)
        if rejection is error and rejection.reason is not Reason.DROPPED_BY_HAND:
            rejection = add_losses(rejection, level.provenance).with_picture(draw_top_view(level.walls))
        outcomes = [StoredRejection.of(level.id, rejection, level.content)]
    yield from outcomes


def _plan_level(level: Level, said: LevelOverride, settings: JobSettings) -> tuple[Level, Sequence[Planned]]:
    """Return a level as a person corrects it, and its plans.

    What a person keeps is planned again without the rule that rejects it.
    """
    level, override = correct_level(level, said), said.own
    try:
        config = configure(settings.config, replace(override, keep=False))
        return level, settings.plan(level, config, level_rng(level, settings.seed))
    except Rejection as doubt:
        if not override.keep or doubt.reason is not Reason.CHARACTERS:
            raise
        kept = replace(level, provenance={**level.provenance, KEPT_FROM: str(doubt.reason)})
    return kept, settings.plan(kept, configure(settings.config, override), level_rng(kept, settings.seed))


def _of_building(found: Planned, level: Level, said: LevelOverride, settings: JobSettings) -> Outcome:
    """Return what came of a building."""
    plan, picture = (found.plan, found.stages) if isinstance(found, PlanWithPicture) else (found, b"")
    override = said.of_building(plan.id)
    kept_from = str(level.provenance.get(KEPT_FROM, ""))
    try:
        if isinstance(plan, RejectedLevel):
            raise plan.rejection
        check_not_dropped(override)
        try:
            check_quality(plan, settings.min_quality)
        except Rejection as doubt:
            if not override.keep:
                raise
            kept_from = kept_from or str(doubt.reason)
    except Rejection as rejection:
        return StoredRejection.of(plan.id, rejection.with_picture(draw_top_view(level.walls)), level.content)
    plan = said.named(_furnish(plan, settings))
    plan = replace(plan, provenance={**(plan.provenance or {}), **settings.stamp})
    kept = settings.plans.put(plan.id, level.content, encode(plan) + b"\n", picture)
    return msgspec.structs.replace(kept, by_hand=override.keep, kept_from=kept_from if override.keep else "")


def _of_unread(rejection: Rejection, job: Job, settings: JobSettings) -> Sequence[Outcome]:
    """Return what came of an input of which no level could be read: a person may drop it, or say its rooms."""
    content = InputFiles(job.item).own_sha256()
    override = LevelOverride.of(job.item.id, job.overrides, content).own
    outcomes: list[Outcome] = []
    try:
        check_not_dropped(override)
        if rejection.reason in _WITHOUT_ROOMS and override.corrections:
            outcomes = list(_of_level(level_without_walls(job.item, override, content), job, settings))
    except Rejection as dropped:
        rejection = dropped
    made = any(isinstance(each, PlanRecord) for each in outcomes)
    return outcomes if made else [StoredRejection.of(job.item.id, rejection, content)]


_WITHOUT_ROOMS = (Reason.NO_LEVEL, Reason.NO_INTERIOR)
"""The reasons of files that are read, and in which no rooms are found."""


def _furnish(plan: FloorPlan, settings: JobSettings) -> FloorPlan:
    """Furnish a plan of a made house, where its turn comes."""
    if settings.furnished and (plan.provenance or {}).get("source") == MADE:
        from pipeline.furnish import draw_whether_furnished, furnish_plan

        rng = np.random.default_rng([settings.seed, _FURNITURE, *hashlib.sha256(plan.id.encode()).digest()])
        if draw_whether_furnished(settings.furnished, rng):
            plan = furnish_plan(plan, rng)
    return plan


MORE_MEMORY = "allow more with --memory (limits.memory_gb in a manifest), or simplify the mesh"
_NO_MEMORY = ("std::bad_alloc", "Insufficient memory")
"""What GEOS and OpenCV say, in errors of other kinds, where memory is short."""


def _as_rejection(error: Exception, item: Input) -> Rejection:
    _raise_transient(error)
    if isinstance(error, Rejection):
        return error
    if isinstance(error, MemoryError) or any(words in str(error) for words in _NO_MEMORY):
        detail = "needed more memory than a worker may take"
        return Rejection("executor", Reason.OUT_OF_MEMORY, detail, MORE_MEMORY)
    if isinstance(error, MissingDependencyError):
        return Rejection("source", Reason.UNREADABLE, str(error), "install it and build again")
    place = traceback.extract_tb(error.__traceback__)[-1]
    text = " ".join(str(error).replace(item.path, Path(item.path).name).split())[:200]
    detail = f"{type(error).__name__} at {Path(place.filename).name}:{place.lineno} in {place.name}: {text}"
    return Rejection("internal", Reason.INTERNAL, detail, "this is a fault of the program: please report it")


def _raise_transient(error: BaseException) -> None:
    if (fault := find_transient_fault(error)) is not None:
        raise fault
