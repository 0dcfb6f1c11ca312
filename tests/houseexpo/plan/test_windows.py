"""Windows of a plan: values, their JSON, their rules, where they lie in a wall, and what moves or corrects them."""

from __future__ import annotations

from dataclasses import replace

import msgspec
import numpy as np
import pytest
import shapely

from houseexpo.corrections import Override
from houseexpo.dataset.validation import OURS
from houseexpo.drawing.scene import lay_out_plan
from houseexpo.errors import PlanError
from houseexpo.exports.placement import orient_plan
from houseexpo.floorplan import FloorPlan, decode
from houseexpo.inference import with_rooms
from houseexpo.inference.windows import place_windows
from houseexpo.plan import Door, Frame, PlanObject
from houseexpo.plan.json_codec import encode


def box(x1: float, y1: float, x2: float, y2: float) -> list[tuple[float, float]]:
    return [(x1, y1), (x1, y2), (x2, y2), (x2, y1)]


OUTER = Door(0, "window", ((5.0, 3.2), (6.2, 3.2)), 1.2, box(5.0, 3.1, 6.2, 3.3), (1, None), sill=0.9, head=2.05)
INNER = Door(1, "window", ((4.15, 2.2), (4.15, 2.8)), 0.6, box(4.1, 2.2, 4.2, 2.8), (0, 1))


@pytest.fixture
def lit(two_rooms: FloorPlan) -> FloorPlan:
    return replace(two_rooms, windows=(OUTER, INNER))


def test_a_plan_without_windows_is_written_as_before(two_rooms: FloorPlan, lit: FloorPlan) -> None:
    assert b"window" not in encode(two_rooms)
    keys = msgspec.json.decode(encode(lit))
    assert keys.pop("windows")[1] == {
        "id": 1,
        "segment": [[4.15, 2.2], [4.15, 2.8]],
        "width": 0.6,
        "polygon": [[4.1, 2.2], [4.1, 2.8], [4.2, 2.8], [4.2, 2.2]],
        "rooms": [0, 1],
    }
    assert msgspec.json.encode(keys) == encode(two_rooms)
    assert decode(encode(lit)) == lit


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"rooms": (None, 1)}, "rooms: expected a room id, and another or null for kind 'window'"),
        ({"sill": 2.5}, "sill: expected metres of a window, 0 <= sill < head, found"),
        ({"sill": -0.1}, "sill: expected metres"),
        ({"head": float("nan")}, "head: expected a finite number"),
        ({"kind": "door", "rooms": (0, 1)}, "sill: expected metres of a window"),
    ],
)
def test_a_broken_window_is_refused(change: dict[str, object], message: str) -> None:
    with pytest.raises(PlanError, match=message):
        replace(OUTER, **change)


def test_doors_are_no_windows_and_windows_belong_to_rooms_that_exist(lit: FloorPlan) -> None:
    with pytest.raises(PlanError, match=r"doors\[0\].kind: expected a window in windows only"):
        replace(lit, doors=(OUTER,))
    with pytest.raises(PlanError, match=r"windows\[0\].kind"):
        replace(lit, windows=lit.doors[:1])
    with pytest.raises(PlanError, match=r"windows\[0\].rooms: expected ids of rooms \[0, 1\], found \[7, None\]"):
        replace(lit, windows=(replace(OUTER, rooms=(7, None)),))
    with pytest.raises(PlanError, match=r"windows\[1\].id: expected ids that differ"):
        replace(lit, windows=(OUTER, OUTER))


@pytest.mark.parametrize(
    ("change", "key"),
    [
        ({"ring": box(5.0, 2.0, 6.2, 2.2), "segment": ((5.0, 2.1), (6.2, 2.1))}, "polygon"),  # in the room
        ({"ring": box(5.0, 3.4, 6.2, 3.6), "segment": ((5.0, 3.5), (6.2, 3.5))}, "polygon"),  # away from it
        ({"width": 0.7}, "width"),
        ({"width": 0.0, "segment": ((5.0, 3.2), (5.0, 3.2))}, "width"),
        ({"segment": ((5.0, 5.2), (6.2, 5.2))}, "segment"),
        ({"ring": [(5.0, 3.1), (6.2, 3.3), (5.0, 3.3), (6.2, 3.1)]}, "polygon"),
    ],
)
def test_a_window_lies_in_a_wall_at_the_edge_of_a_room(lit: FloorPlan, change: dict[str, object], key: str) -> None:
    assert list(OURS["windows"](lit)) == []
    found = list(OURS["windows"](replace(lit, windows=(replace(OUTER, **change),))))
    assert [each for each, _ in found] == [f"windows[0].{key}"]


def test_windows_move_and_turn_with_the_plan(lit: FloorPlan) -> None:
    moved = lit.moved(2.0, -1.0).windows[0]
    np.testing.assert_allclose(moved.ring, OUTER.ring + np.array([2.0, -1.0]))
    assert moved.segment == ((7.0, pytest.approx(2.2)), (8.2, pytest.approx(2.2)))
    flipped = orient_plan(replace(lit, frame=Frame(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)), "y", 0.0, 0)))
    assert flipped.windows[0].polygon.bounds == pytest.approx((5.0, -0.1, 6.2, 0.1))
    assert list(OURS["windows"](flipped)) == []


