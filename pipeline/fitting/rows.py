"""Gather what the models of parts are fitted on: the parts of houses, their features, and whether they are true."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Final, Protocol

import msgspec
import numpy as np
import numpy.typing as npt
import shapely
from shapely import Polygon

from houseexpo.errors import HouseExpoError
from houseexpo.floorplan import FloorPlan
from houseexpo.grids.frame import source_points_from_plan
from pipeline.algorithm import run_stages
from pipeline.config import PipelineConfig
from pipeline.config_file import BuildConfig
from pipeline.executors.local import Failure, Limits, run
from pipeline.fitting.labels import Marked
from pipeline.geometry.areas import ignore_division_warnings
from pipeline.geometry.openings import Opening
from pipeline.quality import doubt_plan
from pipeline.rejection import Rejection
from pipeline.sources import reader
from pipeline.stages import confidence, room_doubt
from pipeline.stages.confidence import FinalBuilding
from pipeline.stages.logistic import LogisticModel
from pipeline.stages.quality_grounds import measure_quality_grounds
from pipeline.stages.room_doubt import doubt_spaces
from pipeline.stages.rooms import name_rooms
from pipeline.values import Evidence, Input, Layout, Level, RejectedLevel, Spaces

Floats = npt.NDArray[np.float64]
SPACE: Final = "space:"


@dataclass(frozen=True, eq=False)
class PlannedBuilding:
    """What the stages found of a building, and its plan."""

    evidence: Evidence
    layout: Layout
    spaces: Spaces
    plan: FloorPlan

    def rated(self, level: Level) -> FinalBuilding:
        """Return what confidences are measured on; how doubtful its spaces are is told by the models of today."""
        doubts = doubt_spaces(level, self.evidence, self.layout)
        grounds = measure_quality_grounds(level, self.evidence, self.layout, self.spaces, doubts=doubts)
        named = name_rooms(level, self.spaces)
        return FinalBuilding(level, self.evidence, self.layout, self.spaces, named, grounds, doubts)


def buildings_of(level: Level, config: PipelineConfig) -> tuple[list[PlannedBuilding], list[Rejection]]:
    """Return the buildings of a level that became plans, and why others did not."""
    evidence = layout = spaces = None
    found: list[PlannedBuilding] = []
    rejected: list[Rejection] = []
    try:
        for result in run_stages(level, config, np.random.default_rng(0)):
            match result.value:
                case Evidence():
                    evidence = result.value
                case Layout():
                    layout = result.value
                case Spaces():
                    spaces = result.value
                case RejectedLevel():
                    rejected.append(result.value.rejection)
                case FloorPlan() if evidence and layout and spaces:
                    found.append(PlannedBuilding(evidence, layout, spaces, result.value))
    except Rejection as rejection:
        rejected.append(rejection)
    return found, rejected


class Part(msgspec.Struct, frozen=True):
    """A door, an entrance, a room or a space: where it comes from, whether it is true, and its features.

    A room has the features of its space as well, each after ``SPACE``.
    """

    part: str
    house: str
    group: str
    true: bool
    features: dict[str, float]


class PlanRow(msgspec.Struct, frozen=True):
    """A plan: where it comes from, whether it is right (None: nobody knows), its grounds, and its parts.

    ``spaces`` are the features of the spaces of its rooms; none if they are not doubted. ``file`` is "" for a made
    house, whose name ``repository`` then is.
    """

    house: str
    group: str
    right: bool | None
    grounds: dict[str, float]
    spaces: list[dict[str, float]]
    parts: list[Part]
    repository: str = ""
    file: str = ""


class HouseRows(msgspec.Struct, frozen=True):
    """The plans of a house, and the spaces of its levels as parts."""

    plans: list[PlanRow]
    spaces: list[Part]


class Told(Protocol):
    """What somebody knows of a storey, in the source's plan axes; each verdict is None where nobody knows."""

    def judge_rooms(self, rooms: Sequence[Polygon]) -> Sequence[bool | None]:
        """Tell which rooms of a plan have a true outline."""
        ...

    def judge_spaces(self, spaces: Sequence[Polygon], rooms: Sequence[Polygon]) -> Sequence[bool | None]:
        """Tell which spaces of a layout are indoors; ``rooms`` are those that the layout kept."""
        ...

    def judge_ways(self, middles: Floats, passages: Sequence[Opening]) -> Sequence[bool | None]:
        """Tell which passages, whose middles (n, 2) are given, are ways."""
        ...


