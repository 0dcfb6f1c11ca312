"""Each word does to a plan what it says, at the place where it is said, and says what it did or why it did nothing."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import shapely
from shapely import LineString, Polygon
from shapely.affinity import translate

from houseexpo.corrections import Correction, Override
from houseexpo.corrections.apply import Corrected, correct_plan
from houseexpo.corrections.draft import Space, _in_one
from houseexpo.corrections.joining import CUT_M
from houseexpo.corrections.passages import WIDEST_DOOR_M
from houseexpo.corrections.preview import preview
from houseexpo.corrections.vocabulary import UNITS, WORDS
from houseexpo.dataset.validation import BOTH, OURS
from houseexpo.errors import ConfigError
from houseexpo.floorplan import FloorPlan, decode
from houseexpo.plan import Door, Frame, Quality, Room
from houseexpo.plan.json_codec import encode
from houseexpo.tolerances import TILE_M2
from pipeline.config import ConnectivityConfig, DoorsConfig
from pipeline.sources.storeys import scale
from tests.builders.services import box, furnished, two_rooms

PLAN = two_rooms("a")
"""A kitchen of 4 x 3 m, a bedroom of 3 x 3 m, a wall from x = 4.1 to 4.2 between them, its door from y = 1.1 to 1.9."""


def corrected(plan: FloorPlan = PLAN, **words: Any) -> Corrected[FloorPlan]:
    found = correct_plan(plan, Override(**words).corrections)
    decode(encode(found.plan))  # it is a plan by the format
    return found


def areas(plan: FloorPlan) -> list[float]:
    return sorted(round(room.area, 2) for room in plan.rooms)


def kinds(plan: FloorPlan) -> list[str]:
    return sorted(door.kind for door in plan.doors)


def test_a_corrected_plan_keeps_the_rules_of_the_format() -> None:
    assert corrected(replace(PLAN, room_num=1), no_room=[5.5, 1.5]).plan.room_num == 1
    rooms = tuple(Room(k, "Room", box(x, 0.1, x + 3, 3.1)) for k, x in enumerate((0.1, 10.1)))
    way = Door(0, "door", ((6.6, 1.0), (6.6, 1.9)), 0.9, box(3.1, 1.0, 10.1, 1.9), (0, 1))
    ring = [(0.1, 0.1), (0.1, 3.1), (3.1, 3.1), (3.1, 1.9), (10.1, 1.9), (10.1, 3.1), (13.1, 3.1), (13.1, 0.1)]
    plan = FloorPlan("far", [*ring, (10.1, 0.1), (10.1, 1.0), (3.1, 1.0), (3.1, 0.1)], 2, {}, rooms=rooms, doors=(way,))
    found = corrected(plan, no_door=[6.6, 1.5]).plan  # a slit of 7 m joins the rooms
    assert not [fault for rule in (BOTH | OURS).values() for fault in rule(found)]


def test_a_stairwell_that_a_room_surrounds_stays_in_none() -> None:
    plan = furnished("a")
    (table,) = plan.objects
    well = replace(plan, objects=(replace(table, label="stairs", room=None, height=0.0),))
    (after,) = corrected(well, label=[1.0, 1.0, "Office"]).plan.objects
    assert after.is_stairwell


@pytest.mark.parametrize("x", [4.0, 4.1, 4.12, 4.15, 4.18, 4.2, 4.3])
def test_a_door_beside_a_wall_opens_the_wall(x: float) -> None:
    found = corrected(door=[[x, 2.1], [x, 2.9]])
    assert [effect.outcome for effect in found.effects] == ["done"]
    assert kinds(found.plan) == ["door", "door"]
    new = found.plan.doors[1]
    assert new.polygon.bounds == pytest.approx((4.1, 2.1, 4.2, 2.9))
    assert (new.width, new.confidence) == (0.8, 1.0)
    assert found.plan.area == pytest.approx(PLAN.area + 0.08)


def test_a_door_from_crossing_wall_to_crossing_wall_takes_what_is_clear() -> None:
    found = corrected(door=[[4.15, 2.5], [4.15, 3.4]])
    assert found.plan.doors[1].width == pytest.approx(0.6, abs=0.02)
    assert "0.60 m are clear" in found.effects[0].sentence


def test_a_door_in_an_outer_wall_leads_outside() -> None:
    for word in ("door", "entrance"):
        found = corrected(**{word: [[0.0, 1.0], [0.0, 1.9]]})
        assert kinds(found.plan) == ["door", "entrance"]
        assert found.plan.rooms == PLAN.rooms
        assert found.plan.area == pytest.approx(PLAN.area)  # an entrance stays closed


def test_an_entrance_leads_into_a_room_that_is_drawn_behind_it() -> None:
    ends = ((0.0, 1.0), (0.0, 1.9))
    way = Door(1, "entrance", ends, 0.9, box(-0.1, 1.0, 0.1, 1.9), (0, None), 0.3)
    plan = replace(PLAN, doors=(*PLAN.doors, way))
    found = corrected(plan, room_outline=[[-3.0, 0.2], [-0.1, 0.2], [-0.1, 3.0], [-3.0, 3.0]])
    assert kinds(found.plan) == ["door", "door"]  # no cut
    assert "the entrance of 0.90 m of the kitchen of 12.0 m2 leads into it" in found.effects[0].sentence
    far = corrected(plan, room_outline=[[-3.0, 2.0], [-0.1, 2.0], [-0.1, 4.0], [-3.0, 4.0]])
    assert "entrance" in kinds(far.plan)  # it does not lie before it


def test_a_door_between_stubs_parts_a_merged_room() -> None:
    stubs = corrected(wall=[[[2.0, 0.1], [2.0, 1.2]], [[2.0, 2.0], [2.0, 3.1]]]).plan
    assert len(stubs.rooms) == 2
    found = corrected(stubs, door=[[2.0, 1.2], [2.0, 2.0]])
    assert areas(found.plan) == [5.55, 6.15, 9.0]
    assert kinds(found.plan) == ["door", "door"]
    assert "parts a room" in found.effects[0].said


def test_a_door_across_a_narrow_part_brings_the_rest_of_its_wall_and_says_so() -> None:
    found = corrected(door=[[2.0, 0.9], [2.0, 2.2]])
    assert areas(found.plan) == [5.55, 6.15, 9.0]
    assert "a wall of 1.70 m closes its line" in found.effects[0].sentence


def test_a_door_wider_than_any_is_an_opening() -> None:
    wide = corrected(door=[[4.15, 0.1], [4.15, 3.1]])
    assert wide.plan.doors[0].kind == "opening"
    assert wide.plan.doors[0].width == pytest.approx(3.0, abs=0.02)
    assert "it is an opening" in wide.effects[0].sentence
    assert "the door of 0.80 m there gave way" in wide.effects[0].sentence or kinds(wide.plan) == ["opening"]


def test_a_door_where_one_stands_is_already_so() -> None:
    found = corrected(door=[[4.15, 1.1], [4.15, 1.9]])
    assert found.effects[0].outcome == "already"
    assert found.plan.doors[0].polygon.equals(PLAN.doors[0].polygon)
    opened = corrected(opening=[[4.15, 1.1], [4.15, 1.9]])
    assert (opened.effects[0].outcome, kinds(opened.plan)) == ("done", ["opening"])


def test_a_door_of_the_plan_that_is_wider_than_any_drawn_one_stays_a_door() -> None:
    (door,) = PLAN.doors
    wide = replace(door, segment=((4.15, 0.3), (4.15, 2.9)), width=2.6, ring=np.array(box(4.1, 0.3, 4.2, 2.9)))
    found = corrected(replace(PLAN, doors=(wide,)), door=[[4.15, 0.3], [4.15, 2.9]])
    assert found.effects[0].outcome == "already"
    assert kinds(found.plan) == ["door"]


@pytest.mark.parametrize(
    ("words", "why"),
    [
        ({"door": [[500.0, 1.0], [500.0, 1.9]]}, "492.8 m from the nearest room"),
        ({"entrance": [[4.15, 2.1], [4.15, 2.9]]}, "say door"),
        ({"no_room": [500.0, 1.0]}, "the nearest is 492.80 m away"),
        ({"no_room": [4.15, 1.5]}, "the point lies in a door"),
        ({"no_door": [2.0, 2.0]}, "no passage is there; the nearest is 2.10 m away"),
        ({"wall": [[500.0, 1.0], [500.0, 1.9]]}, "m from the nearest room"),
        ({"room": [500.0, 1.0]}, "no closed space"),
        ({"label": [500.0, 1.0, "Office"]}, "no room is there"),
        ({"one_room": [[1.0, 1.0], [500.0, 1.0]]}, "no room is there"),
        ({"no_wall": [[500.0, 1.0], [500.0, 1.9]]}, "m from the nearest room"),
        ({"window": [500.0, 1.5]}, "no passage is there; the nearest is"),
        ({"outside": [500.0, 1.5]}, "no room is there; the nearest is"),
        ({"room_outline": [[500, 1], [503, 1], [503, 4]]}, "492.8 m from the nearest room"),
    ],
)
def test_what_has_no_effect_says_why_and_changes_nothing(words: dict[str, Any], why: str) -> None:
    found = corrected(**words)
    assert found.effects[0].outcome == "none"
    assert why in found.effects[0].said
    assert encode(found.plan) == encode(PLAN)


def test_equal_doors_beside_each_other_are_said_once_and_the_other_names_it() -> None:
    one, other = ((4.15, 2.1), (4.15, 2.9)), ((4.18, 2.1), (4.18, 2.9))
    found = corrected(door=[one, other])
    assert [effect.outcome for effect in found.effects] == ["done", "none"]
    assert "door [[4.15, 2.1], [4.15, 2.9]] stands in its place, and is said too" in found.effects[1].said
    assert len(corrected(door=[one, one]).effects) == 1


def test_a_passage_of_another_width_takes_the_place_of_the_one_that_was_said_there() -> None:
    found = corrected(entrance=[[[0.0, 1.0], [0.0, 2.0]], [[0.0, 0.6], [0.0, 2.6]]])
    assert [effect.outcome for effect in found.effects] == ["done", "done"]
    assert sorted(door.width for door in found.plan.doors) == [0.8, 2.0]
    assert "entrance [[0.0, 1.0], [0.0, 2.0]] gave way" in found.effects[1].also


def test_a_slit_at_the_end_of_a_wall_keeps_no_line_from_parting() -> None:
    stub, post = box(2.95, 0.05, 3.05, 1.5), box(2.95, 2.7, 3.05, 2.9)  # 5 cm short of the outer wall
    plan = FloorPlan("slit", box(0.0, 0.0, 6.0, 4.0), 1, {}, holes=[stub])
    assert areas(corrected(plan, opening=[[3.0, 1.5], [3.0, 4.0]]).plan) == pytest.approx([11.8, 11.8], abs=0.05)
    halves = [[[3.0, 1.5], [3.0, 2.7]], [[3.0, 2.9], [3.0, 4.0]]]
    found = corrected(replace(plan, holes=[stub, post]), opening=halves)
    assert areas(found.plan) == pytest.approx([11.8, 11.8], abs=0.05)


def test_a_room_that_is_drawn_on_what_was_no_wall_before_has_its_walls() -> None:
    plan = FloorPlan("drawing", box(0.0, 0.0, 4.0, 4.0), 1, {})
    grid = Correction("no_wall", ((7.0, 0.0), (7.0, 4.0)))
    room = Correction("room_outline", ((4.2, 0.0), (7.0, 0.0), (7.0, 4.0), (4.2, 4.0)))
    assert kinds(correct_plan(plan, [grid, room]).plan) == ["cut"]
    assert kinds(correct_plan(plan, [room, grid]).plan) == ["cut", "entrance"]


def test_words_that_contradict_each_other_are_both_named() -> None:
    found = corrected(door=[[4.15, 2.1], [4.15, 2.9]], no_door=[4.15, 2.5])
    assert [effect.outcome for effect in found.effects] == ["done", "none"]
    assert "door [[4.15, 2.1], [4.15, 2.9]] is said too" in found.effects[1].said
    assert found.effects[1].against == "door [[4.15, 2.1], [4.15, 2.9]]"


@pytest.mark.parametrize(
    ("words", "first", "second"),
    [
        ({"wall": [[4.15, 2.0], [4.15, 3.0]], "no_wall": [[4.15, 2.1], [4.15, 2.9]]}, "wall", "no_wall"),
        ({"wall": [[2.0, 0.1], [2.0, 3.1]], "no_wall": [[2.0, 0.3], [2.0, 1.9]]}, "wall", "no_wall"),
        ({"wall": [[2.0, 0.1], [2.0, 3.1]], "one_room": [[1.0, 1.0], [3.0, 1.0]]}, "wall", "one_room"),
        ({"room": [1.0, 1.0], "no_room": [2.0, 2.0]}, "room", "no_room"),
        ({"room": [1.0, 1.0], "outside": [2.0, 2.0]}, "room", "outside"),
        ({"room_outline": [[8, 1], [10, 1], [10, 3], [8, 3]], "no_room": [9.0, 2.0]}, "room_outline", "no_room"),
        ({"no_wall": [[4.15, 2.0], [4.15, 3.0]], "no_room": [1.0, 1.0]}, "no_wall", "no_room"),
        ({"no_room": [[1.0, 1.0]], "outside": [[2.0, 2.0]]}, "no_room", "outside"),
        ({"no_room": [[1.0, 1.0]], "label": [2.0, 2.0, "Office"]}, "no_room", "label"),
        ({"door": [[4.15, 2.1], [4.15, 2.9]], "window": [4.15, 2.5]}, "door", "window"),
        ({"label": [[1.0, 1.0, "Kitchen"], [2.0, 2.0, "Office"]]}, "label", "label"),
    ],
)
def test_each_contradiction_is_refused_and_names_the_other_entry(words: Any, first: str, second: str) -> None:
    found = corrected(**words)
    refused = found.effects[-1]
    assert (found.effects[0].correction.word, refused.correction.word, refused.outcome) == (first, second, "none")
    assert str(found.effects[0].correction) in refused.said
    alone = correct_plan(PLAN, [found.effects[0].correction])
    assert encode(found.plan) == encode(alone.plan)  # the later one changed nothing


def test_without_a_wall_the_rooms_beside_it_are_one_with_what_was_drawn_between_them() -> None:
    found = corrected(no_wall=[[4.12, 2.1], [4.12, 2.9]])
    assert areas(found.plan) == [21.16]  # the door's 0.08 m2 and the gap's
    assert found.plan.rooms[0].confidence is None
    assert "the door of 0.80 m between them is part of it" in found.effects[0].also
    whole = corrected(no_wall=[[4.2, 0.0], [4.2, 3.2]])
    assert areas(whole.plan) == [21.3]
    assert "3.00 m of wall are gone" in whole.effects[0].said


def test_a_line_of_a_drawing_that_is_no_wall_leaves_the_walls_that_others_draw() -> None:
    wall, pipe = [[4.15, 0.1], [4.15, 3.1]], [[4.12, 2.0], [4.12, 2.9]]
    floor = [[2.0, 1.0], [2.0, 2.0]]

    def said(*no_walls: Any, lines: Any) -> Corrected[FloorPlan]:
        drawn = [LineString(line) for line in lines]
        return correct_plan(PLAN, Override(no_wall=no_walls).corrections, lines=drawn)

    kept = said(pipe, lines=[wall, pipe, floor])
    assert [effect.outcome for effect in kept.effects] == ["already"]
    assert "another line of the drawing" in kept.effects[0].said
    assert encode(kept.plan) == encode(PLAN)
    assert len(said(pipe, floor, lines=[wall, wall[::-1], pipe, floor]).plan.rooms) == 2
    assert len(said(wall, lines=[wall, wall[::-1]]).plan.rooms) == 2  # two lines in one place, of two layers
    assert len(said(wall, lines=[wall, floor]).plan.rooms) == 1
    assert len(said(pipe, wall, lines=[wall, pipe]).plan.rooms) == 1  # both together
    by_hand = [[4.15, 0.5], [4.15, 2.5]]
    assert len(said(by_hand, lines=[wall, pipe]).plan.rooms) == 1
    half = said(wall, lines=[wall, [[4.15, 1.5], [4.15, 3.1]]])
    assert [effect.outcome for effect in half.effects] == ["done"]
    assert "1.40 m of wall are gone" in half.effects[0].said


def test_a_wall_stub_without_a_wall_is_floor_again() -> None:
    stub = corrected(wall=[[2.0, 0.1], [2.0, 2.0]]).plan
    found = corrected(stub, no_wall=[[2.0, 0.1], [2.0, 2.0]])
    assert areas(found.plan) == pytest.approx([9.0, 12.0], abs=0.03)


@pytest.mark.parametrize("aside", [-0.2, 0.0, 0.2])
def test_no_wall_takes_out_all_wall_beside_its_line_from_end_to_end(aside: float) -> None:
    """A row of desks of several depths with gaps, as a robot sees it; a desk beyond the end of the line stays."""
    desks = [box(1.0, 1.9, 2.0, 2.1), box(2.0, 1.95, 2.6, 2.5), box(3.0, 1.8, 3.8, 2.05), box(4.4, 1.7, 5.2, 2.1)]
    row = shapely.union_all([Polygon(each) for each in desks])
    holes = tuple(list(part.exterior.coords)[:-1] for part in shapely.get_parts(row))
    plan = FloorPlan("class", box(0.0, 0.0, 6.0, 4.0), 1, {}, holes, rooms=(Room(0, "Office", box(0, 0, 6, 4), holes),))
    found = corrected(plan, no_wall=[[0.8, 2.0 + aside], [4.0, 2.0 + aside]])
    assert found.effects[0].outcome == "done"
    assert areas(found.plan) == [pytest.approx(24.0 - 0.32, abs=0.01)]
    again = corrected(found.plan, no_wall=[[0.8, 2.0], [4.0, 2.0]])
    assert again.effects[0].outcome == "already"


def test_no_wall_takes_out_the_wall_between_two_rooms_and_what_goes_on_in_one() -> None:
    """A row of desks parts a room into two for half of its length; around its other half, the room goes on."""
    ring = [(0.0, 0.0), (6.0, 0.0), (6.0, 4.0), (3.0, 4.0), (3.0, 2.1), (2.9, 2.1), (2.9, 2.0), (4.4, 2.0), (4.4, 1.8)]
    ring += [(0.0, 1.8)]
    rooms = (Room(0, "Office", ring), Room(1, "Office", box(0.0, 2.0, 2.8, 4.0)))
    way = Door(0, "door", ((1.4, 1.8), (1.4, 2.0)), 0.8, box(1.0, 1.8, 1.8, 2.0), (0, 1))
    whole = shapely.union_all([*(room.polygon for room in rooms), way.polygon])
    holes = tuple(list(hole.coords)[:-1] for hole in whole.interiors)
    plan = FloorPlan("class", list(whole.exterior.coords)[:-1], 2, {}, holes, rooms=rooms, doors=(way,))
    found = corrected(plan, no_wall=[[0.0, 1.9], [4.5, 1.9]])
    assert found.effects[0].outcome == "done"
    assert shapely.intersection(found.plan.rooms[0].polygon, Polygon(box(0.0, 1.8, 4.4, 2.0))).area > 0.855


def test_where_a_wall_is_gone_what_nothing_led_into_belongs_to_the_room() -> None:
    from shapely import box

    lost = Space(box(7.3, 0.1, 9.3, 3.1), reachable=False)
    found = correct_plan(PLAN, Override(no_wall=[[7.25, 0.1], [7.25, 3.1]]).corrections, [lost])
    assert areas(found.plan) == [12.0, 15.3]


def test_a_window_is_no_passage() -> None:
    entered = corrected(entrance=[[0.0, 1.0], [0.0, 1.9]]).plan
    found = corrected(entered, window=[0.05, 1.4])
    assert kinds(found.plan) == ["door"]
    assert found.plan.rooms == entered.rooms
    assert found.effects[0].said == "the entrance of 0.90 m there is a window"


def test_what_lies_outside_is_open_to_the_rooms_that_meet_it() -> None:
    rooms = (Room(0, "Kitchen", box(0.1, 0.1, 4.1, 3.1)), Room(1, "Unlabelled", box(4.1, 1.0, 6.1, 2.5)))
    ring = [(0.1, 0.1), (4.1, 0.1), (4.1, 1.0), (6.1, 1.0), (6.1, 2.5), (4.1, 2.5), (4.1, 3.1), (0.1, 3.1)]
    plan = FloorPlan("porch", ring, 2, {}, rooms=rooms)
    found = corrected(plan, outside=[5.0, 2.0])
    (way,) = found.plan.doors
    assert (way.kind, way.width, way.rooms, way.confidence) == ("entrance", 1.5, (0, None), 1.0)
    assert way.polygon.bounds == pytest.approx((4.1, 1.0, 4.3, 2.5))
    assert not corrected(plan, no_room=[5.0, 2.0]).plan.doors
    assert found.plan.area == pytest.approx(12.0)


def test_a_room_is_drawn_by_its_corners_and_a_door_leads_into_it() -> None:
    corners = [[7.0, 0.1], [9.3, 0.1], [9.3, 3.1], [7.3, 3.1]]  # one lies in the bedroom
    found = corrected(room_outline=corners, door=[[7.25, 2.0], [7.25, 2.8]])
    assert [effect.outcome for effect in found.effects] == ["done", "done"]
    assert len(found.plan.rooms) == 3
    assert found.plan.room_num == 3
    assert not found.followed
    alone = corrected(room_outline=corners)
    assert "nothing else led into" in alone.followed[0]
    assert corrected(alone.plan, room_outline=corners).effects[0].outcome == "already"


@pytest.mark.parametrize(
    ("corners", "why"),
    [
        ([[0, 0], [2, 2], [2, 0], [0, 2]], "expected sides that do not cross, found Self-intersection"),
        ([[0, 0], [0.5, 0], [0.5, 0.5]], "expected 0.2 m2 or more, found 0.12 m2"),
        ([[0, 0], [2, 0]], r"expected \[\[x, y\], \[x, y\], \[x, y\], ...\]"),
    ],
)
def test_corners_that_enclose_no_room_are_refused(corners: list[list[float]], why: str) -> None:
    with pytest.raises(ConfigError, match=f"room_outline: {why}"):
        Override(room_outline=corners)  # type: ignore[arg-type]


def test_a_region_that_is_no_room_goes_alone_and_its_door_leads_outside() -> None:
    found = corrected(no_room=[5.0, 1.0])
    assert areas(found.plan) == [12.0]
    assert kinds(found.plan) == ["entrance"]
    assert found.plan.doors[0].is_unsure
    said = corrected(no_room=[5.0, 1.0], door=[[4.15, 1.1], [4.15, 1.9]]).plan.doors
    assert not said[0].is_unsure
    assert not corrected(outside=[5.0, 1.0]).plan.doors[0].is_unsure
    assert found.plan.room_num == 1
    assert list(found.plan.room_category) == ["Kitchen"]
    assert corrected(found.plan, no_room=[1.0, 1.0]).effects[0].said.startswith("it is the only room")


def test_a_wall_that_cuts_off_the_floor_before_a_way_names_it() -> None:
    niche = [(0.1, 0.1), (0.1, 3.1), (3.6, 3.1), (3.6, 2.0), (4.1, 2.0), (4.1, 1.0), (3.6, 1.0), (3.6, 0.1)]
    plan = replace(PLAN, rooms=(Room(0, "Kitchen", niche), PLAN.rooms[1]))
    (effect,) = corrected(plan, wall=[[3.6, 0.9], [3.6, 2.1]]).effects
    assert any("the door of 0.80 m there has no room at one side now" in each for each in effect.also)
    assert not any("no room at one side" in each for each in corrected(wall=[[2.0, 0.1], [2.0, 3.1]]).effects[0].also)


def test_a_room_without_its_door_is_closed_and_no_cut_is_made_in_its_place() -> None:
    found = corrected(no_door=[4.15, 1.5])
    assert kinds(found.plan) == []
    assert found.plan.rooms == PLAN.rooms
    assert found.followed == ("nothing leads into the bedroom of 9.0 m2 now; if there is a way inside, draw the door",)
    assert found.plan.area == pytest.approx(21.0, abs=0.01)
    again = corrected(found.plan, label=[1.0, 1.0, "Office"])  # what was said before holds
    assert (kinds(again.plan), again.followed) == ([], ())


def with_cut() -> FloorPlan:
    """The plan, where a wall that parts its kitchen leaves one part without a way."""
    found = corrected(wall=[[2.0, 0.1], [2.0, 3.1]])
    assert kinds(found.plan) == ["cut", "door"]
    assert "a cut of 0.80 m joins" in found.followed[0]
    return found.plan


def test_a_cut_that_a_person_denies_comes_back_at_no_other_wall() -> None:
    cut = with_cut()
    place = next(door for door in cut.doors if door.kind == "cut").polygon.centroid
    found = corrected(cut, no_door=[place.x, place.y])
    assert kinds(found.plan) == ["door"]
    assert len(found.plan.rooms) == 3
    assert found.plan.bbox == cut.bbox
    assert "nothing leads into" in found.followed[0]


@pytest.mark.parametrize("word", ["no_door", "window"])
def test_a_cut_that_follows_from_a_word_can_be_denied_with_it(word: str) -> None:
    place = next(door for door in with_cut().doors if door.kind == "cut").polygon.centroid
    found = corrected(wall=[[2.0, 0.1], [2.0, 3.1]], **{word: [place.x, place.y]})
    assert [effect.outcome for effect in found.effects] == ["done", "done"]
    assert "the cut of 0.80 m there is" in found.effects[1].said
    assert kinds(found.plan) == ["door"]
    assert len(found.followed) == 1
    assert "nothing leads into" in found.followed[0]
    elsewhere = corrected(wall=[[2.0, 0.1], [2.0, 3.1]], **{word: [1.0, 1.0]})
    assert [effect.outcome for effect in elsewhere.effects] == ["done", "none"]
    assert "a cut of 0.80 m joins" in elsewhere.followed[0]


def test_a_denied_cut_stays_denied_where_another_build_made_it_elsewhere_in_its_wall() -> None:
    kitchen, bedroom = PLAN.rooms
    office = Room(2, "Office", box(7.3, 0.1, 9.3, 3.1))
    ways = [Door(1, "cut", ((7.25, y), (7.25, y + 0.8)), 0.8, box(7.2, y, 7.3, y + 0.8), (1, 2)) for y in (0.3, 2.1)]
    for way in ways:
        ring = shapely.union_all([*(r.polygon for r in (kitchen, bedroom, office)), PLAN.doors[0].polygon, way.polygon])
        rooms, doors = (kitchen, bedroom, office), (PLAN.doors[0], way)
        plan = FloorPlan("row", list(ring.exterior.coords[:-1]), 3, {}, rooms=rooms, doors=doors)
        for y in (0.7, 1.6, 2.5):
            found = corrected(plan, no_door=[7.25, y])
            assert [effect.outcome for effect in found.effects] == ["done"], (way, y)
            assert kinds(found.plan) == ["door"]
        assert corrected(plan, no_door=[4.15, 2.8]).effects[0].outcome == "none"  # the wall of other rooms
        assert corrected(plan, no_door=[8.2, 2.8]).effects[0].outcome == "none"


def test_a_drawn_door_makes_a_cut_needless() -> None:
    cut = with_cut()
    y = next(door for door in cut.doors if door.kind == "cut").polygon.centroid.y
    far = 0.6 if y > 1.6 else 2.6
    found = corrected(cut, door=[[2.0, far - 0.35], [2.0, far + 0.35]])
    assert kinds(found.plan) == ["door", "door"]
    assert "is not needed any more" in found.followed[0]


def test_an_entrance_of_its_own_makes_a_cut_needless() -> None:
    cut = with_cut()
    found = corrected(cut, entrance=[[0.0, 1.0], [0.0, 1.9]])
    assert kinds(found.plan) == ["door", "entrance"]
    assert "is not needed any more" in found.followed[0]
    assert "only from outside does a way lead into the room of 5.5 m2" in found.followed[1]
    assert len(found.plan.rooms) == 3
    other = corrected(cut, entrance=[[7.25, 1.0], [7.25, 1.9]])  # of the larger part: nobody says the smaller one's
    assert kinds(other.plan) == ["cut", "door", "entrance"]


def test_a_wall_between_parts_with_ways_of_their_own_is_not_cut() -> None:
    plan = corrected(entrance=[[[0.0, 1.0], [0.0, 1.9]], [[7.25, 1.0], [7.25, 1.9]]]).plan
    found = corrected(plan, wall=[[2.0, 0.1], [2.0, 3.1]])
    assert kinds(found.plan) == ["door", "entrance", "entrance"]
    assert len(found.plan.rooms) == 3
    assert "only from outside" in found.followed[0]


@pytest.mark.parametrize("turn", [0.0, 10.0, 30.0, 45.0, 60.0, 80.0])
def test_parts_that_only_the_outside_joins_keep_one_outline(turn: float) -> None:
    from shapely import affinity, transform, union_all

    shapes = [Polygon(box(0.0, 0.0, 4.0, 3.0)), Polygon(box(4.2, 0.0, 7.0, 3.0)), Polygon(box(3.9, 0.0, 4.3, 1.0))]
    turned = (affinity.rotate(shape, turn, origin=(0, 0)) for shape in shapes)
    one, other, gap = (transform(shape, lambda points: points.round(2)) for shape in turned)
    gap = gap.difference(union_all([one, other]).buffer(1e-9))
    ring = list(union_all([one, other, gap.buffer(0.01)]).exterior.coords[:-1])
    rooms = tuple(Room(k, "Unlabelled", list(shape.exterior.coords[:-1])) for k, shape in enumerate((one, other)))
    sides = gap.exterior.coords[:-1]
    cut = Door(0, "cut", (sides[0], sides[1]), 0.2, list(sides), (0, 1))
    plan = FloorPlan("turned", ring, 2, {}, rooms=rooms, doors=(cut,))
    found = corrected(plan, no_door=list(gap.centroid.coords[0]))
    assert not found.plan.doors
    assert len(found.plan.rooms) == 2
    assert Polygon(found.plan.verts).is_valid
    assert found.plan.area == pytest.approx(one.area + other.area, abs=0.03)
    parts = [room.polygon for room in found.plan.rooms]
    assert found.plan.free_space.symmetric_difference(union_all(parts)).area < TILE_M2


def test_a_wall_parts_a_room_and_a_door_in_it_joins_the_parts() -> None:
    found = corrected(wall=[[2.0, 0.2], [2.0, 3.0]], door=[[2.0, 1.0], [2.0, 1.8]])
    assert areas(found.plan) == [5.55, 6.15, 9.0]
    assert kinds(found.plan) == ["door", "door"]
    assert not found.followed


def test_a_wall_that_ends_where_two_rooms_meet_changes_one_of_them() -> None:
    one, other = Room(0, "Kitchen", box(0.1, 0.1, 4.1, 5.1)), Room(1, "Hall", box(4.1, 0.1, 8.1, 5.1))
    plan = FloorPlan("house", box(0.1, 0.1, 8.1, 5.1), 2, {}, rooms=(one, other))
    for end in (4.1, 4.13):
        found = corrected(plan, wall=[[0.1, 2.0], [end, 2.0]])
        assert areas(found.plan) == pytest.approx([4.0 * 1.85, 4.0 * 3.05, 20.0])
        assert shapely.symmetric_difference(found.plan.rooms[-1].polygon, other.polygon).area < 0.001


def test_a_wall_with_a_free_end_stands_in_its_room() -> None:
    found = corrected(wall=[[2.0, 0.1], [2.0, 2.0]])
    assert areas(found.plan) == [9.0, 11.81]
    assert corrected(found.plan, wall=[[2.0, 0.1], [2.0, 2.0]]).effects[0].outcome == "already"


def test_a_wall_a_hand_s_breadth_inside_an_edge_is_that_edge() -> None:
    found = corrected(wall=[[0.3, 0.2], [0.3, 3.0]])
    assert areas(found.plan) == pytest.approx([9.0, (4.1 - 0.35) * 3.0])
    assert "the floor behind it, less than 0.25 m deep, is wall" in found.effects[0].also
    assert areas(corrected(wall=[[0.5, 0.2], [0.5, 3.0]]).plan)[0] == pytest.approx(1.05)


@pytest.mark.parametrize("depth", [0.3, 0.45])
def test_a_wall_along_a_narrow_room_takes_none_of_it(depth: float) -> None:
    rooms = (Room(0, "Kitchen", box(0.0, 0.0, 4.0, 3.0)), Room(1, "Storage", box(4.1, 0.0, 4.1 + depth, 3.0)))
    way = Door(0, "door", ((4.05, 1.0), (4.05, 1.8)), 0.8, box(4.0, 1.0, 4.1, 1.8), (0, 1))
    ring = shapely.union_all([*(room.polygon for room in rooms), way.polygon]).exterior.coords[:-1]
    plan = FloorPlan("closet", list(ring), 2, {}, rooms=rooms, doors=(way,))
    found = corrected(plan, wall=[[4.1 + depth / 2, 0.0], [4.1 + depth / 2, 3.0]])
    assert found.effects[0].outcome == "none"
    assert f"it would take all of the storage of {3 * depth:.1f} m2" in found.effects[0].said
    assert encode(found.plan) == encode(plan)


def test_rooms_become_one_with_the_door_between_them() -> None:
    found = corrected(one_room=[[1.0, 1.0], [5.0, 1.0]])
    assert areas(found.plan) == [21.08]
    assert not found.plan.doors
    assert found.plan.rooms[0].label == "Kitchen"
    shut = corrected(no_door=[4.15, 1.5], one_room=[[1.0, 1.0], [5.0, 1.0]])
    assert [effect.outcome for effect in shut.effects] == ["done", "none"]  # its door is part of the room


@pytest.mark.parametrize("wall_m", [0.05, 0.1, 0.3])
@pytest.mark.parametrize("degrees", [30.0, 45.0, 75.0])
def test_rooms_on_both_sides_of_a_slanting_wall_become_one(wall_m: float, degrees: float) -> None:
    house, way = shapely.box(0.0, 0.0, 8.0, 6.0), np.array([np.cos(np.radians(degrees)), np.sin(np.radians(degrees))])
    wall = LineString([[4.0, 3.0] - 9 * way, [4.0, 3.0] + 9 * way]).buffer(wall_m / 2)
    parts = shapely.get_parts(shapely.set_precision(shapely.difference(house, wall), 0.01))
    rooms = tuple(Room(k, "Office", list(part.exterior.coords)[:-1]) for k, part in enumerate(parts))
    plan = FloorPlan("house", list(house.exterior.coords)[:-1], 2, {}, rooms=rooms)
    found = corrected(plan, one_room=[[0.5, 5.5], [7.5, 0.5]])
    assert areas(found.plan) == [48.0]


def test_without_an_outer_wall_the_room_is_open_to_the_outside() -> None:
    found = corrected(no_wall=[[0.05, 0.5], [0.05, 2.5]])
    assert [(door.kind, door.width, door.rooms) for door in found.plan.doors][1:] == [("entrance", 2.0, (0, None))]
    assert areas(found.plan) == areas(PLAN)
    line = LineString([(0.1, 0.5), (0.1, 2.5)])  # of a drawing: that it is no wall says nothing of what lies beyond it
    drawn = correct_plan(PLAN, Override(no_wall=[[0.1, 0.5], [0.1, 2.5]]).corrections, lines=[line])
    assert "only the kitchen of 12.0 m2 lies beside it" in drawn.effects[0].said


def test_a_label_is_one_of_the_data_sets() -> None:
    found = corrected(label=[1.0, 1.0, "living room"])
    assert [room.label for room in found.plan.rooms] == ["Living_Room", "Bedroom"]
    assert sorted(found.plan.room_category) == ["Bedroom", "Living_Room"]
    with pytest.raises(ConfigError, match=r"label: expected one of .*Kitchen.*; found 'Palace'"):
        Override(label=[1.0, 1.0, "Palace"])


def test_a_label_takes_the_place_of_the_sources_words() -> None:
    rooms = tuple(replace(room, source_labels=("Saal",)) for room in PLAN.rooms)
    named = replace(PLAN, rooms=rooms, provenance={"source": "mesh"})
    found = correct_plan(named, Override(label=[1.0, 1.0, "Office"]).corrections)
    assert [room.source_labels for room in found.plan.rooms] == [(), ("Saal",)]
    assert (found.plan.provenance or {})["source"] == "mesh"


def test_a_space_between_walls_becomes_a_room() -> None:
    from shapely import box

    space = Space(box(7.3, 0.1, 9.3, 3.1))
    found = correct_plan(PLAN, Override(room=[8.0, 1.0], door=[[7.25, 1.0], [7.25, 1.9]]).corrections, [space])
    assert areas(found.plan) == [6.0, 9.0, 12.0]
    assert kinds(found.plan) == ["door", "door"]
    lost = Space(box(7.3, 0.1, 9.3, 3.1), reachable=False)
    back = correct_plan(PLAN, Override(door=[[7.25, 1.0], [7.25, 1.9]]).corrections, [lost])
    assert areas(back.plan) == [6.0, 9.0, 12.0]
    assert "which nothing led into, is a room now" in back.effects[0].sentence


def test_a_wall_round_which_a_corridor_runs_lies_in_no_room() -> None:
    ring = [(0.1, 0.1), (0.1, 8.1), (8.1, 8.1), (8.1, 0.1)]
    hole, inside = box(2.0, 2.0, 6.0, 6.0), box(2.1, 2.1, 5.9, 5.9)
    rooms = (Room(0, "Hallway", ring, (hole,)), Room(1, "Office", inside))
    shaft = Door(0, "door", ((2.05, 5.0), (2.05, 5.6)), 0.6, box(2.0, 5.0, 2.1, 5.6), (0, 1))
    plan = FloorPlan("ring", ring, 2, {}, (hole,), rooms=rooms, doors=(shaft,))
    found = corrected(plan, door=[[2.05, 3.0], [2.05, 3.9]])
    assert "joins the hallway" in found.effects[0].said or "joins the office" in found.effects[0].said
    assert kinds(found.plan) == ["door", "door"]


def test_furniture_goes_with_its_room() -> None:
    plan = furnished("a")
    assert not corrected(plan, no_room=[4.5, 0.5]).plan.objects
    kept = corrected(plan, no_room=[1.0, 1.0]).plan
    assert [thing.room for thing in kept.objects] == [0]


def test_a_plan_that_starts_elsewhere_stays_in_its_place() -> None:
    framed = corrected(no_room=[1.0, 1.0]).plan
    assert framed.bbox[:2] == PLAN.bbox[:2]


def test_each_word_has_a_form_a_python_name_and_an_effect() -> None:
    given = {1: (1.0, 1.0), 2: ((1.0, 1.0), (1.0, 2.0))}
    for word, form in WORDS.items():
        value: Any = (1.0, 1.0, "Office") if word == "label" else given[form.depth]
        value = ((1.0, 1.0), (3.0, 1.0), (3.0, 3.0)) if word == "room_outline" else value
        assert Override(**{word: value}).corrections == (Correction(word, value),)
        assert Override(**{word: [value]}) == Override(**{word: value})
        (effect,) = correct_plan(PLAN, Override(**{word: value}).corrections).effects
        assert effect.said


def test_numbers_that_the_pipeline_has_too_are_equal() -> None:
    assert DoorsConfig().widest_m == WIDEST_DOOR_M
    assert ConnectivityConfig().cut_width_m == CUT_M
    assert tuple(scale.UNITS) == UNITS


def hall(*islands: tuple[float, float, float, float]) -> FloorPlan:
    """A hall of 10 x 8 m around pillars."""
    holes = [box(*each) for each in islands]
    room = Room(0, "Unlabelled", box(0.1, 0.1, 10.1, 8.1), tuple(holes))
    return FloorPlan("hall", box(0.1, 0.1, 10.1, 8.1), 1, {}, rooms=(room,), holes=tuple(holes))


def test_openings_of_which_none_parts_a_room_alone_part_it_together() -> None:
    plan = hall((4.0, 3.0, 6.0, 5.0))
    north, south = [[5.0, 5.0], [5.0, 8.1]], [[5.0, 0.1], [5.0, 3.0]]
    alone = corrected(plan, opening=north)
    assert (alone.effects[0].outcome, alone.effects[0].waits) == ("none", True)
    assert "waits for other lines" in alone.effects[0].sentence
    assert areas(alone.plan) == areas(plan)
    both = corrected(plan, opening=[north, south])
    assert [effect.outcome for effect in both.effects] == ["done", "done"]
    assert len(both.plan.rooms) == 2
    assert kinds(both.plan) == ["opening", "opening"]
    free = [[1.2, 4.0], [2.8, 4.0]]  # between no walls: it waits, and the others are none the worse
    three = corrected(plan, opening=[north, free, south])
    assert [(effect.outcome, effect.waits) for effect in three.effects] == [
        ("done", False),
        ("none", True),
        ("done", False),
    ]
    assert len(three.plan.rooms) == 2


def test_an_opening_from_a_corner_along_its_edge_meets_the_corner() -> None:
    ring = [(0.1, 0.1), (6.1, 0.1), (6.1, 3.1), (4.1, 3.1), (4.1, 5.1), (0.1, 5.1)]
    plan = FloorPlan("house", ring, 1, {}, rooms=(Room(0, "Unlabelled", ring),))
    for off in (-0.004, 0.0, 0.004):
        found = corrected(plan, opening=[[4.1, 3.1 + off], [0.1, 3.1 + off]])
        assert [effect.outcome for effect in found.effects] == ["done"]
        assert len(found.plan.rooms) == 2


def test_walls_that_meet_pillars_by_a_hair_part_the_room_and_no_part_is_lost() -> None:
    plan = hall((4.0, 3.0, 6.0, 5.0))
    for hair in (0.0, 0.001, 0.004, 0.02, 0.1):
        found = corrected(plan, wall=[[[5.0, 5.0 + hair], [5.2, 8.1]], [[5.0, 0.1], [5.0, 3.0 - hair]]])
        assert len(found.plan.rooms) == 2
        assert sum(areas(found.plan)) == pytest.approx(plan.area, abs=1.0)
        assert any("a cut of" in line for line in found.followed)


def test_a_passage_on_the_edge_at_which_two_rooms_meet() -> None:
    one, other = Room(0, "Kitchen", box(0.1, 0.1, 4.1, 5.1)), Room(1, "Hall", box(4.1, 0.1, 8.1, 5.1))
    plan = FloorPlan("house", box(0.1, 0.1, 8.1, 5.1), 2, {}, rooms=(one, other))
    for x in (3.88, 4.09, 4.1, 4.11, 4.3):  # within a hand's breadth
        found = corrected(plan, opening=[[x, 1.0], [x, 3.6]])
        assert [effect.outcome for effect in found.effects] == ["done"]
        assert "which meet there" in found.effects[0].sentence
        assert kinds(found.plan) == ["opening"]
        assert len(found.plan.rooms) == 2
        assert found.plan.area == pytest.approx(plan.area, abs=0.01)


@pytest.mark.parametrize("y", [5.1, 5.3])
def test_an_opening_along_the_ends_of_walls_is_one_for_each_room_between_them(y: float) -> None:
    ring = [(0.1, 0.1), (0.1, 8.1), (4.1, 8.1), (4.1, 5.1), (4.2, 5.1), (4.2, 8.1), (8.1, 8.1), (8.1, 5.1)]
    ring += [(8.2, 5.1), (8.2, 8.1), (12.1, 8.1), (12.1, 0.1)]
    plan = FloorPlan("shops", ring, 1, {}, rooms=(Room(0, "Room", ring),))
    found = corrected(plan, opening=[[0.1, y], [12.1, y]])
    assert len(found.plan.rooms) == 4
    assert kinds(found.plan) == ["opening"] * 3
    assert [door.width for door in found.plan.doors] == pytest.approx([4.0, 3.9, 3.9], abs=0.2)
    hall = max(found.plan.rooms, key=lambda room: room.area)
    assert {frozenset(door.rooms) for door in found.plan.doors} == {
        frozenset((hall.id, room.id)) for room in found.plan.rooms if room is not hall
    }


def test_an_opening_over_a_post_parts_the_room() -> None:
    plan = hall((4.9, 3.9, 5.1, 4.1))
    found = corrected(plan, opening=[[5.0, 0.1], [5.0, 8.1]])
    assert [effect.outcome for effect in found.effects] == ["done"]
    assert len(found.plan.rooms) == 2


def test_an_outline_counts_as_near_as_its_nearest_part() -> None:
    found = corrected(room_outline=[[25.0, 0.2], [25.0, 3.0], [7.3, 3.0], [7.3, 0.2]])
    assert [effect.outcome for effect in found.effects] == ["done"]


def test_what_is_no_room_with_rooms_all_around_takes_its_doors_with_it() -> None:
    around = Polygon(box(0.1, 0.1, 8.1, 8.1), [box(2.9, 2.9, 5.1, 5.1)])
    rooms = (
        Room(0, "Hall", list(around.exterior.coords[:-1]), (list(around.interiors[0].coords[:-1]),)),
        Room(1, "Storage", box(3.0, 3.0, 5.0, 5.0)),
    )
    door = Door(0, "door", ((2.95, 3.5), (2.95, 4.3)), 0.8, box(2.9, 3.5, 3.0, 4.3), (0, 1), 1.0)
    plan = FloorPlan("house", box(0.1, 0.1, 8.1, 8.1), 2, {}, rooms=rooms, doors=(door,))
    assert kinds(corrected(plan, no_room=[4.0, 4.0]).plan) == []
    assert kinds(corrected(plan, outside=[4.0, 4.0]).plan) == ["entrance"]


TIPS = ([(1.01, 5.68), (1.01, 0.1), (0.1, 0.29)], [(1.02, 5.72), (0.35, 5.94), (0.74, 8.03), (3.3, 7.52), (2.9, 5.42)])


@pytest.mark.parametrize("shift", [0.0, 0.01, 0.03, 0.07, 0.2, 1.5])
def test_parts_whose_acute_tips_are_nearest_keep_one_outline(shift: float) -> None:
    shapes = [Polygon(TIPS[0]), translate(Polygon(TIPS[1]), shift, shift)]
    whole = shapely.union_all(shapes)
    joined = _in_one(whole)
    assert joined.is_valid
    assert joined.area == pytest.approx(whole.area, abs=0.1)
    assert all(shapely.intersection(joined, shape).area > 0.98 * shape.area for shape in shapes)


THREE = [
    [
        [(7.87, 9.56), (9.7, 11.87), (12.78, 9.44), (10.95, 7.12)],
        [(5.43, 4.24), (2.43, 6.2), (4.17, 8.86), (7.17, 6.9)],
        [(4.85, 11.77), (6.08, 12.11), (6.99, 8.86), (5.75, 8.52)],
    ],
    [
        [(8.33, 5.32), (11.79, 6.49), (12.72, 3.74), (9.26, 2.57)],
        [(8.49, 7.85), (9.57, 11.02), (11.44, 10.38), (10.35, 7.21)],
        [(3.53, 1.36), (2.05, 1.57), (2.5, 4.81), (3.98, 4.61)],
    ],
]


@pytest.mark.parametrize("rings", THREE)
def test_three_slanted_parts_keep_one_outline(rings: list[list[tuple[float, float]]]) -> None:
    whole = shapely.union_all([Polygon(ring) for ring in rings])
    joined = _in_one(whole)
    assert joined.is_valid
    assert whole.difference(joined).area < 0.05
    assert joined.area == pytest.approx(whole.area, abs=0.1)


@pytest.mark.parametrize("word", ["door", "opening"])
def test_a_passage_acts_from_its_first_to_its_last_point(word: str) -> None:
    free = corrected(**{word: [[1.0, 1.5], [2.6, 1.5]]})  # 1.5 m of floor are left beyond its end
    assert (free.effects[0].outcome, free.effects[0].waits) == ("none", True)
    assert encode(free.plan) == encode(PLAN)
    plan = hall((4.9, 3.9, 5.1, 4.1))
    beside_a_post = [[5.0, 0.1], [5.0, 3.9]]
    assert corrected(plan, **{word: beside_a_post}).effects[0].waits
    both = corrected(plan, **{word: [beside_a_post, [[5.0, 4.1], [5.0, 8.1]]]})
    assert [effect.outcome for effect in both.effects] == ["done", "done"]
    assert len(both.plan.rooms) == 2


def test_a_passage_that_ends_at_a_party_wall_leaves_the_room_behind_it() -> None:
    """Two wards and a hall north of them are one space; the line lies between the west ward and the hall."""
    ring = box(0.0, 0.0, 10.0, 6.0)
    party = (box(4.9, 1.0, 5.1, 3.1),)
    plan = FloorPlan("wards", ring, 1, {}, party, rooms=(Room(0, "Room", ring, party),))
    found = corrected(plan, opening=[[0.0, 3.0], [5.0, 3.0]])
    assert found.effects[0].waits
    assert encode(found.plan) == encode(plan)
    closed = corrected(plan, opening=[[0.0, 3.0], [5.0, 3.0]], wall=[[5.0, 0.0], [5.0, 1.0]])
    assert [effect.outcome for effect in closed.effects] == ["done", "done"]
    assert areas(closed.plan) == pytest.approx([14.6, 44.4], abs=0.6)


@pytest.mark.parametrize("beside", [-0.2, -0.05, 0.0, 0.05, 0.2])
def test_a_passage_that_is_drawn_a_hand_s_breadth_beside_walls_ends_lies_between_them(beside: float) -> None:
    bays = [(0.0, 0.0), (9.0, 0.0), (9.0, 6.0), (6.1, 6.0), (6.1, 3.0), (6.0, 3.0), (6.0, 6.0)]
    bays += [(3.1, 6.0), (3.1, 3.0), (3.0, 3.0), (3.0, 6.0), (0.0, 6.0)]
    plan = FloorPlan("bays", bays, 1, {}, rooms=(Room(0, "Room", bays),))
    found = corrected(plan, opening=[[3.05, 3.0 + beside], [6.05, 3.0 + beside]])
    assert [effect.outcome for effect in found.effects] == ["done"]
    assert areas(found.plan)[0] == pytest.approx(2.9 * 3.0, abs=0.9)


@pytest.mark.parametrize("beyond", [0.1, 0.4, 0.9])
def test_a_passage_drawn_past_the_walls_ends_at_them(beyond: float) -> None:
    found = corrected(opening=[[2.0, 0.1 - beyond], [2.0, 3.1 + beyond]])
    assert [effect.outcome for effect in found.effects] == ["done"]
    assert areas(found.plan) == [5.55, 6.15, 9.0]
    (way,) = [door for door in found.plan.doors if door.kind == "opening"]
    assert way.width == pytest.approx(3.0, abs=0.02)


def test_a_closet_that_a_person_says_is_a_room() -> None:
    niche = [(0.1, 0.1), (4.1, 0.1), (4.1, 3.1), (0.9, 3.1), (0.9, 3.7), (0.1, 3.7)]
    plan = FloorPlan("house", niche, 1, {}, rooms=(Room(0, "Kitchen", niche),))
    found = corrected(plan, door=[[0.1, 3.1], [0.9, 3.1]])
    assert areas(found.plan)[0] == pytest.approx(0.44, abs=0.05)
    assert kinds(found.plan) == ["door"]
    shut = corrected(plan, wall=[[0.1, 3.1], [0.9, 3.1]])
    assert len(shut.plan.rooms) == 1  # nobody says that what is behind it is a room
    both = corrected(plan, wall=[[0.1, 3.1], [0.9, 3.1]], door=[[0.2, 3.1], [0.8, 3.1]])
    assert len(both.plan.rooms) == 2
    drawn = corrected(room_outline=[[7.3, 0.1], [7.8, 0.1], [7.8, 0.9], [7.3, 0.9]])
    assert areas(drawn.plan)[0] == pytest.approx(0.4, abs=0.1)


def test_rooms_are_joined_before_an_opening_parts_them_whatever_the_order() -> None:
    found = corrected(one_room=[[1.0, 1.0], [5.0, 1.0]], opening=[[2.0, 0.1], [2.0, 3.1]])
    assert [effect.outcome for effect in found.effects] == ["done", "done"]
    assert areas(found.plan) == pytest.approx([5.55, 15.23], abs=0.02)
    across = corrected(one_room=[[1.0, 1.0], [5.0, 1.0]], opening=[[4.15, 1.1], [4.15, 1.9]])
    assert [effect.outcome for effect in across.effects] == ["done", "none"]
    assert "one_room [[1.0, 1.0], [5.0, 1.0]] joins them, and is said too" in across.effects[1].said
    assert areas(across.plan) == [21.08]


def test_a_room_that_a_line_has_parted_is_joined_in_part() -> None:
    """An opening parts the kitchen, whose two parts both have a door to the hall; one part and the hall are one."""
    shapes = box(0.0, 0.0, 4.0, 3.0), box(4.1, 0.0, 7.0, 3.0)
    rooms = tuple(
        Room(k, label, shape) for k, (label, shape) in enumerate(zip(("Kitchen", "Hall"), shapes, strict=True))
    )
    ways = tuple(
        Door(k, "door", ((4.05, y), (4.05, y + 0.8)), 0.8, box(4.0, y, 4.1, y + 0.8), (0, 1))
        for k, y in enumerate((0.3, 2.0))
    )
    whole = shapely.union_all([*(room.polygon for room in rooms), *(door.polygon for door in ways)])
    plan = FloorPlan(
        "two", list(whole.exterior.coords[:-1]), 2, {}, (list(whole.interiors[0].coords[:-1]),), rooms, ways
    )
    line: dict[str, Any] = {"opening": [[0.0, 1.5], [4.0, 1.5]]}
    found = corrected(plan, **line, one_room=[[2.0, 0.5], [6.0, 1.0]])
    assert [effect.outcome for effect in found.effects] == ["done", "done"]
    assert areas(found.plan) == pytest.approx([5.8, 14.58], abs=0.05)
    assert sorted(door.kind for door in found.plan.doors) == ["door", "opening"]
    whole_kitchen = corrected(plan, **line, one_room=[[2.0, 0.5], [6.0, 1.0], [2.0, 2.5]])
    assert [effect.outcome for effect in whole_kitchen.effects] == ["done", "none"]


def test_a_word_acts_in_what_a_later_one_makes() -> None:
    from shapely import box as area

    lost = Space(area(7.3, 0.1, 9.3, 3.1), reachable=False)
    words = Override(one_room=[[5.0, 1.0], [8.0, 1.0]], door=[[7.25, 1.0], [7.25, 1.9]]).corrections
    found = correct_plan(PLAN, words, [lost])
    assert found.effects[1].outcome == "done"
    assert "door [[7.25, 1.0], [7.25, 1.9]] parts them" in found.effects[0].said


@pytest.mark.parametrize("y", [2.97, 2.98, 3.0, 3.02])
@pytest.mark.parametrize("joining", [{"no_wall": [[4.05, 0.2], [4.05, 2.8]]}, {"one_room": [[1.0, 1.0], [5.0, 1.0]]}])
def test_a_passage_to_a_third_room_parts_no_merged_rooms(y: float, joining: dict[str, Any]) -> None:
    shapes = (box(0.0, 0.0, 4.0, 3.0), box(4.1, 0.0, 7.0, 3.0), box(0.0, 3.0, 7.0, 6.0))
    rooms = tuple(Room(k, "Office", shape) for k, shape in enumerate(shapes))
    way = Door(0, "door", ((4.05, 1.0), (4.05, 1.8)), 0.8, box(4.0, 1.0, 4.1, 1.8), (0, 1))
    whole = shapely.union_all([*(room.polygon for room in rooms), way.polygon])
    holes = tuple(list(ring.coords[:-1]) for ring in whole.interiors)
    plan = FloorPlan("three", list(whole.exterior.coords[:-1]), 3, {}, holes, rooms=rooms, doors=(way,))
    found = corrected(plan, door=[[1.0, y], [1.9, y]], **joining)
    assert [effect.outcome for effect in found.effects] == ["done", "done"]
    back = corrected(plan, door=[[4.05, 1.0], [4.05, 1.8]], **joining)
    assert [effect.outcome for effect in back.effects] == ["done", "none"]


def over_pillars() -> FloorPlan:
    """Two rooms whose wall has a pillar in its middle, and a hall north of both round a pillar of its own."""
    west = [(0.0, 0.0), (0.0, 3.0), (4.0, 3.0), (4.0, 1.8), (3.9, 1.8), (3.9, 1.2), (4.0, 1.2), (4.0, 0.0)]
    east = [(4.1, 0.0), (4.1, 1.2), (4.2, 1.2), (4.2, 1.8), (4.1, 1.8), (4.1, 3.0), (8.0, 3.0), (8.0, 0.0)]
    pillar = box(3.9, 4.2, 4.2, 4.8)
    rooms = (Room(0, "Kitchen", west), Room(1, "Office", east), Room(2, "Hall", box(0.0, 3.1, 8.0, 6.0), (pillar,)))
    ways = ((1.0, 0), (6.0, 1))
    doors = tuple(
        Door(k, "door", ((x, 3.05), (x + 0.8, 3.05)), 0.8, box(x, 3.0, x + 0.8, 3.1), (room, 2))
        for k, (x, room) in enumerate(ways)
    )
    whole = shapely.union_all([*(room.polygon for room in rooms), *(door.polygon for door in doors)])
    holes = tuple(list(ring.coords[:-1]) for ring in whole.interiors)
    return FloorPlan("pillars", list(whole.exterior.coords[:-1]), 3, {}, holes, rooms=rooms, doors=doors)


def test_lines_that_part_merged_rooms_are_refused_and_other_lines_are_not() -> None:
    seam, hall = (
        [[[4.05, 0.0], [4.05, 1.2]], [[4.05, 1.8], [4.05, 3.0]]],
        [
            [[4.05, 3.1], [4.05, 4.2]],
            [[4.05, 4.8], [4.05, 6.0]],
        ],
    )
    for lines in ([*seam, *hall], [*hall, *seam], [seam[0], hall[0], seam[1], hall[1]]):
        found = corrected(over_pillars(), one_room=[[1.0, 1.0], [6.0, 1.0]], opening=lines)
        for effect in found.effects[1:]:
            if list(map(list, effect.correction.value)) in hall:
                assert effect.outcome == "done"
            else:
                assert (effect.outcome, effect.waits) == ("none", False)
                assert "one_room [[1.0, 1.0], [6.0, 1.0]] joins them, and is said too" in effect.said
        assert len(found.plan.rooms) == 3


def behind_a_door(*pillars: tuple[float, float, float, float]) -> Space:
    """A space of 6 x 6 m east of the bedroom of ``PLAN`` that nothing leads into, with pillars in it."""
    return Space(Polygon(box(7.3, 0.1, 13.3, 6.1), [box(*each) for each in pillars]), reachable=False)


@pytest.mark.parametrize("later", [False, True])
def test_lines_in_a_space_wait_for_the_door_into_it_whatever_the_order(later: bool) -> None:
    way = [[7.25, 1.0], [7.25, 1.9]]
    free = [[[10.3, 0.1], [10.3, 6.1]]]
    pair = [[[10.3, 0.1], [10.3, 2.5]], [[10.3, 3.5], [10.3, 6.1]]]
    for space, lines in ((behind_a_door(), free), (behind_a_door((10.2, 2.5, 10.4, 3.5)), pair)):
        words = Override(door=[*lines, way] if later else [way, *lines], label=[8.0, 1.0, "Office"]).corrections
        found = correct_plan(PLAN, words, [space])
        assert {effect.outcome for effect in found.effects} == {"done"}
        assert len(found.plan.rooms) == 4
        assert [room.area for room in found.plan.rooms if room.label == "Office"] == [pytest.approx(17.7, abs=0.6)]


def test_a_wall_in_a_space_waits_for_the_door_into_it() -> None:
    standing = [Polygon(box(7.2, 0.0, 13.4, 6.2), [box(7.3, 0.1, 13.3, 6.1)])]
    words = Override(wall=[[10.3, 0.1], [10.3, 6.1]], door=[[7.25, 1.0], [7.25, 1.9]]).corrections
    found = correct_plan(PLAN, words, [behind_a_door()], standing)
    assert [effect.outcome for effect in found.effects] == ["done", "done"]
    assert len(found.plan.rooms) == 4


def test_walls_away_from_the_rooms_close_a_space_with_what_stands() -> None:

    wall = LineString([(7.1, 0.0), (12.0, 0.0), (12.0, 5.0), (9.0, 5.0)])
    standing = [wall.buffer(0.1, cap_style="flat", join_style="mitre")]
    north, west = [[8.9, 5.0], [8.9, 3.9]], [[8.9, 3.3], [7.1, 3.3]]

    def with_walls(*walls: list[list[float]]) -> Corrected[FloorPlan]:
        return correct_plan(PLAN, Override(wall=list(walls)).corrections, (), standing)

    alone = with_walls(north)
    assert (alone.effects[0].outcome, alone.effects[0].waits) == ("none", True)
    assert "closes no space; it waits for other lines" in alone.effects[0].sentence
    assert encode(alone.plan) == encode(PLAN)
    gap = with_walls(north, west)
    assert [effect.outcome for effect in gap.effects] == ["none", "none"]  # 0.6 m are open
    assert all(effect.waits for effect in gap.effects)
    both = with_walls([[8.9, 5.0], [8.9, 3.4]], west)
    assert [effect.outcome for effect in both.effects] == ["done", "done"]
    assert "closes a space, the room of" in both.effects[0].sentence
    assert len(both.plan.rooms) == 3
    assert max(areas(both.plan)) == pytest.approx(4.7 * 3.2 + 2.9 * 1.6, abs=0.6)
    said = Override(wall=[[[8.9, 5.0], [8.9, 3.4]], west], room=[9.5, 1.0]).corrections
    assert [effect.outcome for effect in correct_plan(PLAN, said, (), standing).effects] == ["already", "done", "done"]


def test_a_wall_that_closes_two_spaces_names_both() -> None:
    comb = [box(7.1, -0.1, 12.1, 0.0), box(7.1, 1.5, 12.0, 1.6), box(7.1, 3.2, 12.1, 3.3), box(7.1, 0.0, 7.2, 3.2)]
    words = Override(wall=[[12.0, 0.0], [12.0, 3.2]]).corrections
    found = correct_plan(PLAN, words, (), [Polygon(each) for each in comb])
    assert len(found.plan.rooms) == 4
    assert "closes 2 spaces, the room of 7.6 m2 and the room of 7.1 m2 now" in found.effects[0].said


def test_rooms_that_are_one_keep_the_thicker_walls_between_them() -> None:
    bay = [(4.1, 0.0), (7.0, 0.0), (7.0, 3.0), (4.3, 3.0), (4.3, 1.5), (4.1, 1.5)]
    rooms = (Room(0, "Hall", box(0.0, 0.0, 4.0, 3.0)), Room(1, "Hall", bay))
    outline = [
        (0.0, 0.0),
        (7.0, 0.0),
        (7.0, 3.0),
        (4.3, 3.0),
        (4.3, 1.5),
        (4.1, 1.5),
        (4.1, 0.01),
        (4.0, 0.01),
        (4.0, 3.0),
        (0.0, 3.0),
    ]
    plan = FloorPlan("hall", outline, 2, {}, rooms=rooms)
    found = correct_plan(plan, Override(one_room=[[1.0, 1.0], [6.0, 1.0]]).corrections)
    assert found.plan.rooms[0].area == pytest.approx(12.0 + Polygon(bay).area + 0.1 * 1.5, abs=0.02)


@pytest.mark.parametrize("x", [3.9, 3.95, 4.0, 4.1])
def test_a_door_beside_a_leaf_that_stands_before_its_wall_opens_the_wall(x: float) -> None:
    leaf = box(3.92, 2.1, 3.96, 2.9)
    kitchen = replace(PLAN.rooms[0], holes=(leaf,))
    plan = replace(PLAN, rooms=(kitchen, PLAN.rooms[1]), holes=(leaf,))
    found = corrected(plan, door=[[x, 2.1], [x, 2.9]])
    assert "joins the bedroom of 9.0 m2 and the kitchen" in found.effects[0].said
    assert kinds(found.plan) == ["door", "door"]


def wrong() -> FloorPlan:
    """A plan with one room of 12 x 10 m, entered from the west."""
    ring = box(0.0, 0.0, 12.0, 10.0)
    way = Door(0, "entrance", ((-0.1, 4.0), (-0.1, 5.0)), 1.0, box(-0.2, 4.0, 0.0, 5.0), (0, None), 0.5)
    return FloorPlan("wrong", ring, 1, {}, rooms=(Room(0, "Office", ring, (), (), 0.4),), doors=(way,))


def has_outline(plan: FloorPlan, drawn: list[list[float]]) -> bool:
    """Return whether a plan has a room of exactly this outline; a plan without a frame may start elsewhere."""

    def ring(shape: Polygon) -> Polygon:
        return translate(shape, *-np.array(shape.bounds[:2]))

    return any(
        shapely.symmetric_difference(ring(room.polygon), ring(Polygon(drawn))).area < 1e-3 for room in plan.rooms
    )


def test_an_outline_within_a_larger_room_parts_it() -> None:
    drawn = [[3.0, 3.0], [9.0, 3.0], [9.0, 8.0], [3.0, 8.0]]
    found = corrected(wrong(), room_outline=drawn)
    assert found.effects[0].outcome == "done"
    assert areas(found.plan) == [30.0, pytest.approx(120.0 - 6.2 * 5.2)]
    assert "the rest of the office of 120.0 m2 is the office of 87.8 m2 now" in found.effects[0].sentence
    assert kinds(found.plan) == ["cut", "entrance"]
    alone = corrected(wrong(), room_outline=drawn, no_room=[1.0, 1.0])
    assert [effect.outcome for effect in alone.effects] == ["done", "done"]
    assert areas(alone.plan) == [30.0]
    two = corrected(wrong(), room_outline=[drawn, [[9.1, 3.0], [11.9, 3.0], [11.9, 8.0], [9.1, 8.0]]])
    assert [effect.outcome for effect in two.effects] == ["done", "done"]
    assert areas(two.plan)[:2] == [14.0, 30.0]
    again = corrected(wrong(), room_outline=[drawn, [[4.0, 4.0], [6.0, 4.0], [6.0, 6.0], [4.0, 6.0]]])
    assert [effect.outcome for effect in again.effects] == ["done", "done"]  # the later one is of what is shown
    assert areas(again.plan) == [4.0, pytest.approx(30.0 - 2.2 * 2.2), pytest.approx(120.0 - 6.2 * 5.2)]


@pytest.mark.parametrize("off", [-0.2, -0.05, 0.0, 0.05, 0.2])
def test_an_outline_drawn_beside_a_room_s_walls_is_kept_to_the_centimetre_and_keeps_their_doors(off: float) -> None:
    drawn = [[off, off], [6.0, off], [6.0, 10.0 - off], [off, 10.0 - off]]
    found = corrected(wrong(), room_outline=drawn)
    assert len(found.plan.rooms) == 2
    assert has_outline(found.plan, drawn)
    assert kinds(found.plan) == ["cut", "entrance"]
    entrance = next(door for door in found.plan.doors if door.kind == "entrance")
    assert found.plan.rooms[entrance.rooms[0] or 0].area == pytest.approx(Polygon(drawn).area)
    assert entrance.width == 1.0


def test_an_outline_replaces_that_of_the_room_that_is_there() -> None:
    same = corrected(wrong(), room_outline=[[0.0, 0.0], [12.004, 0.0], [12.0, 10.0], [0.0, 10.0]])
    assert same.effects[0].outcome == "already"
    assert areas(same.plan) == [120.0]
    less = corrected(wrong(), room_outline=[[0.0, 0.0], [10.5, 0.0], [10.5, 10.0], [0.0, 10.0]])
    assert less.effects[0].outcome == "done"
    assert areas(less.plan) == [pytest.approx(105.0)]
    assert "the office of 120.0 m2" in less.effects[0].sentence
    assert "14.0 m2 of it are in no room now" in less.effects[0].sentence
    assert kinds(less.plan) == ["entrance"]
    more = corrected(wrong(), room_outline=[[0.0, 0.0], [14.0, 0.0], [14.0, 10.0], [0.0, 10.0]])
    assert areas(more.plan) == [pytest.approx(140.0)]
    east = corrected(wrong(), room_outline=[[2.0, 0.0], [13.5, 0.0], [13.5, 10.0], [2.0, 10.0]])
    assert areas(east.plan) == [pytest.approx(115.0)]
    assert "the entrance of 1.00 m is gone" in east.effects[0].sentence
    first, second = [[0, 0], [10.5, 0], [10.5, 10], [0, 10]], [[0, 0], [9, 0], [9, 10], [0, 10]]
    again = corrected(wrong(), room_outline=[first, second])
    assert [effect.outcome for effect in again.effects] == ["done", "done"]
    assert areas(again.plan) == [pytest.approx(90.0)]
    assert more.plan.rooms[0].label == "Office"


def test_an_outline_is_of_the_rooms_that_earlier_words_have_made() -> None:
    """An edge may be dragged of a room that was confirmed, drawn or made of two; the page shows it so."""
    grown, more = ([[0.1, 0.1], [4.1, 0.1], [4.1, y], [0.1, y]] for y in (4.1, 5.1))
    assert areas(corrected(room=[1.0, 1.0], room_outline=grown).plan) == [9.0, 16.0]
    assert areas(corrected(room_outline=[grown, more]).plan) == [9.0, 20.0]
    whole = [[0.1, 0.1], [7.2, 0.1], [7.2, 4.1], [0.1, 4.1]]
    both = Override(one_room=[[1.0, 1.0], [5.5, 1.5]]).corrections
    found = correct_plan(PLAN, [*both, *Override(room_outline=whole).corrections])
    assert [effect.outcome for effect in found.effects] == ["done", "done"]
    assert areas(found.plan) == [pytest.approx(7.1 * 4.0)]
    part = Override(room_outline=[[3.0, 0.1], [7.2, 0.1], [7.2, 3.1], [3.0, 3.1]]).corrections
    assert areas(correct_plan(PLAN, [*both, *part]).plan) == [pytest.approx(8.4), pytest.approx(12.6, abs=0.3)]


def test_an_outline_over_two_rooms_takes_from_both() -> None:
    alone = corrected(room_outline=[[0.1, 0.1], [7.2, 0.1], [7.2, 3.1], [0.1, 3.1]])
    assert areas(alone.plan) == [pytest.approx(21.3)]
    assert not alone.plan.doors
    found = corrected(room_outline=[[2.1, 0.1], [6.2, 0.1], [6.2, 3.1], [2.1, 3.1]])
    assert areas(found.plan) == [pytest.approx(0.9 * 3.0), pytest.approx(1.9 * 3.0), pytest.approx(4.1 * 3.0)]
    assert kinds(found.plan) == ["cut", "cut"]
    across = corrected(room_outline=[[2.1, 0.1], [6.2, 0.1], [6.2, 1.0], [2.1, 1.0]])  # below the door between them
    assert kinds(across.plan) == ["cut", "door"]


def test_an_outline_takes_walls_and_furniture_inside_it_out_and_a_strip_of_another_room() -> None:
    """A classroom with two rows of desks and a step in its edge; a person draws over these and over part of a hall."""
    desks = box(1.0, 1.0, 5.0, 1.2), box(1.0, 2.0, 5.0, 2.6)
    ring = [(0.0, 0.0), (6.0, 0.0), (6.0, 3.7), (4.0, 3.7), (4.0, 4.0), (0.0, 4.0)]
    room, hall = Room(0, "Office", ring, desks), Room(1, "Hallway", box(6.1, 0.0, 9.0, 4.0))
    plan = FloorPlan("school", box(0.0, 0.0, 9.0, 4.0), 2, {}, desks, rooms=(room, hall))
    for right in (5.8, 6.7, 8.9):
        drawn = [[0.1, 0.2], [right, 0.2], [right, 3.9], [0.1, 3.9]]
        found = corrected(plan, room_outline=drawn)
        assert has_outline(found.plan, drawn)
        assert not found.plan.rooms[0].holes
        assert found.plan.rooms[0].label == "Office"
        assert len(found.plan.rooms) == (1 if right == 8.9 else 2)  # a strip of 0.1 m is no room
        assert corrected(plan, room_outline=[drawn, [[x + 0.03, y] for x, y in drawn]]).effects[1].outcome == "done"


def test_of_outlines_with_a_common_edge_the_later_is_kept_and_a_wall_stands_between_them() -> None:
    one, other = ([[x, 3.0], [x + 4.0, 3.0], [x + 4.0, 8.0], [x, 8.0]] for x in (2.0, 6.0))
    found = corrected(wrong(), room_outline=[one, other], opening=[[6.0, 4.0], [6.0, 6.0]])
    assert [effect.outcome for effect in found.effects] == ["done", "done", "done"]
    assert has_outline(found.plan, other)
    assert 19.5 in areas(found.plan)
    assert "opening" in kinds(found.plan)


def test_an_outline_grows_a_room_and_takes_the_entrance_in_its_former_edge_out() -> None:
    entrance = Door(1, "entrance", ((0.0, 1.0), (0.0, 1.8)), 0.8, box(-0.1, 1.0, 0.1, 1.8), (0, None))
    plan = replace(PLAN, doors=(*PLAN.doors, entrance))
    up = corrected(plan, room_outline=[[0.1, 0.1], [4.1, 0.1], [4.1, 4.1], [0.1, 4.1]])
    assert areas(up.plan) == [9.0, 16.0]
    assert kinds(up.plan) == ["door", "entrance"]
    left = corrected(plan, room_outline=[[-0.9, 0.1], [4.1, 0.1], [4.1, 3.1], [-0.9, 3.1]])
    assert areas(left.plan) == [9.0, 15.0]
    assert kinds(left.plan) == ["door"]
    assert "the entrance of 0.80 m is gone" in left.effects[0].also


def test_the_only_room_of_a_plan_is_replaced_by_one_that_a_person_draws() -> None:
    drawn = [[8.0, 0.0], [20.0, 0.0], [20.0, 10.0], [8.0, 10.0]]  # a third of it lies in the room
    refused = corrected(wrong(), no_room=[1.0, 1.0])
    assert "it is the only room of the plan; draw the right one with room_outline" in refused.effects[0].said
    drawn_alone = corrected(wrong(), room_outline=drawn)
    assert areas(drawn_alone.plan) == pytest.approx([79.0, 120.0])
    found = corrected(wrong(), room_outline=drawn, no_room=[1.0, 1.0])
    assert [effect.outcome for effect in found.effects] == ["done", "done"]
    assert areas(found.plan) == pytest.approx([120.0])
    assert not found.plan.doors


def test_a_line_that_was_said_stays_where_it_is_when_another_crosses_it() -> None:
    first = [[0.1, 4.0], [10.1, 4.0]]
    alone = corrected(hall(), opening=first)
    both = corrected(hall(), opening=[first, [[4.0, 0.1], [4.0, 3.0]]])
    assert [effect.outcome for effect in both.effects] == ["done", "done"]
    ways = shapely.union_all([door.polygon for door in both.plan.doors])
    assert all(shapely.difference(door.polygon, ways).area < 0.02 for door in alone.plan.doors)


@pytest.mark.parametrize("x", [4.1, 4.12, 4.15, 4.18, 4.2, 4.05, 4.3])
def test_a_wall_over_a_doorway_or_just_before_it_shuts_it(x: float) -> None:
    found = corrected(wall=[[x, 0.9], [x, 2.1]])
    assert found.effects[0].outcome == "done"
    assert "the door of 0.80 m there is shut" in found.effects[0].also
    assert not found.plan.doors
    again = corrected(wall=[[x, 0.9], [x, 2.1]], door=[[4.15, 1.1], [4.15, 1.9]])
    assert [effect.outcome for effect in again.effects] == ["done", "done"]
    assert kinds(again.plan) == ["door"]
    assert kinds(corrected(wall=[[x, 0.1], [x, 0.9]]).plan) == ["door"]


def test_a_preview_of_a_plan_that_was_built_with_words_shows_that_plan() -> None:
    frame = Frame(((1.0, 0.0, 3.0), (0.0, 1.0, 5.0)), "z", 0.0, 0)
    words: dict[str, Any] = {"wall": [[5.0, 5.1], [5.0, 8.1]], "label": [8.0, 6.0, "Office"]}
    built = correct_plan(replace(PLAN, frame=frame), Override(**words).corrections)
    assert "cut" in kinds(built.plan)
    told = {"corrections": [effect.as_record() for effect in built.effects]}
    plan = replace(built.plan, provenance={**(built.plan.provenance or {}), **told})
    again = preview(plan, Override(**words).corrections)
    assert encode(again.plan) == encode(plan)
    assert all(record["built"] for record in again.records)
    more = preview(plan, Override(**words, no_room=[4.0, 6.0]).corrections)
    assert [record["built"] for record in more.records] == [True, False, True]
    assert len(more.plan.rooms) == len(plan.rooms) - 1


def test_a_preview_has_the_quality_of_the_built_plan() -> None:
    said = Override(label=[5.0, 1.0, "Office"]).corrections
    frame = Frame(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)), "z", 0.0, 0)
    base = replace(PLAN, frame=frame, quality=Quality(0.2, {"cut_share": 0.5}))
    built = replace(correct_plan(base, said).plan, quality=Quality(0.4, {"tall": 0.8}))
    assert preview(built, said, base).plan.quality == built.quality


@pytest.mark.parametrize("x", [4.1, 4.15, 4.2])
def test_walls_that_shut_a_doorway_only_together_are_one_fact(x: float) -> None:
    halves = [[[x, 1.0], [x, 1.48]], [[x, 1.52], [x, 2.0]]]
    alone = corrected(wall=halves[0])
    assert kinds(alone.plan) == ["door"]
    for walls in (halves, halves[::-1]):
        both = corrected(wall=walls)
        assert [effect.outcome for effect in both.effects] == ["done", "done"]
        assert all("the door of 0.80 m there is shut" in effect.sentence for effect in both.effects)
        assert not both.plan.doors
        assert not any("a cut" in line for line in both.followed)
    stub = corrected(wall=[[[x, 0.8], [x, 1.3]], [[x, 1.3], [1.0, 1.3]]])  # the second one lies across
    assert kinds(stub.plan) == ["door"]
    drawn = corrected(wall=halves, door=[[4.15, 1.1], [4.15, 1.9]])
    assert kinds(drawn.plan) == ["door"]


@pytest.mark.parametrize("word", ["wall", "opening"])
def test_a_line_that_ends_in_a_door_makes_two_of_it_and_says_so(word: str) -> None:
    wide = Door(0, "opening", ((4.15, 0.6), (4.15, 2.6)), 2.0, box(4.1, 0.6, 4.2, 2.6), (0, 1), 0.8)
    found = corrected(replace(PLAN, doors=(wide,)), **{word: [[0.1, 1.6], [4.1, 1.6]]})
    assert [effect.outcome for effect in found.effects] == ["done"]
    ways = sorted((door.rooms, door.width) for door in found.plan.doors if door.width < 1.5)
    assert [width for _, width in ways] == pytest.approx([0.95, 0.95], abs=0.02)
    assert len({rooms for rooms, _ in ways}) == 2
    assert "the opening of 2.00 m is two now, of 0.95 m and 0.95 m" in found.effects[0].also


def test_a_wall_that_ends_in_a_narrow_door_leaves_it_to_the_room_at_most_of_it() -> None:
    found = corrected(wall=[[0.1, 1.4], [4.1, 1.4]])
    (door,) = (each for each in found.plan.doors if each.kind == "door")
    beside = next(room for room in found.plan.rooms if room.id == min(side for side in door.rooms if side is not None))
    assert door.width == 0.8
    assert {room.label for room in found.plan.rooms if room.id in door.rooms} >= {"Bedroom"}
    assert beside.polygon.centroid.y > 1.4


def test_a_wall_that_cuts_a_strip_off_names_it() -> None:
    niche = [(0.1, 0.1), (4.1, 0.1), (4.1, 3.1), (0.9, 3.1), (0.9, 3.7), (0.1, 3.7)]
    plan = FloorPlan("house", niche, 1, {}, rooms=(Room(0, "Kitchen", niche),))
    shut = corrected(plan, wall=[[0.1, 3.1], [0.9, 3.1]])
    assert shut.effects[0].also == ("0.4 m2 that it cuts off are in no room now",)
    assert corrected(wall=[[0.1, 2.1], [4.1, 2.1]]).effects[0].also == (
        "it parts a room into the kitchen of 7.8 m2 and the room of 3.8 m2",
    )


@pytest.mark.parametrize("stub", [[[2.0, 0.1], [2.0, 1.6]], [[4.1, 2.5], [3.0, 2.5]], [[4.1, 0.6], [3.0, 0.6]]])
def test_a_wall_that_stands_in_a_room_does_not_part_it_from_another(stub: list[list[float]]) -> None:
    plan = replace(PLAN, doors=())
    found = corrected(plan, wall=stub, one_room=[[1.0, 1.0], [5.0, 1.0]])
    assert [effect.outcome for effect in found.effects] == ["done", "done"]
    (room,) = found.plan.rooms
    assert room.area == pytest.approx(21.3 - 0.1 * abs(stub[0][0] - stub[1][0] + stub[0][1] - stub[1][1]), abs=0.05)
    parted = corrected(wall=[[2.0, 0.1], [2.0, 3.1]], one_room=[[1.0, 1.0], [3.0, 1.0]])
    assert [effect.outcome for effect in parted.effects] == ["done", "none"]


def test_a_passage_on_a_common_edge_ends_where_the_edge_ends() -> None:
    shapes = (box(0.0, 0.0, 6.0, 3.0), box(0.0, 3.0, 2.0, 6.0), box(2.1, 3.0, 6.0, 6.0))
    rooms = tuple(Room(k, "Office", shape) for k, shape in enumerate(shapes))
    whole = shapely.union_all([room.polygon for room in rooms])
    plan = FloorPlan("three", list(whole.exterior.coords[:-1]), 3, {}, rooms=rooms)
    found = corrected(plan, door=[[0.5, 3.0], [4.5, 3.0]])
    (door,) = found.plan.doors
    assert [door.segment[0][0], door.segment[1][0]] == pytest.approx([2.1, 4.5], abs=0.011)
    assert areas(found.plan) == pytest.approx([6.0, 11.58, 17.88], abs=0.02)
    assert "of the 4.00 m that were drawn, 2.40 m are clear" in found.effects[0].sentence
    twice = corrected(plan, door=[[[2.4, 3.0], [3.6, 3.0]], [[3.2, 3.0], [4.4, 3.0]]])
    assert [effect.outcome for effect in twice.effects] == ["done", "none"]
    assert "overlaps it, and is said too" in twice.effects[1].said
    assert corrected(plan, door=[[1.8, 3.0], [2.3, 3.0]]).effects[0].outcome == "none"


def test_a_passage_through_a_wall_of_a_few_centimetres_between_rooms_that_meet_elsewhere() -> None:
    lower, upper = box(0.0, 0.0, 6.0, 3.0), [(0.0, 3.0), (0.0, 6.0), (6.0, 6.0), (6.0, 3.03), (1.0, 3.03), (1.0, 3.0)]
    rooms = (Room(0, "Office", lower), Room(1, "Office", upper))
    whole = shapely.union_all([room.polygon for room in rooms])
    plan = FloorPlan("two", list(whole.exterior.coords[:-1]), 2, {}, rooms=rooms)
    found = corrected(plan, door=[[3.0, 3.015], [4.0, 3.015]])
    assert [effect.outcome for effect in found.effects] == ["done"]
    assert [door.width for door in found.plan.doors] == [1.0]


def test_a_window_for_an_entrance_says_nothing_of_the_ways_inside() -> None:
    shapes = (box(0.0, 0.0, 4.0, 3.0), box(4.1, 0.0, 8.0, 3.0))
    rooms = tuple(Room(k, "Office", shape) for k, shape in enumerate(shapes))
    inner = Door(0, "door", ((4.05, 1.0), (4.05, 1.8)), 0.8, box(4.0, 1.0, 4.1, 1.8), (0, 1))
    ways = [
        Door(1, "entrance", ((-0.05, 1.0), (-0.05, 1.8)), 0.8, box(-0.1, 1.0, 0.0, 1.8), (0, None)),
        Door(2, "entrance", ((8.05, 1.0), (8.05, 1.8)), 0.8, box(8.0, 1.0, 8.1, 1.8), (1, None)),
    ]
    whole = shapely.union_all([*(room.polygon for room in rooms), inner.polygon])
    plan = FloorPlan("two", list(whole.exterior.coords[:-1]), 2, {}, rooms=rooms, doors=(inner, *ways))
    parted = corrected(plan, wall=[[6.0, 0.0], [6.0, 3.0]], window=[8.05, 1.4])
    assert kinds(parted.plan) == ["cut", "door", "entrance"]


def test_a_wall_that_ends_in_an_entrance_makes_two_of_it() -> None:
    hall = box(0.0, 0.0, 8.0, 4.0)
    entrance = Door(0, "entrance", ((3.0, -0.1), (4.78, -0.1)), 1.78, box(3.0, -0.2, 4.78, 0.0), (0, None))
    plan = FloorPlan("house", hall, 1, {}, rooms=(Room(0, "Hall", hall),), doors=(entrance,))
    for word in ("wall", "opening"):
        found = corrected(plan, **{word: [[4.26, 0.0], [4.26, 4.0]]})
        ways = [(door.rooms, door.width) for door in found.plan.doors if door.kind == "entrance"]
        assert ways == [((0, None), pytest.approx(1.21, abs=0.01)), ((1, None), pytest.approx(0.47, abs=0.01))]
        assert any("the entrance of 1.78 m is two now" in each for each in found.effects[0].also)
    beside = corrected(plan, wall=[[4.6, 0.0], [4.6, 4.0]])  # what is left of it is no door
    assert [door.width for door in beside.plan.doors if door.kind == "entrance"] == [1.78]


@pytest.mark.parametrize("line", [[[6.4, 2.9], [9.2, 2.9]], [[5.5, 2.8], [7.1, 3.5]], [[6.6, 1.0], [9.0, 1.0]]])
def test_an_entrance_whose_middle_lies_beyond_a_corner_of_its_room_does_nothing(line: list[list[float]]) -> None:
    found = corrected(entrance=line)
    assert [effect.outcome for effect in found.effects] == ["none"]
    assert "draw all of it in an outer wall" in found.effects[0].said
    assert found.plan.doors == PLAN.doors


def test_a_room_has_an_entrance_in_a_front_around_which_it_goes() -> None:
    ring = [(0.0, 0.0), (6.0, 0.0), (6.0, 6.0), (0.0, 6.0), (0.0, 3.0), (4.0, 3.0), (4.0, 2.6), (0.0, 2.6)]
    plan = FloorPlan("museum", ring, 1, {}, rooms=(Room(0, "Hall", ring),))
    for y in (2.7, 2.9):
        found = corrected(plan, entrance=[[1.0, y], [2.0, y]])
        assert [effect.outcome for effect in found.effects] == ["done"]
        (way,) = found.plan.doors
        assert (way.kind, way.rooms) == ("entrance", (0, None))
        assert way.polygon.area == pytest.approx(0.2, abs=0.21)
        assert shapely.intersection(way.polygon, found.plan.rooms[0].polygon).area < 0.01


def test_rooms_that_are_one_lose_the_walls_that_the_source_does_not_show() -> None:
    shapes = (box(0.0, 0.0, 4.0, 6.0), box(4.1, 0.0, 8.0, 6.0))
    rooms = tuple(Room(k, "Office", shape) for k, shape in enumerate(shapes))
    way = Door(0, "door", ((4.05, 2.0), (4.05, 3.0)), 1.0, box(4.0, 2.0, 4.1, 3.0), (0, 1))
    whole = shapely.union_all([*(room.polygon for room in rooms), way.polygon])
    holes = tuple(list(ring.coords[:-1]) for ring in whole.interiors)
    plan = FloorPlan("two", list(whole.exterior.coords[:-1]), 2, {}, holes, rooms=rooms, doors=(way,))
    around = Polygon(box(-0.1, -0.1, 8.1, 6.1), [box(0.0, 0.0, 8.0, 6.0)])
    said = Override(one_room=[[1.0, 1.0], [5.0, 1.0]]).corrections
    stub = Polygon(box(4.0, 0.0, 4.1, 2.0))  # what the source shows; the plan has a wall from 3 to 6 m, too
    found = correct_plan(plan, said, walls=[around, stub])
    (room,) = found.plan.rooms
    assert room.area == pytest.approx(48.0 - 0.2, abs=0.02)
    assert "0.3 m2 of wall between them that the source does not show are floor" in found.effects[0].also
    assert correct_plan(plan, said).plan.rooms[0].area == pytest.approx(48.0 - 0.5, abs=0.02)
    seen = correct_plan(plan, said, walls=[around, stub, Polygon(box(4.0, 3.0, 4.1, 6.0))])
    assert seen.plan.rooms[0].area == pytest.approx(48.0 - 0.5, abs=0.02)
    drawn = Override(one_room=[[1.0, 1.0], [5.0, 1.0]], wall=[[4.05, 3.0], [4.05, 4.5]]).corrections
    kept = correct_plan(plan, drawn, walls=[around, stub]).plan.rooms
    assert sum(each.area for each in kept) == pytest.approx(48.0 - 0.2 - 0.16, abs=0.05)


@pytest.mark.parametrize("y", [2.4, 2.45, 2.55])
def test_a_door_where_a_leaf_stands_against_its_wall_keeps_its_width(y: float) -> None:
    kitchen, bedroom = PLAN.rooms
    leaf = box(3.6, 2.46, 4.1, 2.5)  # drawn open, and read as a wall
    notched = [(0.1, 0.1), (0.1, 3.1), (4.1, 3.1), (4.1, 2.5), (3.6, 2.5), (3.6, 2.46), (4.1, 2.46), (4.1, 0.1)]
    assert Polygon(notched).disjoint(Polygon(leaf).buffer(-0.01))
    plan = replace(PLAN, rooms=(replace(kitchen, ring=np.array(notched)), bedroom))
    found = corrected(plan, door=[[4.15, y - 0.4], [4.15, y + 0.4]])
    assert found.plan.doors[1].width == pytest.approx(0.8, abs=0.1)


def test_a_cut_to_a_new_room_lies_where_the_walls_leave_a_gap() -> None:
    closet = Polygon(box(7.3, 0.1, 9.3, 3.1))  # behind a wall of 0.1 m, with a gap of 0.7 m at its upper end
    walls = [Polygon(box(7.2, 0.0, 7.3, 2.3)), Polygon(box(7.2, 3.0, 7.3, 3.2))]
    standing = [shapely.union_all([*walls, Polygon(box(7.2, 2.3, 7.3, 3.0))])]
    said = [Correction("room", (8.3, 1.5))]
    found = correct_plan(PLAN, said, [Space(closet, reachable=False)], standing, walls=walls)
    (cut,) = (door for door in found.plan.doors if door.kind == "cut")
    assert cut.polygon.bounds == pytest.approx((7.2, 2.3, 7.3, 3.0), abs=0.011)
    assert "where the walls leave a gap" in found.followed[0]
    (cut,) = (
        door
        for door in correct_plan(PLAN, said, [Space(closet, reachable=False)], standing, walls=standing).plan.doors
        if door.kind == "cut"
    )
    assert cut.width == CUT_M