def drawn(at: float, depth: float) -> Door:
    """Return a window beyond the upper edge of the rooms, y = 3.1, as a source may draw it."""
    return Door(7, "window", ((5.0, at), (6.2, at)), 1.2, box(5.0, at - depth / 2, 6.2, at + depth / 2), (0, None))


@pytest.mark.parametrize(
    ("window", "found"),
    [
        (drawn(3.2, 0.2), (3.1, 3.3)),
        (drawn(3.25, 0.1), (3.1, 3.3)),  # in the outer half of its wall
        (drawn(3.2, 0.002), (3.1, 3.25)),  # a line
        (drawn(3.12, 0.4), (3.1, 3.32)),  # it reaches into the room
    ],
)
def test_a_window_goes_from_the_edge_of_its_room_to_the_face_that_is_drawn(
    two_rooms: FloorPlan, window: Door, found: tuple[float, float]
) -> None:
    (placed,) = place_windows([window], two_rooms.rooms)
    assert (placed.id, placed.rooms) == (0, (1, None))
    assert placed.polygon.bounds == pytest.approx((5.0, found[0], 6.2, found[1]))
    assert placed.segment[0][1] == pytest.approx(sum(found) / 2, abs=0.006)
    assert place_windows([placed], two_rooms.rooms) == (placed,)  # it stays where it is


def test_a_window_ends_where_no_room_is_beside_it(two_rooms: FloorPlan) -> None:
    right = max(room.polygon.bounds[2] for room in two_rooms.rooms)
    long = Door(0, "window", ((5.0, 3.2), (right + 1.0, 3.2)), right - 4.0, box(5.0, 3.1, right + 1.0, 3.3), (0, None))
    (placed,) = place_windows([long], two_rooms.rooms)
    assert placed.polygon.bounds == pytest.approx((5.0, 3.1, right, 3.3))
    assert placed.width == pytest.approx(right - 5.0)


def test_a_window_between_rooms_has_both_and_one_in_no_wall_is_left_out(two_rooms: FloorPlan) -> None:
    (inner,) = place_windows([replace(INNER, rooms=(0, None))], two_rooms.rooms)
    assert set(inner.rooms) == {0, 1}
    far, short = drawn(4.0, 0.2), Door(0, "window", ((5.0, 3.2), (5.0, 3.2)), 0.0, box(5.0, 3.1, 5.01, 3.3), (0, None))
    assert place_windows([drawn(2.0, 0.2), far, short], two_rooms.rooms) == ()


def test_furniture_before_a_window_does_not_move_it(two_rooms: FloorPlan) -> None:
    _, room = two_rooms.rooms
    notched = [(4.2, 0.1), (4.2, 3.1), (4.5, 3.1), (4.5, 2.5), (6.5, 2.5), (6.5, 3.1), (7.2, 3.1), (7.2, 0.1)]
    rooms, board = (replace(room, ring=notched),), PlanObject(0, "sideboard", 1, box(4.5, 2.5, 6.5, 3.1), 0.8)
    assert place_windows([OUTER], rooms, [board]) == (OUTER,)


def test_rooms_that_are_found_anew_have_the_windows(lit: FloorPlan) -> None:
    found = with_rooms(lit)
    assert [window.polygon.bounds for window in found.windows] == [w.polygon.bounds for w in lit.windows]
    assert found.room(found.windows[0].rooms[0] or 0).polygon.distance(found.windows[0].polygon) < 0.02


def test_windows_follow_corrections_of_rooms_and_the_word_window_makes_one(lit: FloorPlan) -> None:
    plan = replace(lit, frame=None)
    assert plan.corrected(Override(label=[[5.0, 1.0, "Kitchen"]])).plan.windows == plan.windows
    one = plan.corrected(Override(one_room=[[1.0, 2.0], [6.0, 1.0]])).plan
    assert [(window.id, window.rooms) for window in one.windows] == [(0, (0, None))]
    said = plan.corrected(Override(window=[[0.05, 1.5]]))  # what was an entrance
    made = said.plan.windows[2]
    assert (made.rooms, made.width, made.polygon.bounds) == ((0, None), 0.9, pytest.approx((0.0, 1.0, 0.1, 1.9)))
    assert [door.kind for door in said.plan.doors] == ["door"]
    assert list(OURS["windows"](said.plan)) == []


@pytest.mark.parametrize("style", ["architect", "technical", "semantic"])
def test_a_window_is_a_gap_in_the_wall_between_two_lines(two_rooms: FloorPlan, lit: FloorPlan, style: str) -> None:
    before, after = (lay_out_plan(plan, 50.0, 0, style) for plan in (two_rooms, lit))
    lines = after.lines[len(before.lines) :]
    ends = [sorted(map(tuple, line.points.round(3).tolist())) for line in lines]
    assert ends == [
        *([(5.0, 3.1), (6.2, 3.1)], [(5.0, 3.25), (6.2, 3.25)]),  # the wall is drawn 0.15 m thick
        *([(4.2, 2.2), (4.2, 2.8)], [(4.1, 2.2), (4.1, 2.8)]),
    ]
    gaps = after.areas[len(before.areas) :]
    assert shapely.union_all([gap.shape for gap in gaps]).area == pytest.approx(1.2 * 0.15 + 0.6 * 0.1)
