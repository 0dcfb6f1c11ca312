"""The values of all measures for one plan, as plain values that can be cached."""

from __future__ import annotations

from msgspec import Struct
from msgspec.structs import replace

from houseexpo.floorplan import FloorPlan
from stats import measures
from stats.catalogue import MEASURES

VERSION = 3
"""Part of the name under which records are cached; change it when measures are added or changed."""


class Record(Struct, array_like=True, frozen=True):
    """The measures of one plan; ``reach`` has components, largest share and narrowest passage by radius."""

    id: str
    numbers: dict[str, list[float]]
    labels: dict[str, int]
    door_kinds: dict[str, int]
    reach: dict[str, tuple[int, float, float]]
    fault: str | None
    ring: str
    shape: str


def record(plan: FloorPlan) -> Record:
    """Measure a plan as it is, including the navigability if it is not recorded."""
    return Record(
        id=plan.id,
        numbers={measure.name: numbers for measure in MEASURES if (numbers := list(measure.numbers(plan)))},
        labels=dict(measures.labels(plan)),
        door_kinds=dict(measures.door_kinds(plan)),
        reach={
            radius: (found.components, found.largest_share, found.narrowest)
            for radius, found in measures.reach(plan).items()
        },
        fault=measures.ring_fault(plan),
        ring=measures.ring_digest(plan),
        shape=measures.shape_digest(plan),
    )


def record_with_rooms(plan: FloorPlan) -> Record:
    """Measure a plan after finding its rooms and doors if it has none. Labels remain those of its boxes."""
    if plan.rooms:
        return record(plan)
    from houseexpo.inference import with_rooms

    return replace(record(with_rooms(plan)), labels=dict(measures.labels(plan)))
