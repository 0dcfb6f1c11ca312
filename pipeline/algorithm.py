"""Run the paper's Algorithm 1 stage by stage: turn one storey into plans, one for each building, or a Rejection."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from operator import attrgetter
from typing import Any

import numpy as np
import numpy.typing as npt
from shapely import Polygon
from shapely.geometry.base import BaseGeometry

from houseexpo.analysis.navigability import navigability
from houseexpo.floorplan import FloorPlan
from pipeline.config import PipelineConfig
from pipeline.geometry.areas import EMPTY, unite
from pipeline.quality import score_quality
from pipeline.rejection import Rejection
from pipeline.stages.buildings import drop_small_cells, erase_isolated, separate_buildings, trace_contour
from pipeline.stages.confidence import FinalBuilding, add_confidences, without_unlikely_entrances
from pipeline.stages.connectivity import connect_rooms
from pipeline.stages.corrections import (
    correct,
    corrections_by_building,
    doubts_left,
    has_other_parts,
    level_of_corrected,
    spaces_of_plan,
    without_cuts,
)
from pipeline.stages.doors import find_doors
from pipeline.stages.evidence import gather_evidence
from pipeline.stages.furniture import subtract_furniture, subtract_stairwells
from pipeline.stages.layout import close_openings, read_drawn_layout
from pipeline.stages.logistic import Models, models_with
from pipeline.stages.planes import find_planes
from pipeline.stages.quality_grounds import measure_quality_grounds, walls_far_from_rooms
from pipeline.stages.refine import straighten_rooms
from pipeline.stages.room_doubt import closed_cells, doubt_spaces, unlikely_rooms
from pipeline.stages.rooms import name_rooms, with_doors_between_parts
from pipeline.stages.said_walls import (
    bare_layout,
    found_plan,
    level_with_walls,
    may_be_founded,
    record_of_founder,
    records_of_walls,
    said_walls,
    words_of_founded,
)
from pipeline.stages.vectorise import vectorise
from pipeline.timing import time_stages
from pipeline.values import Evidence, FloorObstacle, Layout, Level, Planes, RejectedLevel, Spaces


@dataclass(frozen=True, eq=False)
class StageResult:
    """The result of a stage for the level or building with this id.

    ``value`` is an Evidence, a Planes, a Layout, a Spaces, and at last the FloorPlan. It is a RejectedLevel if one of
    several buildings cannot become a plan.
    """

    stage: str
    value: Evidence | Planes | Layout | Spaces | FloorPlan | RejectedLevel
    id: str


def run_stages(level: Level, config: PipelineConfig, rng: np.random.Generator) -> Iterator[StageResult]:
    """Run Algorithm 1 and show each step; raise Rejection if the level cannot become a plan.

    From ``isolated`` on, each building is processed separately. If the search finds no plan, but a person says walls or
    rooms of the level, the plan is made of these (``stages.said_walls``).
    """
    if not may_be_founded(level):
        yield from _search(level, config, rng)
        return
    try:
        found = list(_search(level, config, rng))
    except Rejection as rejection:
        found = list(_of_what_is_said(level, config, rng, rejection))
    yield from found


def _search(level: Level, config: PipelineConfig, rng: np.random.Generator) -> Iterator[StageResult]:
    drawn = read_drawn_layout(level, config.layout)
    evidence = drawn.evidence if drawn else gather_evidence(level, config.evidence)
    yield StageResult("evidence", evidence, level.id)
    planes = drawn.planes if drawn else find_planes(level, evidence, config.planes)
    yield StageResult("planes", planes, level.id)
    joins = config.connectivity.joins_closed_spaces(marked=level.sills)
    layout = drawn.layout if drawn else close_openings(level, evidence, planes, config.layout, all_closed=joins)
    yield StageResult("layout", layout, level.id)
    spaces = find_doors(level, planes, layout, config.doors)
    found = spaces.rooms
    yield StageResult("doors", spaces, level.id)
    spaces = trace_contour(spaces)
    yield StageResult("contour", spaces, level.id)
    if not level.all_ways:  # where each way is stated, a closed cell may be a room
        spaces = drop_small_cells(spaces, config.cells, layout)
    yield StageResult("cells", spaces, level.id)
    spaces = erase_isolated(spaces, config.isolated)
    yield StageResult("isolated", spaces, level.id)
    buildings = separate_buildings(level, spaces)
    models = models_with(config.weights)
    doubts = doubt_spaces(level, evidence, layout, models["space"])
    unlikely = EMPTY if joins else unlikely_rooms(level, evidence, layout, doubts)
    cells = EMPTY if joins else closed_cells(level, evidence, layout)
    whole = _Whole(evidence, planes, layout, doubts, unlikely, cells, found, models)
    if len(buildings) > 1:
        whole = replace(whole, far_walls=walls_far_from_rooms(evidence.walls, layout.rooms))
    for building, spaces in corrections_by_building(level, buildings):
        try:
            yield from _of_building(building, spaces, whole, config, rng)
        except Rejection as rejection:
            if len(buildings) == 1:
                raise
            yield StageResult("rejected", RejectedLevel(building.id, rejection), building.id)


def _of_what_is_said(
    level: Level, config: PipelineConfig, rng: np.random.Generator, rejection: Rejection
) -> Iterator[StageResult]:
    """Yield the stages of a rejected level with the walls that a person says, or the plan of the rooms said."""
    walls = said_walls(level, _standing(level, config)[1])
    config = replace(config, layout=replace(config.layout, characters=False))  # a person calls them walls
    last, with_walls = rejection, level_with_walls(level, walls)
    if walls:
        try:
            found = list(_search(with_walls, config, rng))
        except Rejection as again:
            last = again
        else:
            records = list(records_of_walls(level, rejection))
            yield from (_with_records(each, records) for each in found)
            return
    evidence, standing = _standing(with_walls, config)
    founded = found_plan(level, standing)
    if founded is None:
        detail = f"{last.detail}; what overrides.toml says of walls and rooms encloses none"
        raise Rejection(last.stage, last.reason, detail, last.advice, last.picture)
    plan, founder, closed = founded
    said, idle = words_of_founded(level, founder)
    layout, spaces = bare_layout(standing, closed)
    corrected = correct(level, said, (evidence, layout), (), plan)
    final = spaces_of_plan(level, corrected.plan, spaces)
    bare = replace(level, corrections=tuple(said))
    grounds = measure_quality_grounds(bare, evidence, layout, final, doubts=np.zeros(len(layout.spaces)))
    quality = score_quality(grounds, marked=level.sills)
    finished = replace(corrected.plan, navigability=navigability(corrected.plan), quality=quality)
    yield _with_records(StageResult("plan", finished, level.id), [record_of_founder(founder, plan, rejection), *idle])


def _standing(level: Level, config: PipelineConfig) -> tuple[Evidence, BaseGeometry]:
    """Return the evidence of a level, and all that may close a room of it."""
    evidence = gather_evidence(level, config.evidence)
    try:
        planes = find_planes(level, evidence, config.planes)
    except Rejection:
        return evidence, EMPTY
    doorways = [doorway.polygon for doorway in planes.doorways]
    return evidence, unite([planes.door, planes.sills, planes.lintels, planes.rails, *doorways])


def _with_records(result: StageResult, records: list[dict[str, Any]]) -> StageResult:
    """Return a plan with more records of what corrections did, and any other result as it is."""
    if not isinstance(result.value, FloorPlan):
        return result
    told = result.value.provenance or {}
    told = {**told, "corrections": [*records, *told.get("corrections", [])]}
    return replace(result, value=replace(result.value, provenance=told))


@dataclass(frozen=True, eq=False)
class _Whole:
    """What the first stages found in the whole level, before it is divided into buildings.

    ``doubts`` say of each space how doubtful it is that it is a room; ``unlikely`` is the area of those that are likely
    none, and ``cells`` that of closed cells, both empty where all closed spaces are joined. ``rooms`` are those that
    the stage ``doors`` found. ``models`` rate the parts of plans. ``far_walls`` are the walls that stand beside no
    room, of a level with several buildings.
    """

    evidence: Evidence
    planes: Planes
    layout: Layout
    doubts: npt.NDArray[np.float64]
    unlikely: BaseGeometry
    cells: BaseGeometry
    rooms: tuple[Polygon, ...]
    models: Models
    far_walls: BaseGeometry | None = None


def _of_building(
    level: Level, spaces: Spaces, whole: _Whole, config: PipelineConfig, rng: np.random.Generator
) -> Iterator[StageResult]:
    said, level = level.corrections, replace(level, corrections=())  # no input of what comes before the plan
    spaces = connect_rooms(
        spaces,
        config.connectivity,
        config.cells.area_m2,
        rng,
        whole.evidence,
        unlikely=whole.unlikely,
        cells=whole.cells,
    )
    yield StageResult("connectivity", spaces, level.id)
    spaces = straighten_rooms(spaces, config.refine, (room.polygon for room in level.rooms))
    yield StageResult("refine", spaces, level.id)
    grounds = _grounds(level, whole, spaces)  # before furniture: it makes no plan doubtful
    obstacles: tuple[FloorObstacle, ...] = ()
    spaces, wells = subtract_stairwells(level, spaces)
    if config.evidence.furniture:
        spaces, obstacles = subtract_furniture(level, whole.evidence, spaces)
        yield StageResult("furnish", spaces, level.id)
    named = name_rooms(level, spaces)
    spaces = with_doors_between_parts(spaces, named, whole.evidence.doorways)
    final_building = FinalBuilding(
        level, whole.evidence, whole.layout, spaces, named, grounds, whole.doubts, whole.models
    )
    planned = without_unlikely_entrances(add_confidences(final_building))
    provenance = _provenance(level, whole.planes, planned.spaces)
    cut = vectorise(level, planned.spaces, planned.named, provenance, (*wells, *obstacles))
    plan = without_cuts(level, cut)
    if plan is not cut:
        grounds = _grounds(level, whole, spaces_of_plan(level, plan, planned.spaces))
    if said:
        corrected = correct(level, said, (whole.evidence, whole.layout), whole.rooms, plan)
        if corrected.has_changed:
            final = planned.spaces
            if has_other_parts(cut, corrected.plan):
                final = spaces_of_plan(level, corrected.plan, planned.spaces)
            whole = replace(whole, doubts=doubts_left(level, whole.layout, whole.doubts, corrected.plan))
            grounds = _grounds(level_of_corrected(level, plan, corrected), whole, final)
        plan = corrected.plan
    quality = score_quality(grounds, marked=level.sills)
    yield StageResult("plan", replace(plan, navigability=navigability(plan), quality=quality), level.id)


def _grounds(level: Level, whole: _Whole, spaces: Spaces) -> dict[str, float]:
    return measure_quality_grounds(
        level, whole.evidence, whole.layout, spaces, far_walls=whole.far_walls, doubts=whole.doubts
    )


def plan_level(level: Level, config: PipelineConfig, rng: np.random.Generator) -> tuple[FloorPlan | RejectedLevel, ...]:
    """Turn a level into plans, one for each building; raise Rejection if none can be made."""
    values = [result.value for result in time_stages(run_stages(level, config, rng), attrgetter("stage"))]
    return tuple(value for value in values if isinstance(value, FloorPlan | RejectedLevel))


def plan_largest_building(level: Level, config: PipelineConfig, rng: np.random.Generator) -> FloorPlan:
    """Turn a level into the plan of its (largest) building; raise Rejection if it cannot become one."""
    found = plan_level(level, config, rng)
    plans = [plan for plan in found if isinstance(plan, FloorPlan)]
    if not plans:
        raise next(each.rejection for each in found if isinstance(each, RejectedLevel))
    return max(plans, key=lambda plan: plan.area)


def _provenance(level: Level, planes: Planes, spaces: Spaces) -> dict[str, Any]:
    heights = {k: np.round(v, 4).tolist() for k, v in planes.heights.items()}
    return {**level.provenance, "heights": heights, "notes": dict(sorted(spaces.notes.items()))}
