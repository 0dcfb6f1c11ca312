"""Measures: one plan in, one number or one table of counts out."""

from __future__ import annotations

from collections import Counter

from houseexpo.plan import FloorPlan


def rooms(plan: FloorPlan) -> int:
    """Rooms as the source counts them, unlabelled ones included."""
    return plan.room_num


def area_m2(plan: FloorPlan) -> float:
    """Free space inside the walls, m2."""
    return float(plan.free_space.area)


def labels(plan: FloorPlan) -> Counter[str]:
    """Rooms by label; a published plan, which has no rooms, by its boxes."""
    if plan.rooms:
        return Counter(room.label for room in plan.rooms)
    return Counter({label: len(boxes) for label, boxes in plan.room_category.items()})


def doors(plan: FloorPlan) -> Counter[str]:
    """Doors by kind."""
    return Counter(door.kind for door in plan.doors)