class Origin(msgspec.Struct, frozen=True):
    """Where a house comes from: what all rows of it share."""

    house: str
    group: str
    repository: str
    file: str = ""


def rows_of_houses(
    marked: Mapping[Input, Sequence[Marked]], config: BuildConfig, workers: int
) -> tuple[list[HouseRows], list[str]]:
    """Return the rows of labelled inputs in the order of their ids, and sentences that say why others have none."""
    items = sorted(marked, key=lambda item: (item.id, item.path, item.key))
    tasks = [(k, item, marked[item]) for k, item in enumerate(items)]
    limits = Limits(config.limits.seconds, int(config.limits.memory_gb * 2**30))
    read = partial(_rows_or_reason, config=config.planning)
    results = {task[0]: result for task, result in run(read, tasks, workers=workers, limits=limits)}
    rows, left_out = [], []
    for k, item in enumerate(items):
        result = results[k]
        if isinstance(result, HouseRows):
            rows.append(result)
        else:
            left_out.append(f"{item.id}: {result.detail if isinstance(result, Failure) else result}")
    return rows, left_out


def _rows_or_reason(task: tuple[int, Input, Sequence[Marked]], config: PipelineConfig) -> HouseRows | str:
    _, item, marked = task
    try:
        found = rows_of_labels(item, marked, config)
    except (Rejection, HouseExpoError, OSError) as error:
        return str(error)
    if not found.spaces and not any(plan.parts for plan in found.plans):
        return "nothing that is labelled was found in it; if the file has changed, review it again"
    return found


@ignore_division_warnings()
def rows_of_labels(item: Input, marked: Sequence[Marked], config: PipelineConfig) -> HouseRows:
    """Return the rows of an input by the labels of its storeys; raise Rejection if it cannot be read."""
    storeys = []
    for level in reader(item.reader).read(item):
        told = [each for each in marked if each.is_of(level)] if isinstance(level, Level) else []
        if told and isinstance(level, Level):
            buildings = buildings_of(level, config)[0]
            right = told[0].right if len(told) == len(buildings) == 1 else None
            storeys.append((level, buildings, told, [right] * len(buildings)))
    return rows_of(storeys, Origin(f"{item.id} {item.path}", "reviewed", item.path, item.id))


def rows_of(
    storeys: Iterable[tuple[Level, Sequence[PlannedBuilding], Sequence[Told], Sequence[bool | None]]], origin: Origin
) -> HouseRows:
    """Return the rows of a house's storeys: level, buildings, what somebody knows of it, and which plans are right."""
    plans: list[PlanRow] = []
    spaces: list[Part] = []
    for level, buildings, told, right in storeys:
        doubted = bool(buildings) and room_doubt.is_doubted(level, buildings[0].layout)
        of_spaces = _space_rows(level, buildings[0].evidence, buildings[0].layout) if doubted else []
        for building, is_right in zip(buildings, right, strict=True):
            plans.append(_plan_row(level, building, told, of_spaces, origin, right=is_right))
        if doubted:
            for known in told:
                layout = buildings[0].layout
                here, kept = ([_to_source(level, each) for each in areas] for areas in (layout.spaces, layout.rooms))
                judged = known.judge_spaces([space.buffer(0) for space in here], kept)
                spaces += [
                    _part("space", origin, true, row)
                    for row, true in zip(of_spaces, judged, strict=True)
                    if true is not None
                ]
    return HouseRows(plans, spaces)


