from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np
import pytest

from houseexpo.errors import PlanError
from houseexpo.floorplan import FloorPlan
from houseexpo.grids.frame import source_points_from_plan
from houseexpo.plan import PlanObject, Quality, Room

SQUARE = [(0.1, 0.1), (0.1, 4.1), (4.1, 4.1), (4.1, 0.1)]
BOW_TIE = [(0.0, 0.0), (2.0, 2.0), (2.0, 0.0), (0.0, 2.0)]


def test_measures_of_a_plan_with_a_hole(two_rooms):
    assert two_rooms.area == pytest.approx(12 - 0.16 + 9 + 0.08)
    assert two_rooms.outline.area == pytest.approx(12 + 9 + 0.08)
    assert two_rooms.bbox == (0.1, 0.1, 7.2, 3.1)
    assert two_rooms.room(0).area == pytest.approx(11.84)
    assert two_rooms.doors[0].polygon.area == pytest.approx(0.08)
    tiled = sum(room.area for room in two_rooms.rooms) + two_rooms.doors[0].polygon.area
    assert tiled == pytest.approx(two_rooms.area)


def test_a_ring_that_crosses_itself_is_kept_and_its_area_is_even_odd():
    plan = FloorPlan("bow", BOW_TIE, 1, {})
    assert plan.verts.tolist() == [list(p) for p in BOW_TIE]
    assert plan.free_space.is_valid
    assert plan.area == pytest.approx(2.0)


def test_arrays_are_copies_that_cannot_be_written():
    verts = np.array(SQUARE)
    plan = FloorPlan("a", verts, 1, {})
    verts[0] = 9.0
    assert plan.verts[0].tolist() == [0.1, 0.1]
    with pytest.raises(ValueError, match="read-only"):
        plan.verts[0] = 1.0


def test_equality_is_by_value(two_rooms):
    other = pickle.loads(pickle.dumps(two_rooms))  # noqa: S301 - our own bytes
    assert other == two_rooms
    assert hash(other) == hash(two_rooms)
    assert not other.verts.flags.writeable
    assert replace(two_rooms, room_num=3) != two_rooms
    assert replace(two_rooms, holes=()) != two_rooms
    assert two_rooms != "two_rooms"


def test_quality_and_objects_are_values_too(furnished, two_rooms):
    other = pickle.loads(pickle.dumps(furnished))  # noqa: S301 - our own bytes
    assert other == furnished
    assert other.quality == Quality(0.93, {"cut_share": 0.0, "guessed_wall_share": 0.1})
    assert hash(other.quality) == hash(furnished.quality)
    assert replace(furnished, quality=None) != furnished
    assert replace(furnished, objects=()) != furnished
    assert [repr(part).partition("(")[0] for part in (*furnished.objects, *furnished.rooms)] == [
        "PlanObject",
        "Room",
        "Room",
    ]
    assert (two_rooms.quality, two_rooms.objects) == (None, ())


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Quality(-0.1), "score: expected 0 to 1, found -0.1"),
        (lambda: Quality(float("nan")), "score: expected a finite number"),
        (lambda: Quality(1, {"cuts": float("inf")}), "grounds.cuts: expected a finite number"),
        (lambda: Quality(1, {"": 1.0}), "grounds: expected a name"),
        (lambda: PlanObject(0, "bed", True, SQUARE, 0.5), "room: expected an integer"),
        (lambda: PlanObject(0, "bed", None, SQUARE[:2], 0.5), "polygon: expected at least 3 vertices"),
        (lambda: PlanObject(0, "bed", None, SQUARE, -0.5), "height: expected metres, 0 or more"),
    ],
)
def test_a_broken_quality_or_object_is_refused(make, message):
    with pytest.raises(PlanError, match=message):
        make()


def test_objects_have_ids_of_their_own_and_stand_in_rooms_that_exist(furnished):
    (stove,) = furnished.objects
    with pytest.raises(PlanError, match=r"plan 'furnished': objects\[1\].id: expected ids that differ"):
        replace(furnished, objects=(stove, stove))
    with pytest.raises(PlanError, match=r"objects\[0\].room: expected null or one of \[0, 1\], found 5"):
        replace(furnished, objects=(replace(stove, room=5),))


def test_objects_move_with_the_plan(furnished):
    moved = furnished.moved(2.0, -1.0)
    np.testing.assert_allclose(moved.objects[0].ring, furnished.objects[0].ring + np.array([2.0, -1.0]))
    assert moved.quality == furnished.quality


