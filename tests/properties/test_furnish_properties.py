"""Furniture in any room: it stands inside, apart, clear of doors, and leaves one place to a robot."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import shapely
from hypothesis import given
from hypothesis import strategies as st

from houseexpo.plan import Door, Room
from pipeline.furnish.catalogue import WANTS
from pipeline.furnish.room import COVERED, GAP_CM, RoomFurnisher, has_simple_rings, round_to_cm
from tests.builders.tries import tries

_SIDES = st.integers(12, 80)  # tenths of a metre


@st.composite
def rooms(draw: st.DrawFn) -> Room:
    """A rectangle, less a corner that is cut off square or aslant, or a pillar."""
    width, depth = draw(_SIDES) / 10, draw(_SIDES) / 10
    cut = draw(st.sampled_from(["none", "square", "aslant", "pillar"]))
    x, y = round(width * draw(st.integers(3, 7)) / 10, 2), round(depth * draw(st.integers(3, 7)) / 10, 2)
    corner = {"square": [(x, depth), (x, y), (width, y)], "aslant": [(x, depth), (width, y)]}
    ring = [(0.0, 0.0), (0.0, depth), *corner.get(cut, [(width, depth)]), (width, 0.0)]
    post = ((x, y), (x + 0.3, y), (x + 0.3, y + 0.3), (x, y + 0.3))
    holes = (np.round(post, 2),) if cut == "pillar" and min(x, y, width - x - 0.3, depth - y - 0.3) > 0.1 else ()
    return Room(0, draw(st.sampled_from(sorted(WANTS))), np.round(ring, 2), holes)


def door_below(room: Room) -> Door:
    """A door of up to 0.8 m in the wall at y = 0."""
    width = min(0.8, float(room.ring[:, 0].max()) - 0.2)
    ring = [(0.1, -0.1), (0.1, 0.0), (0.1 + width, 0.0), (0.1 + width, -0.1)]
    return Door(0, "entrance", ((0.1, -0.05), (0.1 + width, -0.05)), width, np.round(ring, 2), (0, None))


def places(shape: shapely.Polygon) -> int:
    """Count where a disc of 0.2 m can stand; mitred, as a robot in a corner needs a little less."""
    parts = shapely.get_parts(shapely.buffer(shape, -20, join_style="mitre"))
    return sum(part.area >= 1000 for part in parts)


@tries(40)
@given(rooms(), st.integers(0, 2**32 - 1))
def test_furniture_keeps_its_rules_in_any_room(room: Room, seed: int) -> None:
    door = door_below(room)
    standing = RoomFurnisher(room, [door], WANTS.get(room.label, ()), np.random.default_rng(seed)).furnish()
    boxes = [shapely.box(*each.box.tolist()) for each in standing]
    shape = round_to_cm(room.polygon)
    assert all(shape.covers(box) for box in boxes)
    assert all(one.distance(other) >= GAP_CM for one, other in combinations(boxes, 2))
    before = shapely.LineString(round_to_cm(shapely.LineString(door.segment))).buffer(45, cap_style="flat")
    assert not any(box.intersection(before).area > 1 for box in boxes)
    assert sum(box.area for box in boxes) <= COVERED * shape.area
    left = shapely.difference(shape, shapely.union_all(boxes))
    assert has_simple_rings(left)
    assert places(left) <= max(places(shape), 1)
    assert not boxes or places(left)
