"""Measure one plan: numbers, labels, a robot's reach, ring faults and audit, as plain values that can be cached."""

from __future__ import annotations

import hashlib
from typing import Final, Literal

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from houseexpo.analysis import measures
from houseexpo.analysis.audit import PlanAudit, audit_plan
from houseexpo.floorplan import FloorPlan

VERSION: Final = 7
"""Part of the name under which records are cached; change it when measures are added or changed."""

MEASURES: Final = tuple(
    measures.BY_NAME[name]
    for name in (
        *("rooms", "source_rooms", "area", "long_side", "short_side", "vertices", "holes", "label_boxes", "room_area"),
        *("furniture", "quality", "doors", "door_width", "doors_per_room", "degree", "loops", "depth"),
        *("room_windows", "lit"),
    )
)
"""The measures of a summary. Those that depend on a robot's radius are in ``Record.reach``."""

BY_KEY: Final = {measure.key: measure for measure in MEASURES}

Fault = Literal["touches", "crosses"]

_MIX: Final = np.uint64(0x9E3779B97F4A7C15)
"""A random odd factor, so that two edges of a house do not give the same number."""


class Record(Struct, array_like=True, frozen=True):
    """The measures of one plan.

    ``numbers`` are by the measure's key. ``reach`` has components, largest share and narrowest passage by radius.
    ``audit`` is None if the plan has no rooms or was not audited.
    """

    id: str
    numbers: dict[str, list[float]]
    labels: dict[str, int]
    door_kinds: dict[str, int]
    reach: dict[str, tuple[int, float, float]]
    fault: str | None
    ring: str
    shape: str
    audit: PlanAudit | None = None


def measure_plan(plan: FloorPlan) -> Record:
    """Measure a plan as it is, including the navigability if it is not recorded, without an audit."""
    return Record(
        id=plan.id,
        numbers={measure.key: numbers for measure in MEASURES if (numbers := list(measure.numbers(plan)))},
        labels=dict(measures.label_counts(plan)),
        door_kinds=dict(measures.door_kind_counts(plan)),
        reach={
            radius: (found.components, found.largest_share, found.narrowest)
            for radius, found in measures.navigability_by_radius(plan).items()
        },
        fault=ring_fault(plan),
        ring=ring_digest(plan),
        shape=shape_digest(plan),
    )


def measure_and_audit(plan: FloorPlan) -> Record:
    """Measure and audit a plan as it is."""
    return replace(measure_plan(plan), audit=audit_plan(plan))


def find_rooms_and_measure(plan: FloorPlan) -> Record:
    """Measure and audit a plan; find rooms and doors of a plan without them, but keep the labels of its boxes."""
    if plan.rooms:
        return measure_and_audit(plan)
    from houseexpo.inference import with_rooms

    return replace(measure_and_audit(with_rooms(plan)), labels=dict(measures.label_counts(plan)))


def ring_fault(plan: FloorPlan) -> Fault | None:
    """Return the fault of the published ring, which "touches" or "crosses" itself, or None if it is valid."""
    import shapely

    polygon = shapely.Polygon(plan.verts)
    if polygon.is_valid:
        return None
    return "touches" if shapely.is_valid_reason(polygon).startswith("Ring") else "crosses"


def ring_digest(plan: FloorPlan) -> str:
    """Return a digest that is equal for plans whose rings have the same vertices in the same order."""
    return hashlib.blake2b(plan.verts.tobytes(), digest_size=12).hexdigest()


def shape_digest(plan: FloorPlan) -> str:
    """Return a digest that is equal for plans with the same walls up to shifts, rotations by 90 degrees and mirroring.

    It is made from the edges on the 1 cm grid, relative to the corner of the bounding box, and is the smallest of the
    eight symmetric views. The start and the direction of a ring make no difference.
    """
    rings = [np.rint(ring * 100).astype(np.int64) for ring in (plan.verts, *plan.holes)]
    points, following = np.concatenate(rings), np.concatenate([np.roll(ring, -1, axis=0) for ring in rings])
    x, y = (np.stack([points, following]) - points.min(axis=0)).transpose(2, 0, 1)
    flipped = [(x, y), (x.max() - x, y), (x, y.max() - y), (x.max() - x, y.max() - y)]
    across = np.stack([a for a, _ in flipped] + [b for _, b in flipped])  # (8 views, 2 ends, edges)
    up = np.stack([b for _, b in flipped] + [a for a, _ in flipped])
    one, other = np.moveaxis((across << 32 | up).view(np.uint64), 1, 0)
    edges = np.minimum(one, other) * _MIX + np.maximum(one, other)  # one number per edge, modulo 2**64
    edges.sort(axis=1)
    return hashlib.blake2b(min(view.tobytes() for view in edges), digest_size=12).hexdigest()
