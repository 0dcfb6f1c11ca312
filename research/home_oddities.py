"""Count what an architect would find odd in homes, of the rooms and storeys that may have it.

    python -m research.home_oddities plans/demo [PLANS]

Living rooms are compared with the number of bedrooms in flats and bungalows only, which have one storey.
"""

from __future__ import annotations

import sys
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import numpy as np

import houseexpo
from houseexpo.floorplan import FloorPlan

GLAZED_PART = 1 / 8
"""Of the floor area: German and Swiss building codes ask for 1/8 or 1/10."""
GLAZED_DOOR_M = 2.0
"""The height of the glass of a door to the outside."""
BALCONY_M = 2.5
"""The depth from which on a balcony darkens the room behind it."""
CONTACT_M = 1.4
"""The length of wall that a way between kitchen and dining room needs."""
WALL_M = 0.2
"""A wall between two rooms is thinner than that."""
SMALL_LIVING_M2, LARGE_LIVING_M2 = 22.0, 33.0
OUTDOORS = frozenset({"Balcony", "Terrace"})
BEDS = frozenset({"Bedroom", "Child_Room"})
GLAZED = ("Living_Room", "Dining_Room", "Bedroom", "Child_Room", "Office")


def oddities(plan: FloorPlan) -> Iterator[tuple[str, bool]]:
    """Yield each oddity that the plan may have, and whether a room or the storey has it."""
    of = defaultdict(list)
    for room in plan.rooms:
        of[room.label].append(room)
    glass = _glass_m2(plan)
    yield from (
        (f"{label}: glass less than 1/8 of the floor", glass[room.id] < GLAZED_PART * room.area)
        for label in GLAZED
        for room in of[label]
    )
    ways = {frozenset(door.rooms) for door in plan.doors}
    for kitchen in of["Kitchen"]:
        for dining in of["Dining_Room"]:
            between = kitchen.polygon.buffer(WALL_M / 2).intersection(dining.polygon.buffer(WALL_M / 2))
            if not between.is_empty and max(np.subtract(between.bounds[2:], between.bounds[:2])) > CONTACT_M:
                yield "kitchen beside a dining room without a way", {kitchen.id, dining.id} not in ways
        yield "bath larger than the kitchen", any(bath.area > kitchen.area for bath in of["Bathroom"])
    yield "two stores or wardrobes on a storey", len(of["Storage"]) + len(of["Wardrobe"]) > 1
    for balcony in of["Balcony"]:
        door = np.array(next(each.segment for each in plan.doors if balcony.id in each.rooms))
        across = int(np.ptp(door, axis=0).argmin())
        yield (
            "balcony deeper than 2.5 m",
            bool(np.ptp(np.reshape(balcony.polygon.bounds, (2, 2)), axis=0)[across] > BALCONY_M),
        )
    beds = [room for label in sorted(BEDS) for room in of[label]]
    if len(beds) > 1 and of["Child_Room"]:
        yield "child's room is the largest bedroom", max(beds, key=lambda each: each.area).label == "Child_Room"
    if (plan.provenance or {}).get("kind") in {"flat", "bungalow"}:
        living = sum(room.area for room in of["Living_Room"])
        if len(beds) == 1:
            yield "one bedroom, living room above 33 m2", living > LARGE_LIVING_M2
        if len(beds) > 2:
            yield "three bedrooms, living room below 22 m2", living < SMALL_LIVING_M2


def _glass_m2(plan: FloorPlan) -> dict[int, float]:
    """Return the area of the windows and glazed doors of each room, m2."""
    glass: dict[int, float] = defaultdict(float)
    outdoors = {None, *(room.id for room in plan.rooms if room.label in OUTDOORS)}
    panes = [(window, (window.head or 0.0) - (window.sill or 0.0)) for window in plan.windows]
    panes += [(door, GLAZED_DOOR_M) for door in plan.doors if outdoors & set(door.rooms)]
    for hole, height in panes:
        for room in hole.rooms:
            if room is not None:
                glass[room] += hole.width * height
    return glass


def main() -> None:
    """Print for each oddity its share, its count, and of how many."""
    plans = houseexpo.open_dataset(Path(sys.argv[1]))
    ids = plans.ids[: int(sys.argv[2])] if len(sys.argv) > 2 else plans.ids
    found: dict[str, list[bool]] = defaultdict(list)
    for name in ids:
        for oddity, has in oddities(plans[name]):
            found[oddity].append(has)
    lines = [f"{np.mean(each):5.1%} {sum(each):5d} of {len(each):5d}  {name}" for name, each in sorted(found.items())]
    sys.stdout.write("\n".join([f"plans {len(ids)}", *lines]) + "\n")


if __name__ == "__main__":
    main()
