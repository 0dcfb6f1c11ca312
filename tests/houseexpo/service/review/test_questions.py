"""What is asked about a plan, in which order, and what its answers do to it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from shapely import GEOSException, LineString
from shapely.ops import unary_union

from houseexpo.corrections import Correction, Override
from houseexpo.corrections.apply import correct_plan
from houseexpo.corrections.draft import Draft
from houseexpo.corrections.preview import preview
from houseexpo.floorplan import FloorPlan
from houseexpo.grids.frame import source_points_from_plan
from houseexpo.plan import Door, Room
from houseexpo.plan.parts import DoorKind
from houseexpo.service.review.line_questions import in_rows
from houseexpo.service.review.question import SEVERAL, Answer
from houseexpo.service.review.questions import questions
from tests.builders.services import FRAME, box, two_rooms

CUT_ANSWERS = ("door", "no_door", "opening", "one_room", "no_room", "outside")


def plan_with(kind: DoorKind = "door", sure: float | None = 1.0, room: float | None = 1.0) -> FloorPlan:
    """Two rooms; the passage between them has a kind and a confidence, the bedroom one."""
    plan = replace(two_rooms("house"), frame=FRAME)
    kitchen, bedroom = plan.rooms
    (door,) = plan.doors
    return replace(
        plan,
        rooms=(kitchen, replace(bedroom, confidence=room)),
        doors=(replace(door, kind=kind, confidence=sure),),
    )


def with_entrance(sure: float) -> FloorPlan:
    plan = plan_with()
    door = Door(1, "entrance", ((0.1, 1.0), (0.1, 2.0)), 1.0, box(0.0, 1.0, 0.1, 2.0), (0, None), sure)
    return replace(plan, doors=(*plan.doors, door))


def said(plan: FloorPlan, answer: Answer) -> FloorPlan:
    """The plan after an answer."""
    points: list[Any] = source_points_from_plan(plan.frame, answer.points).tolist()  # type: ignore[arg-type]
    value = tuple(points[0]) if len(points) == 1 else tuple(map(tuple, points))
    found = preview(plan, [Correction(answer.action, value)])  # type: ignore[arg-type]
    assert found.records[0]["outcome"] in {"done", "already"}, found.records
    return found.plan


def test_a_plan_that_is_sure_asks_nothing() -> None:
    assert questions(plan_with()) == []
    assert questions(plan_with(sure=None, room=None)) == []
    assert questions(replace(plan_with("cut", 0.1), frame=None)) == []


@pytest.mark.parametrize(
    ("plan", "words"),
    [
        (plan_with("cut", 0.06), CUT_ANSWERS),
        (plan_with("cut", None), CUT_ANSWERS),
        (plan_with("door", 0.5), ("door", "no_door", "one_room")),
        (plan_with("opening", 0.8), ("opening", "no_door", "one_room")),
        (with_entrance(0.4), ("entrance", "window", "no_door")),
        (with_entrance(0.95), ("entrance", "window", "no_door")),
        (plan_with(room=0.3), ("room", "no_room", "outside", "leave")),
    ],
)
def test_a_doubtful_place_has_contrary_answers_and_each_settles_it(plan: FloorPlan, words: tuple[str, ...]) -> None:
    (asked,) = questions(plan)
    assert tuple(answer.action for answer in asked.answers) == words
    found = [said(plan, answer) for answer in asked.answers if answer.action != "leave"]
    assert all(asked.key not in {each.key for each in questions(each)} for each in found)
    assert len(found[0].rooms) == 2
    shapes = [(len(each.rooms), sorted((door.kind, door.rooms) for door in each.doors)) for each in found]
    assert shapes[0] not in shapes[1:]
    assert questions(plan, [asked.key]) == []


def test_cuts_between_parts_that_have_entrances_are_answered_at_once() -> None:
    rooms = tuple(Room(k, "Room", box(x, 0.0, x + 3.0, 3.0)) for k, x in enumerate((0.0, 3.5, 7.0)))
    cuts = [
        Door(k, "cut", ((x, 1.0), (x, 1.5)), 0.5, box(x - 0.25, 1.0, x + 0.25, 1.5), (k, k + 1), 0.1)
        for k, x in enumerate((3.25, 6.75))
    ]
    ways = [
        Door(k + 2, "entrance", ((x, -0.05), (x + 1.0, -0.05)), 1.0, box(x, -0.1, x + 1.0, 0.0), (k, None), 0.95)
        for k, x in enumerate((1.0, 4.0, 8.0))
    ]
    ring = unary_union([*(room.polygon for room in rooms), *(cut.polygon for cut in cuts)]).exterior.coords[:-1]
    plan = FloorPlan("row", list(ring), 3, {}, rooms=rooms, doors=(*cuts, *ways), frame=FRAME)
    asked = [each for each in questions(plan) if each.key.startswith("cut")]
    assert [len(each.answers[-1].more) for each in asked] == [1, 1]
    assert {each.answers[-1].action for each in asked} == {"no_door"}
    one_way = questions(replace(plan, doors=(*cuts, ways[0])))
    assert all(not each.answers[-1].more for each in one_way)


def test_a_room_of_a_row_may_have_its_door_to_the_hall_before_it() -> None:
    shapes = (box(0.0, 0.0, 3.0, 3.0), box(3.1, 0.0, 6.1, 3.5), box(0.0, 3.1, 3.0, 9.0))
    rooms = tuple(Room(k, "Office", shape) for k, shape in enumerate(shapes))
    cut = Door(0, "cut", ((3.05, 1.0), (3.05, 1.8)), 0.8, box(3.0, 1.0, 3.1, 1.8), (0, 1), None)
    way = Door(1, "door", ((3.05, 3.2), (3.05, 3.4)), 0.2, box(3.0, 3.2, 3.1, 3.4), (1, 2), 1.0)
    whole = unary_union([*(room.polygon for room in rooms), cut.polygon, way.polygon])
    plan = FloorPlan("row", list(whole.exterior.coords[:-1]), 3, {}, rooms=rooms, doors=(cut, way), frame=FRAME)
    (asked,) = questions(plan)
    assert asked.answers[-1].title == "A door to the largest room beside it"
    (asked_again,) = questions(plan, said=[("no_door", [asked.answers[-1].points[0]])])
    assert len(asked_again.answers) == len(asked.answers) - 1
    found = said(plan, asked.answers[-1])
    assert sorted((door.kind, door.rooms) for door in found.doors) == [("door", (0, 2)), ("door", (1, 2))]


def test_rooms_that_meet_without_a_wall_may_be_one() -> None:
    kitchen, bedroom = two_rooms("house").rooms
    outline = box(0.1, 0.1, 7.1, 3.1)
    rooms = (replace(kitchen, ring=box(0.1, 0.1, 4.1, 3.1)), replace(bedroom, ring=box(4.1, 0.1, 7.1, 3.1)))
    plan = FloorPlan("house", outline, 2, {}, rooms=rooms, frame=FRAME)
    (asked,) = questions(plan)
    assert "meet without a wall for 3.0 m" in asked.says
    assert asked.at == pytest.approx((4.1, 1.6), abs=0.02)
    assert len(said(plan, asked.answers[0]).rooms) == 1
    assert asked.answers[1].action == "leave"


def test_a_ring_that_crosses_itself_costs_neither_the_questions_nor_the_answers() -> None:
    plan = with_entrance(0.6)
    door, way = plan.doors
    tip = [(0.0, 2.0), (0.1, 2.0), (0.1, 1.0), (0.0, 1.0), (0.01, 0.99), (0.0, 1.01)]  # as rounding leaves it
    crossed = replace(plan, doors=(door, replace(way, ring=np.array(tip))))
    assert not crossed.doors[1].polygon.is_valid
    assert [each.key for each in questions(crossed)] == [each.key for each in questions(plan)]
    kitchen, bedroom = plan.rooms
    corner = [(4.2, 0.1), (4.2, 3.1), (7.2, 3.1), (7.2, 0.1), (4.2, 0.1), (4.21, 0.09), (4.2, 0.12)]
    crossed = replace(crossed, rooms=(kitchen, replace(bedroom, ring=np.array(corner))))
    (asked,) = questions(crossed)
    assert [door.kind for door in said(crossed, asked.answers[1]).doors] == ["door"]
    draft = Draft(crossed)
    assert all(part.shape.is_valid for parts in (draft.rooms, draft.doors) for part in parts)


def test_a_fault_of_geometry_costs_the_question_only(monkeypatch: pytest.MonkeyPatch) -> None:
    def fault(*_: object) -> Any:
        raise GEOSException("TopologyException: side location conflict")

    plan = plan_with("door", 0.5)
    monkeypatch.setattr("houseexpo.service.review.line_questions._parting_lines", fault)
    assert [each.key.split(" ")[0] for each in questions(plan)] == ["door"]


def test_what_is_worth_most_comes_first() -> None:
    found = questions(replace(with_entrance(0.6), rooms=plan_with(room=0.2).rooms))
    assert [each.doubt for each in found] == [0.8, 0.4]
    assert "room of the house" in found[0].says
    found = questions(replace(with_entrance(0.35), rooms=plan_with(room=0.5).rooms))
    assert [each.doubt for each in found] == [0.5, 0.65]  # a room of a third of the plan decides of more than a passage


def test_a_cut_that_follows_from_words_comes_late() -> None:
    rooms = plan_with(room=0.5).rooms
    for sure, first in ((0.06, "cut"), (None, "room")):
        assert questions(replace(plan_with("cut", sure), rooms=rooms))[0].key.startswith(first)


def test_questions_of_a_kind_stand_together() -> None:
    plan = with_entrance(0.4)
    more = replace(plan.doors[1], id=2, segment=((7.1, 1.0), (7.1, 2.0)), ring=box(7.1, 1.0, 7.2, 2.0), rooms=(1, None))
    doors = (replace(plan.doors[0], confidence=0.5), plan.doors[1], replace(more, confidence=0.6))
    found = questions(replace(plan, doors=doors))
    assert [each.group[0] for each in found] == ["entrance", "entrance", "door"]


def test_questions_of_parts_of_one_size_are_alike() -> None:
    plan = with_entrance(0.4)
    wide = [((7.1, 0.4), (7.1, 2.4)), ((3.0, 3.1), (5.0, 3.1)), ((3.0, 0.1), (5.1, 0.1))]
    more = [
        replace(plan.doors[1], id=k, segment=ends, width=2.0 + (k == 4) / 10, rooms=(1, None))
        for k, ends in enumerate(wide, 2)
    ]
    found = questions(replace(plan, doors=(*plan.doors, *more)))
    assert sorted(each.like for each in found) == ["1.0 m", *["2.0 to 2.1 m"] * 3]
    assert len({each.group for each in found}) == 2
    assert {each.like for each in questions(plan)} == {""}


def test_the_entrance_that_was_the_door_of_no_room_is_asked_about() -> None:
    plan = replace(two_rooms("house"), frame=FRAME)
    (asked,) = questions(correct_plan(plan, Override(no_room=(source_of(plan, (5.5, 1.5)),)).corrections).plan)
    assert "Does one walk in here" in asked.says
    assert [each.action for each in asked.answers] == ["entrance", "window", "no_door"]


def source_of(plan: FloorPlan, at: tuple[float, float]) -> tuple[float, float]:
    x, y = source_points_from_plan(plan.frame, [at]).round(3)[0].tolist()  # type: ignore[arg-type]  # it has one
    return x, y


def hall() -> FloorPlan:
    """One room of two that a neck of 2 m joins, and a second room beside it."""
    plan = plan_with(room=1.0)
    kitchen, bedroom = plan.rooms
    ring = [(0.1, 0.1), (0.1, 9.1), (4.1, 9.1), (4.1, 5.1), (2.1, 5.1), (2.1, 4.1), (4.1, 4.1), (4.1, 0.1)]
    return replace(plan, rooms=(replace(kitchen, ring=np.array(ring), confidence=0.6), bedroom))


def test_a_room_that_is_several_is_asked_where_it_parts() -> None:
    plan = hall()
    asked = questions(plan)
    (room,) = (each for each in asked if each.key.startswith("room"))
    assert [answer.title for answer in room.answers][-1] == SEVERAL
    first = questions(plan, {room.key}, several={room.key})[0]
    assert first.key.startswith("corner")
    assert first.doubt > next(each.doubt for each in asked if each.key.startswith("corner"))
    assert len(said(plan, first.answers[0]).rooms) == 3


def test_pieces_of_wall_in_a_row_are_one() -> None:
    pieces = [LineString([(x, 5.0), (x + 1.0, 5.1)]) for x in (4.0, 0.0, 2.0)]
    rows = in_rows([*pieces, LineString([(0.0, 8.0), (3.0, 8.0)]), LineString([(9.0, 5.0), (12.0, 5.0)])])
    assert sorted([round(line.coords[0][0]) for line in row] for row in rows) == [[0], [0, 2, 4], [9]]