def test_centred_moves_everything_and_the_frame_leads_to_the_same_place(two_rooms):
    centred = two_rooms.centred()
    assert centred.free_space.centroid.coords[0] == pytest.approx((0.0, 0.0), abs=1e-12)
    assert centred.area == pytest.approx(two_rooms.area)
    before = source_points_from_plan(two_rooms.frame, two_rooms.verts)
    np.testing.assert_allclose(source_points_from_plan(centred.frame, centred.verts), before, atol=1e-12)
    shift = centred.verts[0] - two_rooms.verts[0]
    for part, part_ in zip((*two_rooms.rooms, *two_rooms.doors), (*centred.rooms, *centred.doors), strict=True):
        np.testing.assert_allclose(part_.ring - part.ring, np.broadcast_to(shift, part.ring.shape))
    np.testing.assert_allclose(np.array(centred.doors[0].segment) - two_rooms.doors[0].segment, [shift, shift])
    np.testing.assert_allclose(centred.room_category["Living_Room"][0][:2], np.array([0.1, 0.1]) + shift)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"id": ""}, "id: expected 1 to 200 characters"),
        ({"id": "../etc"}, "safe as a file name"),
        ({"id": ".hidden"}, "safe as a file name"),
        ({"id": "half a character \ud800"}, "safe as a file name"),
        ({"id": 7}, "id: expected"),
        ({"verts": [(0, 0), (1, 1)]}, r"plan 'a': verts: expected at least 3 vertices .* shape \(2, 2\)"),
        ({"verts": [(0, 0, 0), (1, 1, 0), (1, 0, 0)]}, r"verts: .* shape \(3, 3\)"),
        ({"verts": [(0, 0), (1, 1), (np.nan, 0)]}, r"verts\[2\]: expected finite metres"),
        ({"verts": [(0, 0), (1, 1), "x"]}, "verts: expected a list"),
        ({"verts": [*SQUARE, SQUARE[0]]}, "verts: expected an unclosed ring"),
        ({"holes": ([(0, 0), (1, np.inf), (1, 1)],)}, r"holes\[0\]\[1\]: expected finite"),
        ({"verts": [(0, 0), (1, 1), (1e308, 0)]}, r"verts\[2\]: expected finite metres, 20000 from the origin at most"),
        ({"verts": [(0, 0), (1, 1e5), (1, 0)]}, r"verts\[1\]: expected finite metres, 20000 from the origin"),
        ({"verts": np.random.default_rng(0).random((100_001, 2))}, "verts: expected at most 100000 vertices"),
        ({"room_num": 2**31}, "room_num: expected an integer from 0 to 2147483647"),
        ({"room_num": -1}, "room_num: expected an integer"),
        ({"room_num": True}, "room_num: expected an integer"),
        ({"room_category": {"Gym": [(0, 0, 1)]}}, r"room_category.Gym\[0\]: expected 4 numbers"),
        ({"room_category": {"Gym": [(0, 0, 1, np.nan)]}}, r"room_category.Gym\[0\]\[3\]: expected a finite"),
    ],
)
def test_a_broken_plan_is_refused_by_name_and_key(change, message):
    values = {"id": "a", "verts": SQUARE, "room_num": 1, "room_category": {}} | change
    with pytest.raises(PlanError, match=message):
        FloorPlan(**values)


def test_ids_must_differ_and_doors_name_rooms_that_exist(two_rooms):
    room, door = two_rooms.rooms[0], two_rooms.doors[0]
    with pytest.raises(PlanError, match=r"rooms\[1\].id: expected ids that differ, found 0 twice"):
        replace(two_rooms, rooms=(room, room))
    with pytest.raises(PlanError, match=r"doors\[1\].id"):
        replace(two_rooms, doors=(door, door))
    with pytest.raises(PlanError, match=r"doors\[0\].rooms: expected ids of rooms \[0\], found \[0, 1\]"):
        replace(two_rooms, rooms=(room,))
    with pytest.raises(PlanError, match="expected one of"):
        two_rooms.room(5)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"kind": "hatch"}, "kind: expected one of door, opening, entrance, cut, window; found 'hatch'"),
        ({"rooms": (0, None)}, "rooms: expected two room ids for kind 'door'"),
        ({"kind": "entrance"}, r"rooms: expected \[room, null\]"),
        ({"kind": "entrance", "rooms": (None, 0)}, r"rooms: expected \[room, null\]"),
        ({"segment": ((0, 0),)}, "segment: expected the two ends"),
        ({"width": float("inf")}, "width: expected a finite number"),
    ],
)
def test_a_broken_door_is_refused(two_rooms, change, message):
    with pytest.raises(PlanError, match=message):
        replace(two_rooms.doors[0], **change)


def test_room_labels_are_the_published_ones():
    with pytest.raises(PlanError, match="label: expected one of Bedroom"):
        Room(0, "Schlafzimmer", SQUARE)