def rate_building(plan: PlanRow, space: LogisticModel) -> PlanRow:
    """Return a plan with the doubts that a model of spaces has of its rooms, in its grounds and its parts."""
    doubtful = max((_doubt(space, features) for features in plan.spaces), default=0.0)
    grounds = plan.grounds | {"doubtful_space": doubtful}
    of_plan = {f"plan_{name}": value for name, value in grounds.items()} | {"doubtful_plan": doubt_plan(grounds)}
    parts = []
    for part in plan.parts:
        features = part.features | of_plan
        if part.part == "room":
            of_space = {name[len(SPACE) :]: v for name, v in part.features.items() if name.startswith(SPACE)}
            features["doubtful_space"] = _doubt(space, of_space) if of_space else 0.0
        parts.append(msgspec.structs.replace(part, features=features))
    return msgspec.structs.replace(plan, grounds=grounds, parts=parts)


def parts_of(rows: Iterable[HouseRows], part: str, space: LogisticModel) -> list[Part]:
    """Return the parts of one sort of houses, with the doubts that a model of spaces has."""
    if part == "space":
        return [each for row in rows for each in row.spaces]
    return [
        each for row in rows for plan in row.plans for each in rate_building(plan, space).parts if each.part == part
    ]


def _doubt(space: LogisticModel, features: Mapping[str, float]) -> float:
    doubts = space.doubt({name: np.array([value]) for name, value in features.items()})
    return float(np.atleast_1d(doubts)[0])


def _part(part: str, origin: Origin, true: bool, features: dict[str, float]) -> Part:
    return Part(part, origin.house, origin.group, bool(true), features)


def _plan_row(
    level: Level,
    building: PlannedBuilding,
    told: Sequence[Told],
    of_spaces: list[dict[str, float]],
    origin: Origin,
    *,
    right: bool | None,
) -> PlanRow:
    planned = building.rated(level)
    spaces = planned.spaces
    middles = source_points_from_plan(level.frame, np.array([p.centre for p in spaces.passages]).reshape(-1, 2))
    rooms = [_to_source(level, room.polygon) for room in planned.named]
    numbers = np.arange(len(of_spaces), dtype=np.float64)
    its = room_doubt.of_rooms(planned.layout, numbers, [room.polygon for room in planned.named]).astype(int).tolist()
    parts: list[Part] = []
    of_passages, of_rooms = confidence.passage_features(planned), confidence.room_features(planned)
    for known in told:
        judged = known.judge_ways(middles, spaces.passages)
        for passage, row, true in zip(spaces.passages, of_passages, judged, strict=True):
            if true is not None:
                parts.append(_part(confidence.model_for_passage(passage), origin, true, row))
        for k, (row, true) in enumerate(zip(of_rooms, known.judge_rooms(rooms), strict=True)):
            if true is not None:
                of_space = {SPACE + name: value for name, value in of_spaces[its[k]].items()} if of_spaces else {}
                parts.append(_part("room", origin, true, row | of_space))
    in_plan = sorted(set(room_doubt.of_rooms(planned.layout, numbers, spaces.rooms).astype(int).tolist()))
    return PlanRow(
        origin.house,
        origin.group,
        right,
        {name: round(float(value), 4) for name, value in planned.grounds.items()},
        [of_spaces[k] for k in in_plan] if of_spaces else [],
        parts,
        origin.repository,
        origin.file,
    )


def _space_rows(level: Level, evidence: Evidence, layout: Layout) -> list[dict[str, float]]:
    """Return the features of each space (``stages.room_doubt``)."""
    table = room_doubt.space_features(level, evidence, layout)
    return [{name: round(float(row[k]), 4) for name, row in table.items()} for k in range(len(layout.spaces))]


def _to_source(level: Level, room: Polygon) -> Polygon:
    return shapely.transform(room, lambda points: source_points_from_plan(level.frame, points))
